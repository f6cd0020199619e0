//! Figure 12: variance and bias of every method on cylinders and foliage that rotate.

mod picture;
mod scene;
mod study;
mod words;

use crate::context::Context;
use crate::gallery::Section;
use crate::output::{write_csv, write_png};
use scene::Setting;
use study::Study;

/// Measures, draws and explains.
pub(crate) fn draw(context: &Context) -> anyhow::Result<Section> {
    let side = context.spend(64, 128);
    let settings = [Setting::cylinders(side, context.seed())?, Setting::foliage(side, context.seed())?];
    let mut studies = vec![];
    for (index, setting) in settings.into_iter().enumerate() {
        studies.push(Study::new(context, setting, index as u64)?);
    }
    let canvas = picture::draw(&studies, &words::caption(&studies)).canvas;
    write_png(&context.path(words::PICTURE), &canvas)?;
    write_csv(&context.path(words::DATA), &words::table(&studies))?;
    Ok(words::section(&studies))
}
