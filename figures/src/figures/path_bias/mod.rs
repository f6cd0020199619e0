//! Bias and variance against N' and debiasing, for shadows and for two bounces.

mod page;
mod study;
mod worlds;

use self::study::{GROWTH, LEVELS, RAYS, REACH, RUNS, Scheme, Study, TAIL};
use self::worlds::Setting;
use crate::context::Context;
use crate::figures::common::{KNOWN, SETTLED, listed};
use crate::figures::trade::bias::{Curve, SETTLED as FITTED};
use crate::figures::trade::regression::Bias;
use crate::gallery::Section;
use crate::output::{Cell, Table};
use crate::plot::number;
use crate::prose::Prose;

/// Measures, draws and explains.
pub(crate) fn draw(context: &Context) -> anyhow::Result<Section> {
    context.step("exact derivatives");
    let [shadow, room] = [Setting::shadow()?, Setting::room()?];
    let study = |setting: Setting, index: u64| {
        context.step(&format!("bias: {}", setting.name));
        Study::new(context, setting, index)
    };
    let studies = [study(shadow, 0)?, study(room, 1)?];
    let prose = prose(&studies)?;
    context.png("path_bias.png", &page::draw(&studies))?;
    let table = table(&studies);
    let data = context.csv("path_bias.csv", &table)?;
    prose.section("path-bias", vec![data], table)
}

/// The text on both worlds.
fn prose(studies: &[Study; 2]) -> anyhow::Result<Prose> {
    let [shadow, room] = studies;
    let schemes = || studies.iter().flat_map(|study| study.schemes.iter().map(move |scheme| (study, scheme)));
    let samples = || schemes().filter(|(_, s)| s.field.is_debiased()).map(|(_, s)| s.measured.samples);
    let (worst_world, worst) =
        most(schemes().filter(|(_, s)| s.field.is_debiased()), |s| s.measured.growth());
    let deviation = |s: &Scheme| (s.measured.bias.missing.value / s.measured.bias.missing.error).abs();
    let (_, farthest) = most(schemes().filter(|(_, s)| s.field.is_unbiased()), deviation);
    Prose::new(
        include_str!("path_bias.md"),
        &[
            ("rays", &RAYS),
            ("levels", &LEVELS),
            ("tail", &TAIL),
            ("reach", &REACH),
            ("shadow", &shadow.setting.name),
            ("shadow_source", &shadow.setting.source),
            ("shadow_accuracy", &accuracy(shadow)),
            ("shadow_curves", &listed(shadow.curves.iter().map(curve))),
            ("room", &room.setting.name),
            ("room_source", &room.setting.source),
            ("room_accuracy", &accuracy(room)),
            ("room_curves", &listed(room.curves.iter().map(curve))),
            ("fitted", &FITTED),
            ("overshoot", &overshoot(studies)),
            ("prices", &studies.each_ref().map(price).join(". ")),
            ("few", &samples().min().unwrap_or(0)),
            ("many", &samples().max().unwrap_or(0)),
            ("known", &KNOWN),
            ("runs", &RUNS),
            ("growth", &GROWTH),
            ("settled", &SETTLED),
            ("unsettled", &schemes().filter(|(_, s)| !s.is_settled()).count()),
            ("schemes", &schemes().count()),
            ("worst", &worst.field.name()),
            ("worst_weight", &worst.field.weight()),
            ("worst_world", &worst_world.setting.name),
            ("worst_growth", &format!("{:.2}", worst.measured.growth())),
            ("farthest", &farthest.field.name()),
            ("farthest_weight", &farthest.field.weight()),
            ("farthest_by", &format!("{:.1}", deviation(farthest))),
        ],
    )
}

/// The scheme with the largest value of something.
fn most<'a>(
    schemes: impl Iterator<Item = (&'a Study, &'a Scheme)>,
    value: impl Fn(&Scheme) -> f64,
) -> (&'a Study, &'a Scheme) {
    schemes.max_by(|a, b| value(a.1).total_cmp(&value(b.1))).expect("both worlds are met by such schemes")
}

/// The reference's own error estimate.
fn accuracy(study: &Study) -> String {
    match study.setting.uncertainty {
        small if small < 1e-15 => "rounding".to_owned(),
        part => format!("{} of the gradient", number(part)),
    }
}

