//! Figure 11: a mesh in a room, and the gradient image of its motion, term by term.

mod picture;
mod scene;
mod study;
mod words;

use glam::DVec3;

use crate::context::Context;
use crate::gallery::Section;
use crate::output::{write_csv, write_exr, write_png};
use study::{Part, Study};

/// Measures, draws and explains.
pub(crate) fn draw(context: &Context) -> anyhow::Result<Section> {
    let study = Study::new(context)?;
    let canvas = picture::draw(&study, &words::caption(&study)).canvas;
    write_png(&context.path(words::PICTURE), &canvas)?;
    write_csv(&context.path(words::DATA), &words::table(&study))?;
    let mut data = vec![words::DATA.to_owned()];
    for part in Part::ALL {
        for (name, method) in [("warped", &study.warped), ("edges", &study.edges)] {
            let file = format!("figure11_{}_{name}.exr", part.file());
            write_image(context, &file, &study, &method.mean(part))?;
            data.push(file);
        }
    }
    let file = "figure11_whole_differences.exr".to_owned();
    write_image(context, &file, &study, &study.differences.reference().gradient)?;
    data.push(file);
    Ok(words::section(&study, data))
}

fn write_image(context: &Context, file: &str, study: &Study, pixels: &[DVec3]) -> anyhow::Result<()> {
    let pixels: Vec<[f32; 3]> = pixels.iter().map(|pixel| pixel.as_vec3().to_array()).collect();
    write_exr(&context.path(file), study.side, study.side, &pixels)
}
