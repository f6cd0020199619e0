//! Variance and bias of every method on rotating cylinders and foliage.

mod picture;
mod scene;
mod study;

use crate::context::Context;
use crate::figures::common::{Priced, crossovers, listed, times};
use crate::gallery::Section;
use crate::output::Table;
use crate::plot::number;
use crate::prose::Prose;
use crate::ratio::Ratio;
pub(super) use scene::Setting;
use study::{Entry, REFERENCE_RUNS, SURE, Study};

/// Measures, draws and explains.
pub(crate) fn draw(context: &Context) -> anyhow::Result<Section> {
    let (seed, sides) = (context.seed(), context.spend([48, 128], [128, 256]));
    let cylinders = [Setting::cylinders(sides[0], seed)?, Setting::cylinders(sides[1], seed)?];
    let foliage = [Setting::foliage(sides[0], seed)?, Setting::foliage(sides[1], seed)?];
    let studies = [Study::new(context, cylinders, 0)?, Study::new(context, foliage, 1)?];
    let prose = prose(&studies)?;
    context.png("motions.png", &picture::draw(&studies))?;
    let table = table(&studies);
    let data = context.csv("motions.csv", &table)?;
    let mut section = prose.section("motions", vec![data], table)?;
    for (name, study) in ["cylinders", "foliage"].into_iter().zip(&studies) {
        let methods: Vec<Priced> = study.entries.iter().map(Entry::priced).collect();
        let unbiased = methods.iter().filter(|m| m.bias == 0.0);
        let best = unbiased.min_by(|a, b| a.cost.total_cmp(&b.cost));
        section.values.push((format!("{name}_times"), times(&methods)));
        let crossovers = best.map_or_else(String::new, |best| crossovers(&methods, best));
        section.values.push((format!("{name}_crossovers"), crossovers));
    }
    Ok(section)
}

/// The text on both scenes.
fn prose([cylinders, foliage]: &[Study; 2]) -> anyhow::Result<Prose> {
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
            ("side", &cylinders.setting.side()),
            ("noise_cylinders", &noise(cylinders)),
            ("noise_foliage", &noise(foliage)),
            ("sure", &SURE),
        ],
    )
}

/// The methods that are biased on a scene, those that are not, and those that this run cannot decide.
fn biases(study: &Study) -> String {
    let (biased, rest): (Vec<&Entry>, Vec<&Entry>) = study.entries.iter().partition(|e| e.is_biased());
    let (vague, sound): (Vec<&Entry>, Vec<&Entry>) = rest.into_iter().partition(|e| e.is_vague());
    let list = |words: &str, entries: &[&Entry]| {
        let slopes = |e: &&Entry| [e.compared.true_slope, e.quiet()].map(Ratio::shown).join("; ");
        let slopes = listed(entries.iter().map(|e| format!("{} ({})", e.method.name, slopes(e))));
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
    (order[0].method.name, listed(order[1..].iter().map(factor)))
}

/// All numbers.
fn table(studies: &[Study]) -> Table {
    Table::of(
        studies.iter().flat_map(|study| study.entries.iter().map(move |entry| (study, entry))),
        &[
            ("scene", &|(study, _)| study.setting.name.into()),
            ("method", &|(_, e)| e.method.name.into()),
            ("samples a pixel", &|(_, e)| e.samples.into()),
            ("runs", &|(_, e)| (e.runs as usize).into()),
            ("processor seconds a run", &|(_, e)| e.seconds.into()),
            ("slope", &|(_, e)| e.compared.true_slope.value.into()),
            ("its error", &|(_, e)| e.compared.true_slope.error.into()),
            ("slope, quiet pixels", &|(_, e)| e.quiet().value.into()),
            ("its error", &|(_, e)| e.quiet().error.into()),
            ("relative bias²", &|(_, e)| e.compared.bias2.value.into()),
            ("its error", &|(_, e)| e.compared.bias2.error.into()),
            ("relative variance", &|(_, e)| e.compared.variance.value.into()),
            ("its error", &|(_, e)| e.compared.variance.error.into()),
            ("variance × seconds", &|(_, e)| e.cost().into()),
            ("not finite", &|(_, e)| e.non_finite.into()),
        ],
    )
}