fn curve(curve: &Curve) -> String {
    let at = |point: Option<&(f64, Bias)>| {
        point.map_or_else(String::new, |(n, b)| format!("{} with {} rays", b.missing.shown(), number(*n)))
    };
    let rate = curve.rate().map_or_else(
        || "the noise of this run hides the rate".to_owned(),
        |r| format!("falling as N′<sup>{:.2} ± {:.2}</sup>", r.value, r.error).replace('-', "−"),
    );
    let middle = curve.points.iter().find(|(n, _)| *n == RAYS as f64);
    format!(
        "{}, {}, {} and {} ({rate})",
        curve.series.name,
        at(curve.points.first()),
        at(middle),
        at(curve.points.last())
    )
}

/// Cases in which few rays overestimate.
fn overshoot(studies: &[Study]) -> String {
    let curves =
        studies.iter().flat_map(|study| study.curves.iter().map(move |curve| (study.setting.name, curve)));
    let over = curves.filter_map(|(world, curve)| {
        let (rays, bias) = curve.points.first()?;
        let words = format!(
            "{}: {} in “{world}” with {} rays",
            curve.series.name,
            bias.missing.shown(),
            number(*rays)
        );
        (bias.missing.value < -SETTLED * bias.missing.error).then_some(words)
    });
    let over = listed(over);
    if over.is_empty() { "none in this run".to_owned() } else { over }
}

/// Ratio of the costs of two schemes, where either may be a lower bound.
fn ratio(a: &Scheme, b: &Scheme) -> String {
    let quotient = a.measured.cost().over(b.measured.cost());
    match (a.is_bound(), b.is_bound()) {
        (false, false) => format!("{} times", quotient.shown()),
        (true, false) => format!("at least {} times", number(quotient.value)),
        (false, true) => format!("at most {} times", number(quotient.value)),
        (true, true) => format!("about {} times (both lower bounds)", number(quotient.value)),
    }
}

fn price(study: &Study) -> String {
    let [fixed, multilevel, _, own, default, roulette, jumps, harmonic, edges] =
        std::array::from_fn(|i| &study.schemes[i]);
    format!(
        "{}: in variance × rays the original’s weight, debiased by levels, costs {} what {RAYS} fixed rays do. \
         The default weight, debiased by levels, costs {} its own {RAYS} rays, {} the original’s {RAYS}, \
         {} the mean over jumps, {} the harmonic field, and {} edge sampling; by Russian roulette {} its own {RAYS} rays",
        study.setting.name,
        ratio(multilevel, fixed),
        ratio(default, own),
        ratio(default, fixed),
        ratio(default, jumps),
        ratio(default, harmonic),
        ratio(default, edges),
        ratio(roulette, own),
    )
}

/// A world, a scheme and its weight with its auxiliary rays and bias, and what else is measured of it.
type Row<'a> = (&'a str, String, &'a str, Option<f64>, Bias, Option<&'a Scheme>);

/// All measurements: the bias of every number of rays, then every scheme.
fn table(studies: &[Study; 2]) -> Table {
    let mut rows: Vec<Row<'_>> = vec![];
    for study in studies {
        let world = study.setting.name;
        for curve in &study.curves {
            let row = |(rays, bias): &(f64, Bias)| {
                (world, "consistent".to_owned(), curve.series.name, Some(*rays), *bias, None)
            };
            rows.extend(curve.points.iter().map(row));
        }
        rows.extend(study.schemes.iter().map(|scheme| {
            let Scheme { field, measured } = scheme;
            (world, field.name(), field.weight(), field.auxiliary_rays(), measured.bias, Some(scheme))
        }));
    }
    let known = |value: Option<f64>| value.map_or_else(|| "".into(), Cell::from);
    let of = |row: &Row<'_>, value: fn(&Scheme) -> f64| known(row.5.map(value));
    Table::of(
        rows,
        &[
            ("world", &|row| row.0.into()),
            ("scheme", &|row| row.1.clone().into()),
            ("weight", &|row| row.2.into()),
            ("auxiliary rays", &|row| known(row.3)),
            ("samples a pixel", &|row| row.5.map_or_else(|| "".into(), |s| s.measured.samples.into())),
            ("missing part", &|row| row.4.missing.value.into()),
            ("its standard error", &|row| row.4.missing.error.into()),
            ("squared relative bias", &|row| row.4.squared.into()),
            ("variance of a sample", &|row| of(row, |s| s.measured.variance.value)),
            ("its standard error", &|row| of(row, |s| s.measured.variance.error)),
            ("variance, median of runs", &|row| of(row, |s| s.measured.typical)),
            ("rays a sample", &|row| of(row, |s| s.measured.rays)),
            ("variance × rays", &|row| of(row, |s| s.measured.cost().value)),
            ("lower bound only", &|row| row.5.map_or("", |s| if s.is_bound() { "yes" } else { "no" }).into()),
        ],
    )
}
