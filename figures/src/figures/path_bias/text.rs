//! What figure 10 says, with its numbers.

use super::study::{Field, Measured, RAYS, Study};
use crate::figures::common::Ratio;
use crate::figures::trade::bias::Curve;
use crate::figures::trade::regression::Bias;
use crate::gallery::{Placement, escape, formula};
use crate::output::{Cell, Table};
use crate::plot::number;

pub(super) const CAPTION: &str = "Orange: lamps. Orange-red arrows: how the occluder moves. Bars: standard errors from \
    independent runs. Blue: the original’s weight. Orange-red: the default weight. Squares: unbiased \
    schemes. Right: the variance is that of one sample, summed over pixels, over the sum of squares of the reference.";

/// "0.12 ± 0.03".
pub(super) fn missing(bias: &Bias) -> String {
    Ratio { value: bias.missing, error: bias.error }.shown().replace('-', "−")
}

pub(super) fn formulas() -> String {
    formula(
        r"\dot{L} = ∑_k ∇·(V_k f_k), \quad V_k ≈ \frac{∑_i w_i V_i}{∑_i w_i} \text{ at the film and at every surface of a path}",
        Placement::Display,
    )
}

/// The figure in a few paragraphs.
pub(super) fn explanation(studies: &[Study]) -> String {
    let opening = "<p>Along a path every direction is warped: the first on the film, the others at the surfaces where \
        light is scattered. Each field is a quotient of two sums over N′ <em>auxiliary rays</em>, so each brings its own \
        bias. The occluder moves; the gradient image is compared with a reference as in figure 5, and the missing part \
        is 1 less the slope of the one on the other.</p>";
    [opening.to_owned(), studies.iter().map(about).collect::<String>(), prices(studies), verdict(studies)]
        .concat()
}

fn about(study: &Study) -> String {
    let words = study.curves.iter().map(curve).collect::<Vec<_>>().join("; ");
    let setting = &study.setting;
    let accuracy = match setting.uncertainty {
        small if small < 1e-15 => "rounding".to_owned(),
        part => format!("{} of the gradient", number(part)),
    };
    format!(
        "<p><em>{}.</em> Reference: {} (by its own account to {accuracy}). Missing part: {words}.</p>",
        escape(setting.name),
        escape(setting.source)
    )
}

fn curve(curve: &Curve) -> String {
    let at = |point: Option<&(f64, Bias)>| {
        point.map_or_else(String::new, |(n, b)| format!("{} with {} rays", missing(b), number(*n)))
    };
    let rate = curve.rate().map_or_else(
        || "the noise of this run hides the rate".to_owned(),
        |r| format!("falling as N′<sup>{:.2} ± {:.2}</sup>", r.exponent, r.error).replace('-', "−"),
    );
    let middle = curve.points.iter().find(|(n, _)| *n == RAYS as f64);
    format!(
        "{}, {}, {} and {} ({rate})",
        escape(curve.series.name),
        at(curve.points.first()),
        at(middle),
        at(curve.points.last())
    )
}

fn prices(studies: &[Study]) -> String {
    let words = studies.iter().map(|study| {
        let ratio = |a: &Measured, b: &Measured| {
            let (a, b) = (a.cost(), b.cost());
            let value = a.value / b.value;
            Ratio { value, error: value * (a.error / a.value).hypot(b.error / b.value) }.shown()
        };
        let [fixed, multilevel, _, own, default, roulette, harmonic, edges] =
            std::array::from_fn(|i| &study.schemes[i].measured);
        format!(
            "{}: debiased by levels the original’s weight costs {} times its own {RAYS} rays in variance × rays, the \
             default weight {} times its own and {} times the original’s; by Russian roulette the default costs {} times \
             its own. Multilevel costs {} times what the harmonic field does, and {} times what edge sampling does",
            escape(study.setting.name),
            ratio(multilevel, fixed),
            ratio(default, own),
            ratio(default, fixed),
            ratio(roulette, own),
            ratio(default, harmonic),
            ratio(default, edges),
        )
    });
    format!(
        "<p>What no bias costs. {}. These factors are larger than in the image plane, and their errors are those of \
         heavy tails: a short run likely underestimates the variance of every debiased scheme. On worlds of so few \
         vertices, methods that are told where edges are have an easy life (figure 8 shows where that ends).</p>",
        words.collect::<Vec<_>>().join(". ")
    )
}

/// Whether the unbiased schemes were found to be so.
fn verdict(studies: &[Study]) -> String {
    let unbiased = studies.iter().flat_map(|study| {
        let able = study.schemes.iter().filter(|s| s.field.is_unbiased());
        able.map(|s| (s, s.measured.bias.missing / s.measured.bias.error))
    });
    let worst = unbiased.max_by(|a, b| a.1.abs().total_cmp(&b.1.abs()));
    worst.map_or_else(String::new, |(scheme, z)| {
        format!(
            "<p>Of all schemes that theory calls unbiased the farthest from a missing part of 0 is “{}” ({} weight), by \
             {:.1} standard errors.</p>",
            escape(&scheme.field.name()),
            scheme.field.weight(),
            z.abs()
        )
    })
}

/// Everything measured.
pub(super) fn table(studies: &[Study]) -> Table {
    let mut table = Table::new(&[
        "world",
        "scheme",
        "weight",
        "auxiliary rays",
        "samples a pixel",
        "missing part",
        "its standard error",
        "squared relative bias",
        "variance of a sample",
        "its standard error",
        "rays a sample",
        "variance × rays",
    ]);
    for study in studies {
        for curve in &study.curves {
            for (rays, bias) in &curve.points {
                let [samples, variance, error, all, cost] = [""; 5].map(Cell::from);
                table.row([
                    study.setting.name.into(),
                    "consistent".into(),
                    curve.series.name.into(),
                    (*rays).into(),
                    samples,
                    bias.missing.into(),
                    bias.error.into(),
                    bias.squared.into(),
                    variance,
                    error,
                    all,
                    cost,
                ]);
            }
        }
        for scheme in &study.schemes {
            table.row(row(study, scheme.field, &scheme.measured));
        }
    }
    table
}

fn row(study: &Study, field: Field, measured: &Measured) -> [Cell; 12] {
    [
        study.setting.name.into(),
        field.name().into(),
        field.weight().into(),
        field.auxiliary_rays().map_or_else(|| Cell::from(""), Cell::from),
        measured.samples.into(),
        measured.bias.missing.into(),
        measured.bias.error.into(),
        measured.bias.squared.into(),
        measured.variance.value.into(),
        measured.variance.error.into(),
        measured.rays.into(),
        measured.cost().value.into(),
    ]
}
