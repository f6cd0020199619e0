//! Figure 11: a mesh in a room, and the gradient image of its motion, term by term.

mod picture;
mod scene;
mod study;
mod words;

use crate::context::Context;
use crate::gallery::Section;
use study::{Part, Study};

/// Measures, draws and explains.
pub(crate) fn draw(context: &Context) -> anyhow::Result<Section> {
    let study = Study::new(context)?;
    let mut prose = words::prose(&study)?;
    let caption = prose.take_caption("figure11_mesh.png")?;
    context.png("figure11_mesh.png", &picture::draw(&study, &caption).canvas)?;
    let table = words::table(&study);
    let mut data = vec![context.csv("figure11_terms.csv", &table)?];
    for part in Part::ALL {
        for (name, method) in [("warped", &study.warped), ("edges", &study.edges)] {
            let file = format!("figure11_{}_{name}.exr", part.file());
            data.push(context.exr(&file, study.side, &method.mean(part))?);
        }
    }
    let differences = study.differences.reference().gradient;
    data.push(context.exr("figure11_whole_differences.exr", study.side, &differences)?);
    prose.section("mesh", data, table)
}
