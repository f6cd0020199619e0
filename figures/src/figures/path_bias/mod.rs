//! Figure 10: bias and variance against N' and debiasing, for shadows and for two bounces.

mod page;
mod study;
mod text;
mod worlds;

use crate::context::Context;
use crate::gallery::Section;
use study::Study;
use worlds::Setting;

/// Measures, draws and explains.
pub(crate) fn draw(context: &Context) -> anyhow::Result<Section> {
    context.step("10 exact derivatives");
    let [shadow, room] = [Setting::shadow()?, Setting::room()?];
    let study = |setting: Setting, index: u64| {
        context.step(&format!("10 bias: {}", setting.name));
        Study::new(context, setting, index)
    };
    let studies = [study(shadow, 0)?, study(room, 1)?];
    let mut prose = text::prose(&studies)?;
    let caption = prose.take_caption("figure10_path_bias.png")?;
    context.png("figure10_path_bias.png", &page::draw(&studies, &caption).canvas)?;
    let table = text::table(&studies);
    let data = context.csv("figure10_path_bias.csv", &table)?;
    prose.section("path-bias", vec![data], table)
}
