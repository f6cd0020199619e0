//! Figure 8: a near-specular lobe: edge sampling and warped area on an object seen by reflection.

mod picture;
mod scene;
mod study;
mod words;

use crate::context::Context;
use crate::gallery::Section;
use words::Results;

/// Measures, draws and explains.
pub(crate) fn draw(context: &Context) -> anyhow::Result<Section> {
    context.step("8 the lobe narrows");
    let widths = study::against_width(context)?;
    context.step("8 the object has more vertices");
    let vertices = study::against_vertices(context)?;
    let results = Results { widths, vertices };
    let mut prose = results.prose()?;
    let Results { widths, vertices } = &results;
    let canvas = picture::variance(widths, vertices, &prose.take_caption("figure8_specular.png")?)?;
    context.png("figure8_specular.png", &canvas)?;
    let canvas = picture::time(widths, vertices, &prose.take_caption("figure8_time.png")?);
    context.png("figure8_time.png", &canvas)?;
    let table = results.table();
    let data =
        [context.csv("figure8_specular.csv", &table)?, context.csv("figure8_time.csv", &results.times())?];
    prose.section("specular", data.to_vec(), table)
}
