//! The numbers of `motions.md`.

use super::study::{Entry, REFERENCE_RUNS, SURE, Study};
use crate::output::Table;
use crate::plot::number;
use crate::prose::Prose;

/// The text on both scenes.
pub(super) fn prose([cylinders, foliage]: &[Study; 2]) -> anyhow::Result<Prose> {
    let noise = |study: &Study| number((study.reference.floor / study.reference.power()).sqrt());
    let [(cylinders_best, cylinders_factors), (foliage_best, foliage_factors)] =
        [cylinders, foliage].map(costs);
    Prose::new(
        include_str!("motions.md"),
        &[
            ("cylinders_biases", &biases(cylinders)),
            ("foliage_biases", &biases(foliage)),
            ("cylinders_best", &cylinders_best),
            ("cylinders_factors", &cylinders_factors),
            ("foliage_best", &foliage_best),
            ("foliage_factors", &foliage_factors),
            ("reference_runs", &REFERENCE_RUNS),
            ("noise_cylinders", &noise(cylinders)),
            ("noise_foliage", &noise(foliage)),
            ("sure", &SURE),
        ],
    )
}

/// Which methods are biased on a scene, which are not, and of which this run cannot tell.
fn biases(study: &Study) -> String {
    let (biased, rest): (Vec<&Entry>, Vec<&Entry>) = study.entries.iter().partition(|e| e.is_biased());
    let (vague, sound): (Vec<&Entry>, Vec<&Entry>) = rest.into_iter().partition(|e| e.is_vague());
    let list = |words: &str, entries: &[&Entry]| {
        let slopes =
            entries.iter().map(|e| format!("{} ({}; {})", e.method.name, e.slope.shown(), e.quiet.shown()));
        let slopes = slopes.collect::<Vec<_>>().join("; ");
        if entries.is_empty() { String::new() } else { format!("{words}{slopes}. ") }
    };
    let none = if biased.is_empty() { "no method is shown to be biased by this run. " } else { "" };
    let biased = list("**biased** ", &biased);
    [none, &biased, &list("No bias is found in ", &sound), &list("Too noisy to tell: ", &vague)].concat()
}

/// The method that costs least for a given precision, and the others in multiples of it.
fn costs(study: &Study) -> (&'static str, String) {
    let mut order: Vec<&Entry> = study.entries.iter().collect();
    order.sort_by(|a, b| a.cost().total_cmp(&b.cost()));
    let factor = |e: &&Entry| format!("{} {}", e.method.name, number(e.cost() / order[0].cost()));
    (order[0].method.name, order[1..].iter().map(factor).collect::<Vec<_>>().join("; "))
}

/// Every number.
pub(super) fn table(studies: &[Study]) -> Table {
    Table::of(
        studies.iter().flat_map(|study| study.entries.iter().map(move |entry| (study, entry))),
        &[
            ("scene", &|(study, _)| study.setting.name.into()),
            ("method", &|(_, e)| e.method.name.into()),
            ("samples a pixel", &|(_, e)| e.samples.into()),
            ("runs", &|(_, e)| (e.runs as usize).into()),
            ("processor seconds a run", &|(_, e)| e.seconds.into()),
            ("slope", &|(_, e)| e.slope.value.into()),
            ("its error", &|(_, e)| e.slope.error.into()),
            ("slope, quiet pixels", &|(_, e)| e.quiet.value.into()),
            ("its error", &|(_, e)| e.quiet.error.into()),
            ("relative bias²", &|(_, e)| e.measured.bias2.into()),
            ("its error", &|(_, e)| e.measured.bias2_error.into()),
            ("relative variance", &|(_, e)| e.measured.variance.into()),
            ("its error", &|(_, e)| e.measured.variance_error.into()),
            ("variance × seconds", &|(_, e)| e.cost().into()),
            ("not finite", &|(_, e)| e.non_finite.into()),
        ],
    )
}
