//! Figure 8: a near-specular lobe: edge sampling and warped area on an object seen by reflection.

mod picture;
mod scene;
mod study;
mod words;

use crate::context::Context;
use crate::gallery::Section;
use crate::output::{write_csv, write_png};
use words::Results;

/// Measures, draws and explains.
pub(crate) fn draw(context: &Context) -> anyhow::Result<Section> {
    context.step("8 the lobe narrows");
    let widths = study::against_width(context)?;
    context.step("8 the object has more vertices");
    let vertices = study::against_vertices(context)?;
    let canvas = picture::variance(&widths, &vertices, &words::variance_caption())?;
    write_png(&context.path(words::VARIANCE), &canvas)?;
    let canvas = picture::time(&widths, &vertices, words::TIME_CAPTION);
    write_png(&context.path(words::TIME), &canvas)?;
    let results = Results { widths, vertices };
    write_csv(&context.path(words::VARIANCE_DATA), &results.table())?;
    write_csv(&context.path(words::TIME_DATA), &results.times())?;
    Ok(results.section())
}
