//! The results of a study: a table for readers, and CSV for programs.

use std::fmt::Write as _;

use volume3d::tune::{Bias, FilterNoise, Measure, Outcome, RUNS, Reference, Rung, Tuned, Tuning};

use super::advice::percent;
use super::settings::options;
use crate::one_sided::one_sided;

/// A line per setting, at its largest number of samples, with the expected error within a time.
pub(super) fn table(settings: &[Tuned], at: f64) -> String {
    let width = settings.iter().map(|s| options(s.setting).len()).max().unwrap_or(0);
    let mut text = format!(
        "{:width$}  {:>6}  {:>8}  {:>15}  {:>11}  {:>9}  {:>14}\n",
        "setting",
        "spp",
        "seconds",
        "slope",
        "bias",
        "noise",
        format!("error in {at} s"),
    );
    for tuned in settings {
        let _ = write!(text, "{:width$}  ", options(tuned.setting));
        match &tuned.outcome {
            Outcome::Measured(_) => text += &line(tuned, at),
            Outcome::Refused(_) => text += "refused, see below",
            Outcome::TooSlow => {
                text += "not measured: runs with one sample per pixel exceed the budget; raise --budget";
            }
        }
        text.push('\n');
    }
    for tuned in settings {
        if let Outcome::Refused(reason) = &tuned.outcome {
            let _ = writeln!(text, "refused: {}: {reason}", options(tuned.setting));
        }
    }
    text
}

fn line(tuned: &Tuned, at: f64) -> String {
    let (Some(Rung { samples, seconds, statistics, heavy, .. }), Some(law)) =
        (tuned.rungs().last(), tuned.law())
    else {
        return String::new();
    };
    let Measure { value, error } = statistics.slope;
    let slope = format!("{value:.3} ± {error:.3}");
    let bias = match law.bias {
        Bias::Proved { below } => format!("0 (< {})", percent(below)),
        Bias::Unresolved { below } => format!("< {}", percent(below)),
        Bias::Resolved(bias) => percent(bias),
    };
    let noise = percent(statistics.relative_variance.value.max(0.0).sqrt());
    let then = law.within(at).map_or_else(|| "-".to_owned(), |e| percent(e.error.value));
    let tails = if *heavy > 0 { format!("  heavy tails: {heavy} of {RUNS} runs") } else { String::new() };
    format!("{samples:>6}  {seconds:>8.3}  {slope:>15}  {bias:>11}  {noise:>9}  {then:>14}{tails}")
}

/// Explains the columns of the table and the reference.
pub(super) fn legend(reference: &Reference) -> String {
    let Reference { setting, images, samples, seconds, .. } = reference;
    let error = (images.variance().value.max(0.0) / RUNS as f64 / images.power().value).sqrt();
    format!(
        "\nreference: {}, {RUNS} runs of {samples} spp in {seconds:.1} s;\n  \
           its standard error, {} of the gradient, is subtracted\n\
         seconds:   wall time of one run, the median of {RUNS}\n\
         slope:     of the mean on the reference; below 1, gradients are too small\n\
         bias:      the error that more samples do not reduce; 0 (< x): unbiased by proof, measured below x;\n           \
                    < x: not resolved, and x is two standard errors above the measurement\n\
         noise:     the standard deviation of one run\n\
         Errors are root mean squares over pixels and channels, relative to that of the gradient.\n\
         Expected error² at N spp = bias² + noise² · spp/N, where an unresolved bias counts as x.\n\n",
        options(*setting),
        percent(error),
    )
}

/// A line with the noise under each filter; empty if there is none.
pub(super) fn filters(found: &[FilterNoise], reference: &Reference) -> String {
    if found.is_empty() {
        return String::new();
    }
    let words = found.iter().map(|FilterNoise { name, is_own, ratio }| {
        let whose = if *is_own { " (the scene's)" } else { "" };
        format!("{name} {ratio:.2}{whose}")
    });
    let (method, words) = (options(reference.setting), words.collect::<Vec<_>>().join(", "));
    format!("noise by pixel filter, at equal samples of {method}: {words}\n\n")
}

