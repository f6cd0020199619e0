//! What figure 10 says, with its numbers.

use super::study::{GROWTH, LEVELS, RAYS, REACH, RUNS, Scheme, Study, TAIL};
use crate::figures::common::{KNOWN, SETTLED};
use crate::figures::trade::bias::{Curve, SETTLED as FITTED};
use crate::figures::trade::regression::Bias;
use crate::gallery::{Placement, escape, formula};
use crate::output::{Cell, Table};
use crate::plot::number;
use crate::ratio::Ratio;

pub(super) const CAPTION: &str = "Orange: lamps. Orange-red arrows: how the occluder moves. Bars: standard errors from \
    independent runs. Blue: the original’s weight. Orange-red: the default weight. Squares: unbiased \
    schemes. Right: the variance is that of one sample, summed over pixels, over the sum of squares of the reference. \
    Ring and arrow: at least so much.";

/// "0.12 ± 0.03".
pub(super) fn missing(bias: &Bias) -> String {
    Ratio { value: bias.missing, error: bias.error }.shown().replace('-', "−")
}

pub(super) fn formulas() -> String {
    formula(
        r"\dot{L} = ∑_k ∇·(V_k f_k), \quad V_0 ≈ \frac{∑_i w_i V_i}{∑_i w_i} \text{ on the film}, \quad V_k ≈ \frac{∑_i w_i (1 − B_i) V_i}{∑_i w_i} \text{ at every surface (the default; the original: without } 1 − B_i \text{)}",
        Placement::Display,
    )
}

/// The figure in a few paragraphs.
pub(super) fn explanation(studies: &[Study]) -> String {
    let opening = "<p>The figures before this one took “warped area” for unbiased. That has a price along paths, \
        where every direction is warped: the first on the film, the others at the surfaces where \
        light is scattered. Each field is a quotient of two sums over N′ <em>auxiliary rays</em>, so each brings its own \
        bias. The occluder moves; the gradient image is compared with a reference as in figure 5, and the missing part \
        is 1 less the slope of the one on the other.</p>";
    let about = studies.iter().map(about).collect::<String>();
    [
        opening.to_owned(),
        words(),
        about,
        overshoot(studies),
        prices(studies),
        doubt(studies),
        verdict(studies),
    ]
    .concat()
}

