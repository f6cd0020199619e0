//! The numbers of `mesh.md`.

use super::study::{Agreement, Part, RUNS, STEP, Study};
use crate::output::Table;
use crate::plot::number;
use crate::prose::Prose;
use crate::ratio::Ratio;

/// The text on the gradient image and its terms.
pub(super) fn prose(study: &Study) -> anyhow::Result<Prose> {
    let agreement = |part| study.warped.agreement(part, &study.edges.reference(part));
    let term = |part| slope(agreement(part).slope);
    let warped = agreement(Part::Whole);
    let differences = study.differences.agreement(&study.edges.reference(Part::Whole));
    let by_differences = study.warped.agreement(Part::Whole, &study.differences.reference());
    Prose::new(
        include_str!("mesh.md"),
        &[
            ("triangles", &study.triangles),
            ("interior", &term(Part::Interior)),
            ("primary", &term(Part::Primary)),
            ("shadow", &term(Part::Shadow)),
            ("indirect", &term(Part::Indirect)),
            ("seconds_warped", &number(study.warped.seconds)),
            ("seconds_edges", &number(study.edges.seconds)),
            ("seconds_differences", &number(study.differences.seconds)),
            ("step_pixels", &number(STEP)),
            ("samples_warped", &study.warped.samples),
            ("samples_edges", &study.edges.samples),
            ("samples_differences", &study.differences.samples),
            ("slope", &slope(warped.slope)),
            ("error", &number(warped.error)),
            ("step", &number(study.differences.step)),
            ("slope_by_differences", &slope(by_differences.slope)),
            ("slope_differences", &slope(differences.slope)),
            ("error_differences", &number(differences.error)),
            ("runs", &RUNS),
        ],
    )
}

fn slope(slope: Ratio) -> String {
    if slope.value.is_finite() { slope.shown() } else { "not defined".to_owned() }
}

/// A part by a method, compared with another method, from so many samples a pixel.
type Row = (Part, &'static str, &'static str, usize, Agreement);

/// Every part by every method, compared with edge sampling.
pub(super) fn table(study: &Study) -> Table {
    let Study { warped, edges, differences, .. } = study;
    let by_edges = |part| edges.reference(part);
    let mut rows: Vec<Row> = vec![];
    for part in Part::ALL {
        let agreement = warped.agreement(part, &by_edges(part));
        rows.push((part, "warped area", "edge sampling", warped.samples, agreement));
    }
    let agreement = warped.agreement(Part::Whole, &differences.reference());
    rows.push((Part::Whole, "warped area", "finite differences", warped.samples, agreement));
    let agreement = differences.agreement(&by_edges(Part::Whole));
    rows.push((Part::Whole, "finite differences", "edge sampling", differences.samples, agreement));
    Table::of(
        rows,
        &[
            ("part", &|row| row.0.name().into()),
            ("method", &|row| row.1.into()),
            ("compared with", &|row| row.2.into()),
            ("samples a pixel", &|row| row.3.into()),
            ("slope", &|row| row.4.slope.value.into()),
            ("standard error", &|row| row.4.slope.error.into()),
            ("relative mean squared error", &|row| row.4.error.into()),
        ],
    )
}
