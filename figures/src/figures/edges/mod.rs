//! Figure 4: edge sampling and warped area as a scene grows.

mod foliage;
mod picture;
mod study;
mod words;

use crate::context::Context;
use crate::gallery::Section;
use crate::output::Table;
use foliage::Foliage;
use study::{Plant, Racer, Run};

/// Draws it.
pub(crate) fn draw(context: &Context) -> anyhow::Result<Section> {
    let mut plants = vec![];
    for leaves in sizes(context) {
        context.step(&format!("figure 4: {leaves} leaves"));
        plants.push(study::measure(context, leaves)?);
    }
    let examples = [Foliage::new(32, context.seed())?, Foliage::new(256, context.seed())?];
    let mut prose = words::prose(&plants)?;
    let canvas = picture::rays(&examples, &plants, &prose.take_caption("figure4_edges.png")?)?;
    context.png("figure4_edges.png", &canvas)?;
    context.png("figure4_time.png", &picture::time(&plants, &prose.take_caption("figure4_time.png")?))?;
    let data = [
        context.csv("figure4_edges.csv", &measurements(context, &plants))?,
        context.csv("figure4_time.csv", &times(&plants))?,
    ];
    prose.section("edges", data.to_vec(), words::table(&plants))
}

/// The plants measured: powers of four in a draft, of two in full.
fn sizes(context: &Context) -> Vec<usize> {
    let step = context.spend(2, 1);
    (2..=context.spend(14, 16)).step_by(step).map(|power| 1 << power).collect()
}

/// Every plant with every racer and its run.
fn races(plants: &[Plant]) -> impl Iterator<Item = (&Plant, Racer, &Run)> {
    plants
        .iter()
        .flat_map(|plant| Racer::ALL.into_iter().zip(&plant.runs).map(move |(r, run)| (plant, r, run)))
}

fn measurements(context: &Context, plants: &[Plant]) -> Table {
    Table::of(
        races(plants),
        &[
            ("leaves", &|(plant, ..)| plant.leaves.into()),
            ("edges", &|(plant, ..)| plant.edges.into()),
            ("depth", &|(plant, ..)| plant.depth.into()),
            ("visible_length", &|(plant, ..)| plant.visible.into()),
            ("visible_length_exact", &|(plant, ..)| plant.visible_exact.unwrap_or(f64::NAN).into()),
            ("wasted_edge_samples", &|(plant, ..)| plant.wasted.into()),
            ("method", &|(_, racer, _)| racer.name().into()),
            ("samples_per_pixel", &|(_, racer, _)| racer.samples(context).into()),
            ("variance_per_sample", &|(.., run)| run.variance.into()),
            ("rays_per_sample", &|(.., run)| run.rays.into()),
            ("recovered", &|(.., run)| run.recovered.map_or(f64::NAN, |[part, _]| part).into()),
            ("recovered_standard_error", &|(.., run)| {
                run.recovered.map_or(f64::NAN, |[_, error]| error).into()
            }),
        ],
    )
}

fn times(plants: &[Plant]) -> Table {
    Table::of(
        races(plants),
        &[
            ("leaves", &|(plant, ..)| plant.leaves.into()),
            ("method", &|(_, racer, _)| racer.name().into()),
            ("samples_per_pixel", &|(_, racer, _)| racer.timed_samples().into()),
            ("seconds_per_sample", &|(.., run)| run.seconds.into()),
        ],
    )
}
