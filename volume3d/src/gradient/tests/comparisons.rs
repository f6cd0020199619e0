//! Statistical comparison of means of independent runs with reference values.

use glam::DVec3;
use rayon::prelude::*;

use crate::Image;
use crate::gradient::GradientImage;

/// The mean of independent runs, and its standard error.
pub(crate) fn statistics(values: &[f64]) -> (f64, f64) {
    let n = values.len() as f64;
    let mean = values.iter().sum::<f64>() / n;
    let spread: f64 = values.iter().map(|v| (v - mean).powi(2)).sum();
    (mean, (spread / (n - 1.0) / n).sqrt())
}

/// Number of independent runs behind a mean and its standard error.
pub(crate) const RUNS: u64 = 40;

/// Largest permitted deviation of a mean, in standard errors. Student's distribution with [`RUNS`] − 1
/// degrees of freedom exceeds it as rarely as the normal distribution exceeds 5.36, the threshold of the
/// integration tests.
pub(crate) const LIMIT: f64 = 6.58;

/// The sum of all pixels: mean over runs with different seeds, and its standard error.
pub(crate) fn total(run: impl Fn(u64) -> Vec<DVec3> + Send + Sync) -> (f64, f64) {
    let sums: Vec<f64> =
        (0..RUNS).into_par_iter().map(|s| run(s).iter().map(|p| p.element_sum()).sum()).collect();
    statistics(&sums)
}

/// Comparisons of one test: the failures, and the smallest relative bias that it rejects, which may not
/// exceed 15 % in any comparison. It prints a row of the table of statistical power in tests/RESULTS.md.
pub(crate) struct Comparisons {
    test: &'static str,
    rows: Vec<(String, f64)>,
    failures: Vec<String>,
}

impl Comparisons {
    pub(crate) fn of(test: &'static str) -> Self {
        Self { test, rows: vec![], failures: vec![] }
    }

    /// Compares a mean with its reference. Detectable bias is relative to `scale`: the reference, or the sum
    /// of the terms that cancel in it. A mean with the same standard error that is short by 15 % of `scale`
    /// must be rejected.
    pub(crate) fn add(
        &mut self,
        name: String,
        found: (f64, f64),
        reference: (f64, f64),
        slack: f64,
        scale: f64,
    ) {
        let tolerance = LIMIT * found.1.hypot(reference.1) + slack;
        let off = (found.0 - reference.0).abs();
        let power = tolerance / scale.abs();
        println!(
            "{name}: {found:?} for {reference:?}, off by {off:.2e} of {tolerance:.2e}, rejects {power:.3}"
        );
        let right = off <= tolerance && power <= 0.15;
        if !right {
            self.failures
                .push(format!("{name}: {found:?} for {reference:?}, rejects {power:.3} of {scale:.3}"));
        }
        self.rows.push((name, power));
    }

    /// Checks that a deliberately wrong mean is rejected.
    pub(crate) fn reject(&mut self, name: &str, found: (f64, f64), reference: (f64, f64)) {
        let z = (found.0 - reference.0).abs() / found.1.hypot(reference.1);
        println!("control {name}: {found:?} for {reference:?}, z {z:.1}");
        if z.is_nan() || z <= LIMIT {
            self.failures.push(format!("the control {name} was not rejected: {found:?} for {reference:?}"));
        }
    }

    pub(crate) fn finish(self) {
        let (name, power) = self.rows.iter().max_by(|a, b| a.1.total_cmp(&b.1)).expect("a comparison");
        println!("power | volume3d::{} | {} | {:.1} % | {name} |", self.test, self.rows.len(), 100.0 * power);
        assert!(self.failures.is_empty(), "{:?}", self.failures);
    }
}

/// Whether the environment variable asks for the thorough tests, as in the integration tests.
pub(crate) fn thorough() -> bool {
    std::env::var("WARPED_AREA_TESTS").is_ok_and(|effort| effort == "thorough")
}

/// Σ |term| over the terms of the sum of all pixels.
pub(crate) fn terms(image: &GradientImage) -> f64 {
    let terms = image.terms.as_ref().expect("asked for");
    let sum = |term: &Image| term.pixels.iter().map(|p| p.element_sum()).sum::<f64>().abs();
    sum(&terms.interior) + sum(&terms.primary) + sum(&terms.secondary)
}
