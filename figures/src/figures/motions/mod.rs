//! Figure 12: variance and bias of every method on cylinders and foliage that rotate.

mod picture;
mod scene;
mod study;
mod words;

use crate::context::Context;
use crate::gallery::Section;
use scene::Setting;
use study::Study;

/// Measures, draws and explains.
pub(crate) fn draw(context: &Context) -> anyhow::Result<Section> {
    let side = context.spend(64, 128);
    let [cylinders, foliage] =
        [Setting::cylinders(side, context.seed())?, Setting::foliage(side, context.seed())?];
    let studies = [Study::new(context, cylinders, 0)?, Study::new(context, foliage, 1)?];
    let mut prose = words::prose(&studies)?;
    let caption = prose.take_caption("figure12_motions.png")?;
    context.png("figure12_motions.png", &picture::draw(&studies, &caption).canvas)?;
    let table = words::table(&studies);
    let data = context.csv("figure12_motions.csv", &table)?;
    prose.section("motions", vec![data], table)
}