/// Warnings about unreliable results.
pub(super) fn warnings(Tuning { settings, reference, .. }: &Tuning) -> String {
    let mut text = String::new();
    if !reference.unbiased {
        let _ = writeln!(
            text,
            "WARNING: no unbiased method supports this scene. The reference is {}, whose bias, ~ step², is not visible \
             here",
            options(reference.setting)
        );
    }
    if reference.heavy > 0 {
        let _ = writeln!(
            text,
            "WARNING: in {} of {RUNS} runs of the reference one sample carries 2% of the sum of |gradient| or more: tails \
             are heavy, and the errors of the reference, of all biases and of all slopes are larger than stated; raise \
             --budget",
            reference.heavy
        );
    }
    for tuned in settings {
        let (Some(law), Some(last)) = (tuned.law(), tuned.rungs().last()) else { continue };
        if let (Bias::Resolved(bias), true) = (law.bias, tuned.unbiased) {
            let _ = writeln!(
                text,
                "WARNING: {} is unbiased by proof, but differs from the reference by {}, more than noise explains: one of \
                 the two missed rare events; try another --seed and a larger --budget",
                options(tuned.setting),
                percent(bias)
            );
        }
        if last.non_finite > 0 {
            let _ = writeln!(
                text,
                "WARNING: {}: {} samples were not finite and are left out",
                options(tuned.setting),
                last.non_finite
            );
        }
    }
    if settings.iter().any(Tuned::is_heavy) {
        text += "heavy tails: the number of runs in which one sample carries 2% of the sum of |gradient| or more. Noise and \
                 errors are then more often larger than stated than not, and fall more slowly with samples\n";
    }
    let rungs = settings.iter().flat_map(Tuned::rungs).filter_map(|rung| rung.one_sided.as_ref());
    let mut found: Vec<_> = reference.one_sided.iter().chain(rungs).map(|(step, why)| (*step, why)).collect();
    found.sort_by(|a, b| b.0.total_cmp(&a.0));
    found.dedup_by_key(|(step, _)| *step);
    text + &one_sided(found)
}

/// All rungs of all settings as CSV.
pub(super) fn csv(Tuning { settings, reference, .. }: &Tuning) -> anyhow::Result<Vec<u8>> {
    let mut table = csv::Writer::from_writer(vec![]);
    table.write_record(HEADER)?;
    for tuned in settings {
        let refusal = match &tuned.outcome {
            Outcome::Measured(_) => String::new(),
            Outcome::Refused(reason) => format!("refused: {reason}"),
            Outcome::TooSlow => "not measured: too slow for the budget".to_owned(),
        };
        let (rungs, setting) = (tuned.rungs(), options(tuned.setting));
        let unbiased = if tuned.unbiased { "yes" } else { "no" };
        for Rung { samples, seconds, statistics: s, heavy, non_finite, .. } in rungs {
            let (v, r, b, m) = (s.variance, s.relative_variance, s.relative_bias2, s.slope);
            let numbers = [v.value, v.error, r.value, r.error, b.value, b.error, m.value, m.error];
            let mut cells = vec![setting.clone(), unbiased.to_owned(), samples.to_string()];
            cells.extend([RUNS.to_string(), format!("{seconds}")]);
            cells.extend(numbers.map(|x| format!("{x}")));
            cells.extend([heavy.to_string(), non_finite.to_string()]);
            cells.extend([options(reference.setting), reference.samples.to_string(), String::new()]);
            table.write_record(&cells)?;
        }
        if rungs.is_empty() {
            let mut cells = vec![String::new(); HEADER.len()];
            cells[0] = setting;
            cells[1] = unbiased.to_owned();
            cells[HEADER.len() - 1] = refusal;
            table.write_record(&cells)?;
        }
    }
    Ok(table.into_inner()?)
}

/// Variances and bias² are per pixel and channel; relative ones are divided by the mean square of the
/// gradient.
const HEADER: [&str; 18] = [
    "setting",
    "unbiased",
    "spp",
    "runs",
    "seconds",
    "variance",
    "variance_error",
    "relative_variance",
    "relative_variance_error",
    "relative_bias2",
    "relative_bias2_error",
    "slope",
    "slope_error",
    "heavy_runs",
    "non_finite_samples",
    "reference",
    "reference_spp",
    "note",
];
