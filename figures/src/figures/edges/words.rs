//! The numbers of `edges.md`.

use super::study::{Plant, Racer, Run};
use crate::figures::common::percent;
use crate::output::Table;
use crate::plot::number;
use crate::prose::Prose;

/// The text on plants of growing size, and what it says of them.
pub(super) fn prose(plants: &[Plant]) -> anyhow::Result<Prose> {
    let (first, last) = (&plants[0], &plants[plants.len() - 1]);
    let ratio = |plant: &Plant, value: fn(&Run) -> f64| number(value(&plant.runs[1]) / value(&plant.runs[0]));
    // The largest plant whose exact derivative is known.
    let known = plants.iter().rfind(|plant| plant.runs.iter().all(|run| run.recovered.is_some()));
    let known = known.unwrap_or(first);
    let recovered = Racer::ALL.into_iter().zip(&known.runs);
    let recovered = recovered.map(|(racer, run)| format!("{}: {}", racer.name(), shown(run)));
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
            ("recovered", &recovered.collect::<Vec<_>>().join("; ")),
            ("timed", &Racer::Edges.timed_samples()),
        ],
    )
}

/// Where warped area overtakes edge sampling, if it does.
fn ahead(plants: &[Plant], value: fn(&Run) -> f64) -> String {
    match plants.iter().find(|plant| value(&plant.runs[1]) < value(&plant.runs[0])) {
        Some(plant) => format!("warped area is ahead from {} leaves on", plant.leaves),
        None => "edge sampling is ahead throughout".to_owned(),
    }
}

fn shown(run: &Run) -> String {
    run.recovered.map_or_else(|| "–".to_owned(), |[part, error]| format!("{part:.3} ± {error:.3}"))
}

pub(super) fn table(plants: &[Plant]) -> Table {
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
