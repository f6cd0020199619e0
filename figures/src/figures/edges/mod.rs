//! Figure 4: edge sampling and warped area as a scene grows.

mod foliage;
mod picture;
mod study;
mod words;

use crate::context::Context;
use crate::gallery::Section;
use crate::output::{Table, write_csv, write_png};
use foliage::Foliage;
use study::{Plant, Racer};

/// Draws it.
pub(crate) fn draw(context: &Context) -> anyhow::Result<Section> {
    let mut plants = vec![];
    for leaves in sizes(context) {
        context.step(&format!("figure 4: {leaves} leaves"));
        plants.push(study::measure(context, leaves)?);
    }
    let examples = [Foliage::new(32, context.seed())?, Foliage::new(256, context.seed())?];
    let canvas = picture::rays(&examples, &plants, &words::rays_caption())?;
    write_png(&context.path("figure4_edges.png"), &canvas)?;
    write_png(&context.path("figure4_time.png"), &picture::time(&plants, &words::time_caption()))?;
    write_csv(&context.path("figure4_edges.csv"), &measurements(context, &plants))?;
    write_csv(&context.path("figure4_time.csv"), &times(&plants))?;
    Ok(words::section(&plants))
}

/// The plants measured: powers of four in a draft, of two in full.
fn sizes(context: &Context) -> Vec<usize> {
    let step = context.spend(2, 1);
    (2..=context.spend(14, 16)).step_by(step).map(|power| 1 << power).collect()
}

fn measurements(context: &Context, plants: &[Plant]) -> Table {
    let mut table = Table::new(&[
        "leaves",
        "edges",
        "depth",
        "visible_length",
        "visible_length_exact",
        "wasted_edge_samples",
        "method",
        "samples_per_pixel",
        "variance_per_sample",
        "rays_per_sample",
        "recovered",
        "recovered_standard_error",
    ]);
    for plant in plants {
        for (racer, run) in Racer::ALL.into_iter().zip(&plant.runs) {
            let [recovered, error] = run.recovered.unwrap_or([f64::NAN; 2]);
            table.row([
                plant.leaves.into(),
                plant.edges.into(),
                plant.depth.into(),
                plant.visible.into(),
                plant.visible_exact.unwrap_or(f64::NAN).into(),
                plant.wasted.into(),
                racer.name().into(),
                racer.samples(context).into(),
                run.variance.into(),
                run.rays.into(),
                recovered.into(),
                error.into(),
            ]);
        }
    }
    table
}

fn times(plants: &[Plant]) -> Table {
    let mut table = Table::new(&["leaves", "method", "samples_per_pixel", "seconds_per_sample"]);
    for plant in plants {
        for (racer, run) in Racer::ALL.into_iter().zip(&plant.runs) {
            let samples = racer.timed_samples().into();
            table.row([plant.leaves.into(), racer.name().into(), samples, run.seconds.into()]);
        }
    }
    table
}