/// What the names in the picture mean.
fn words() -> String {
    format!(
        "<p>The <em>original</em> weight has a boundary function B that grows linearly with the distance s to the \
         next jump, and γ = 3. The <em>default</em> weight has B ~ s² and γ = 1, and is <em>local</em>: at surfaces the \
         velocity of what an auxiliary ray hits is multiplied by 1 − B, so that only what is near a jump moves. \
         <em>Consistent</em> is a fixed number of rays: biased, and right in the limit. Two schemes remove the bias with \
         a random number of rays. <em>Multilevel</em> has three numbers: “{RAYS} rays, {LEVELS}, {LEVELS}” starts with \
         {RAYS} rays; with the first probability it doubles them, with the second it doubles them again, and so on. What \
         each doubling changes is added, divided by the probability of having come so far. \
         <em>Roulette</em> (Russian roulette), “{RAYS} rays, tail {TAIL}”, adds batches of {RAYS} rays; it takes more \
         than k with the probability (k + 1)<sup>−{TAIL}</sup>, and divides in the same way. A small probability in a \
         divisor makes rare samples large. The <em>mean over jumps</em> averages the velocities of the silhouettes themselves, \
         within {REACH} kernel widths, by their inverse distance: V is exact, no auxiliary ray is traced, and there is \
         nothing to debias. What it needs instead is a list of vertices.</p>"
    )
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

/// That few rays may find too much.
fn overshoot(studies: &[Study]) -> String {
    let over = studies.iter().flat_map(|study| {
        let curves = study.curves.iter().map(move |curve| (study, curve));
        curves.filter_map(|(study, curve)| {
            let (rays, bias) = curve.points.first()?;
            let is_over = bias.missing < -SETTLED * bias.error;
            let name = escape(curve.series.name);
            let words =
                format!("{} in “{}” with {} rays", missing(bias), escape(study.setting.name), number(*rays));
            is_over.then(|| format!("{name}: {words}"))
        })
    });
    let over: Vec<String> = over.collect();
    let found = if over.is_empty() { "none in this run".to_owned() } else { over.join("; ") };
    format!(
        "<p>The rates are fitted to the points with {FITTED} rays or more that stand out of the noise: with fewer the \
         bias does not follow a power of N′ yet, need not fall, and may even have the other sign, a gradient that is too \
         large (a negative missing part; {found}).</p>"
    )
}

/// How the costs of two schemes compare, where either may be a lower bound.
fn ratio(a: &Scheme, b: &Scheme) -> String {
    let quotient = a.measured.cost().over(b.measured.cost());
    match (a.is_bound(), b.is_bound()) {
        (false, false) => format!("{} times", quotient.shown()),
        (true, false) => format!("at least {} times", number(quotient.value)),
        (false, true) => format!("at most {} times", number(quotient.value)),
        (true, true) => format!("about {} times (both lower bounds)", number(quotient.value)),
    }
}

fn prices(studies: &[Study]) -> String {
    let words = studies.iter().map(|study| {
        let [fixed, multilevel, _, own, default, roulette, jumps, harmonic, edges] =
            std::array::from_fn(|i| &study.schemes[i]);
        format!(
            "{}: in variance × rays the original’s weight, debiased by levels, costs {} what {RAYS} fixed rays do. \
             The default weight, debiased by levels, costs {} its own {RAYS} rays, {} the original’s {RAYS}, \
             {} the mean over jumps, {} the harmonic field, and {} edge sampling; by Russian roulette {} its own {RAYS} rays",
            escape(study.setting.name),
            ratio(multilevel, fixed),
            ratio(default, own),
            ratio(default, fixed),
            ratio(default, jumps),
            ratio(default, harmonic),
            ratio(default, edges),
            ratio(roulette, own),
        )
    });
    format!(
        "<p>What no bias costs. {}. On worlds of so few vertices, methods that are told where edges are have an easy \
         life (figure 8 shows where that ends).</p>",
        words.collect::<Vec<_>>().join(". ")
    )
}

/// What a run of this length cannot know.
fn doubt(studies: &[Study]) -> String {
    let schemes = || studies.iter().flat_map(|study| study.schemes.iter().map(move |scheme| (study, scheme)));
    let debiased = schemes().filter(|(_, s)| s.field.is_debiased());
    let samples = debiased.clone().map(|(_, s)| s.measured.samples);
    let [few, many] = [samples.clone().min(), samples.max()].map(|n| n.unwrap_or(0));
    let worst = debiased.max_by(|a, b| a.1.measured.growth().total_cmp(&b.1.measured.growth()));
    let worst = worst.map_or_else(String::new, |(study, scheme)| {
        format!(
            " The worst is “{}” ({} weight) in “{}”: all runs together find {:.2} times the variance that a typical one \
             of the {RUNS} finds.",
            escape(&scheme.field.name()),
            scheme.field.weight(),
            escape(study.setting.name),
            scheme.measured.growth()
        )
    });
    let unsettled = schemes().filter(|(_, s)| !s.is_settled()).count();
    format!(
        "<p>Why “at least”. The variance of a debiased scheme is that of its rarest samples. A run that has not \
         met them finds a variance that is too small, and a standard error that is too small as well; no run, least \
         of all a draft, can tell from its own samples that it has met them all. By theory \
         no tail of Russian roulette gives both a finite number of rays and a finite variance, and no such scheme \
         at all has a finite variance where two silhouettes of different \
         motions are seen to meet, as the occluder and the end of the lamp are from the end of the half-shadow. So the \
         variances of debiased schemes, from {few} to {many} samples a pixel, are lower bounds, in this run and in a longer \
         one. The others are taken as known if the standard error is below {KNOWN} of the variance, if all {RUNS} runs \
         together find less than {GROWTH} times what a typical one of them finds, and if the mean of an unbiased scheme is \
         within {SETTLED} standard errors of the reference. {unsettled} of {} schemes fail one of these checks.{worst}</p>",
        schemes().count(),
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
             {:.1} standard errors. With tails as heavy as these that need not be a bias: a run that has not met the rarest \
             samples misses what they carry, and finds too small an error. The tests of the library speak for \
             unbiasedness; this figure cannot.</p>",
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
        "variance, median of runs",
        "rays a sample",
        "variance × rays",
        "lower bound only",
    ]);
    for study in studies {
        for curve in &study.curves {
            for (rays, bias) in &curve.points {
                let [samples, variance, error, typical, all, cost, bound] = [""; 7].map(Cell::from);
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
                    typical,
                    all,
                    cost,
                    bound,
                ]);
            }
        }
        for scheme in &study.schemes {
            table.row(row(study, scheme));
        }
    }
    table
}

fn row(study: &Study, scheme: &Scheme) -> [Cell; 14] {
    let Scheme { field, measured } = scheme;
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
        measured.typical.into(),
        measured.rays.into(),
        measured.cost().value.into(),
        if scheme.is_bound() { "yes" } else { "no" }.into(),
    ]
}
