//! Figure 10: bias and variance against N' and debiasing, for shadows and for two bounces.

mod page;
mod study;
mod text;
mod worlds;

use crate::context::Context;
use crate::gallery::{Picture, Section};
use crate::output::{write_csv, write_png};
use study::Study;
use worlds::Setting;

const PICTURE: &str = "figure10_path_bias.png";
const DATA: &str = "figure10_path_bias.csv";

/// Measures, draws and explains.
pub(crate) fn draw(context: &Context) -> anyhow::Result<Section> {
    context.step("10 exact derivatives");
    let settings = [Setting::shadow()?, Setting::room()?];
    let mut studies = vec![];
    for (index, setting) in settings.into_iter().enumerate() {
        context.step(&format!("10 bias: {}", setting.name));
        studies.push(Study::new(context, setting, index as u64)?);
    }
    write_png(&context.path(PICTURE), &page::draw(&studies, text::CAPTION).canvas)?;
    let table = text::table(&studies);
    write_csv(&context.path(DATA), &table)?;
    Ok(Section {
        id: "path-bias".to_owned(),
        title: "Bias along paths: shadows and two bounces".to_owned(),
        explanation_html: text::explanation(&studies),
        formula_mathml: text::formulas(),
        pictures: vec![Picture {
            file: PICTURE.to_owned(),
            alt: "Two flat worlds; bias against auxiliary rays and variance × rays of every scheme"
                .to_owned(),
            caption: String::new(),
        }],
        data: vec![DATA.to_owned()],
        table: Some(table),
    })
}
