//! Edge sampling and warped area as a scene grows.

mod foliage;
mod picture;
mod study;

use crate::context::Context;
use crate::gallery::Section;
use crate::output::Table;
use crate::plot::number;
use crate::prose::Prose;
use crate::ratio::Ratio;
use foliage::Foliage;
use study::{Plant, RACERS, Racer, Run};

use super::common::{listed, percent};

/// Draws the figure.
pub(crate) fn draw(context: &Context) -> anyhow::Result<Section> {
    let mut plants = vec![];
    for leaves in sizes(context) {
        context.step(&format!("{leaves} leaves"));
        plants.push(study::measure(context, leaves)?);
    }
    let examples = [Foliage::new(32, context.seed())?, Foliage::new(256, context.seed())?];
    let prose = prose(&plants)?;
    let canvas = picture::rays(&examples, &plants)?;
    context.png("edges.png", &canvas)?;
    context.png("edges_time.png", &picture::time(&plants))?;
    let data = [
        context.csv("edges.csv", &measurements(context, &plants))?,
        context.csv("edges_time.csv", &times(&plants))?,
    ];
    prose.section("edges", data.to_vec(), table(&plants))
}

/// The plants measured: powers of four in a draft, of two in full.
fn sizes(context: &Context) -> Vec<usize> {
    let step = context.spend(2, 1);
    (2..=context.spend(14, 16)).step_by(step).map(|power| 1 << power).collect()
}

/// Every plant with every method and its run.
fn races(plants: &[Plant]) -> impl Iterator<Item = (&Plant, &Racer, &Run)> {
    plants
        .iter()
        .flat_map(|plant| RACERS.iter().zip(&plant.runs).map(move |(racer, run)| (plant, racer, run)))
}

fn measurements(context: &Context, plants: &[Plant]) -> Table {
    let recovered = |run: &Run| run.recovered.unwrap_or(Ratio { value: f64::NAN, error: f64::NAN });
    Table::of(
        races(plants),
        &[
            ("leaves", &|(plant, ..)| plant.leaves.into()),
            ("edges", &|(plant, ..)| plant.edges.into()),
            ("depth", &|(plant, ..)| plant.depth.into()),
            ("visible_length", &|(plant, ..)| plant.visible.into()),
            ("visible_length_exact", &|(plant, ..)| plant.visible_exact.unwrap_or(f64::NAN).into()),
            ("wasted_edge_samples", &|(plant, ..)| plant.wasted.into()),
            ("method", &|(_, racer, _)| racer.name.into()),
            ("samples_per_pixel", &|(_, racer, _)| racer.samples(context).into()),
            ("variance_per_sample", &|(.., run)| run.variance.into()),
            ("rays_per_sample", &|(.., run)| run.rays.into()),
            ("recovered", &|(.., run)| recovered(run).value.into()),
            ("recovered_standard_error", &|(.., run)| recovered(run).error.into()),
        ],
    )
}

fn times(plants: &[Plant]) -> Table {
    Table::of(
        races(plants),
        &[
            ("leaves", &|(plant, ..)| plant.leaves.into()),
            ("method", &|(_, racer, _)| racer.name.into()),
            ("samples_per_pixel", &|(_, racer, _)| racer.timed.into()),
            ("seconds_per_sample", &|(.., run)| run.seconds.into()),
        ],
    )
}

/// The text on plants of growing size.
fn prose(plants: &[Plant]) -> anyhow::Result<Prose> {
    let (first, last) = (&plants[0], &plants[plants.len() - 1]);
    let ratio = |plant: &Plant, value: fn(&Run) -> f64| number(value(&plant.runs[1]) / value(&plant.runs[0]));
    // The largest plant whose exact derivative is known.
    let known = plants.iter().rfind(|plant| plant.runs.iter().all(|run| run.recovered.is_some()));
    let known = known.unwrap_or(first);
    let recovered = RACERS.iter().zip(&known.runs).map(|(r, run)| format!("{}: {}", r.name, shown(run)));
    Prose::new(
        include_str!("edges.md"),
        &[
            ("few", &first.leaves),
            ("many", &last.leaves),
            ("seen_few", &percent(first.visible)),
            ("seen_many", &percent(last.visible)),
            ("wasted", &percent(last.wasted)),
            ("depth", &number(last.depth)),
            ("rays_few", &ratio(first, Run::rays_cost)),
            ("time_few", &ratio(first, Run::time_cost)),
            ("rays_many", &ratio(last, Run::rays_cost)),
            ("time_many", &ratio(last, Run::time_cost)),
            ("ahead_variance", &ahead(plants, |run| run.variance)),
            ("ahead_rays", &ahead(plants, Run::rays_cost)),
            ("ahead_time", &ahead(plants, Run::time_cost)),
            ("edges", &last.edges),
            ("known", &known.leaves),
            ("recovered", &listed(recovered)),
            ("timed", &RACERS[0].timed),
        ],
    )
}

/// Sizes from which warped area overtakes edge sampling, if any.
fn ahead(plants: &[Plant], value: fn(&Run) -> f64) -> String {
    match plants.iter().find(|plant| value(&plant.runs[1]) < value(&plant.runs[0])) {
        Some(plant) => format!("warped area is ahead from {} leaves on", plant.leaves),
        None => "edge sampling is ahead throughout".to_owned(),
    }
}

fn shown(run: &Run) -> String {
    let words = |Ratio { value, error }| format!("{value:.3} ± {error:.3}");
    run.recovered.map_or_else(|| "–".to_owned(), words)
}

fn table(plants: &[Plant]) -> Table {
    Table::of(
        plants,
        &[
            ("leaves", &|plant| plant.leaves.into()),
            ("edges", &|plant| plant.edges.into()),
            ("depth", &|plant| plant.depth.into()),
            ("edge length seen", &|plant| plant.visible.into()),
            ("edge samples wasted", &|plant| plant.wasted.into()),
            ("variance, edge sampling", &|plant| plant.runs[0].variance.into()),
            ("variance, warped area", &|plant| plant.runs[1].variance.into()),
            ("recovered: edge sampling", &|plant| shown(&plant.runs[0]).into()),
            ("recovered: warped area", &|plant| shown(&plant.runs[1]).into()),
            ("recovered: 16 rays", &|plant| shown(&plant.runs[2]).into()),
        ],
    )
}
