//! z-tests of unbiasedness over many comparisons, and rates of convergence.
//!
//! A mean of n samples is compared with an exact value by z = (mean − exact)/standard error. With
//! m comparisons and a false-alarm rate α for all of them, |z| may reach the two-sided normal
//! quantile of α/m (Bonferroni). Normality and a standard error that has settled are the test's
//! own assumptions: n must be large, and [`Moments::has_settled`] checks the second.

use std::fmt::Write as _;

use statrs::distribution::{ContinuousCDF, Normal};

/// |z| above this rejects: the threshold of every statistical test of the suite, which makes no more
/// than 12,000 comparisons, thorough ones included, for a false-alarm rate of 10⁻⁶ of all of them
/// together.
#[must_use]
pub fn suite_threshold() -> f64 {
    threshold(1e-6, 12_000)
}

/// Mean and variance of a stream of numbers, by Welford's recurrence.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Moments {
    count: u64,
    mean: f64,
    /// Σ (x − mean)².
    squares: f64,
}

impl Moments {
    /// Of no numbers.
    #[must_use]
    pub fn new() -> Self {
        Self::default()
    }

    /// Takes one more number.
    pub fn push(&mut self, x: f64) {
        self.count += 1;
        let before = x - self.mean;
        self.mean += before / self.count as f64;
        self.squares += before * (x - self.mean);
    }

    /// Those of both streams together (Chan, Golub and LeVeque 1979).
    #[must_use]
    pub fn merge(self, other: Self) -> Self {
        if self.count == 0 || other.count == 0 {
            return if self.count == 0 { other } else { self };
        }
        let count = self.count + other.count;
        let (n, m) = (self.count as f64, other.count as f64);
        let difference = other.mean - self.mean;
        Self {
            count,
            mean: self.mean + difference * m / (n + m),
            squares: self.squares + other.squares + difference * difference * n * m / (n + m),
        }
    }

    /// How many numbers.
    #[must_use]
    pub fn count(&self) -> u64 {
        self.count
    }

    /// Their mean; 0 of none.
    #[must_use]
    pub fn mean(&self) -> f64 {
        self.mean
    }

    /// The unbiased estimate of their variance; infinite of fewer than two.
    #[must_use]
    pub fn variance(&self) -> f64 {
        if self.count < 2 { f64::INFINITY } else { self.squares / (self.count - 1) as f64 }
    }

    /// The standard error of the mean, √(variance/count).
    #[must_use]
    pub fn standard_error(&self) -> f64 {
        (self.variance() / self.count.max(1) as f64).sqrt()
    }

    /// Whether doubling the samples leaves the standard deviation alone: `self` over the first half
    /// of the samples that `doubled` is over, and neither standard deviation is more than `factor`
    /// times the other. Under heavy tails a new largest sample keeps raising it.
    #[must_use]
    pub fn has_settled(&self, doubled: &Self, factor: f64) -> bool {
        let (first, both) = (self.variance().sqrt(), doubled.variance().sqrt());
        first.is_finite() && both.is_finite() && first <= factor * both && both <= factor * first
    }
}

impl Extend<f64> for Moments {
    fn extend<T: IntoIterator<Item = f64>>(&mut self, samples: T) {
        samples.into_iter().for_each(|x| self.push(x));
    }
}

impl FromIterator<f64> for Moments {
    fn from_iter<T: IntoIterator<Item = f64>>(samples: T) -> Self {
        let mut moments = Self::new();
        moments.extend(samples);
        moments
    }
}

/// The |z| that the largest of `comparisons` normal deviates exceeds with probability at most
/// `false_alarm`: the two-sided normal quantile, corrected by Bonferroni.
///
/// # Panics
/// If `false_alarm` is not in (0, 1) or there is nothing to compare.
#[must_use]
pub fn threshold(false_alarm: f64, comparisons: usize) -> f64 {
    assert!(false_alarm > 0.0 && false_alarm < 1.0, "false-alarm rate {false_alarm}");
    assert!(comparisons > 0, "no comparison");
    // The lower tail: 1 minus a small number would round it away.
    -Normal::standard().inverse_cdf(0.5 * false_alarm / comparisons as f64)
}

/// One mean and what it should be.
#[derive(Clone, Debug, PartialEq)]
pub struct Comparison {
    /// What was compared: enough to repeat it.
    pub label: String,
    /// The mean found.
    pub mean: f64,
    /// The exact value.
    pub exact: f64,
    /// The standard error of the mean.
    pub standard_error: f64,
    /// Their difference beyond rounding in standard errors; infinite if the error is 0, and NaN
    /// where any number is.
    pub z: f64,
}

/// Comparisons collected before any of them is judged.
#[derive(Clone, Debug, Default)]
pub struct ZReport {
    rounding: f64,
    comparisons: Vec<Comparison>,
}

impl ZReport {
    /// A report in which differences of up to `rounding` count as none, so that estimates without
    /// variance can be compared too; 1e-12 times the values' scale, say, and 0 to forgive nothing.
    #[must_use]
    pub fn new(rounding: f64) -> Self {
        Self { rounding, comparisons: vec![] }
    }

    /// Adds a mean with its standard error.
    pub fn compare(&mut self, label: impl Into<String>, mean: f64, exact: f64, standard_error: f64) {
        let difference = mean - exact;
        let beyond = (difference.abs() - self.rounding).max(0.0).copysign(difference);
        let z = if difference.is_nan() || standard_error.is_nan() {
            f64::NAN
        } else if beyond == 0.0 {
            0.0
        } else {
            beyond / standard_error
        };
        self.comparisons.push(Comparison { label: label.into(), mean, exact, standard_error, z });
    }

    /// Adds the mean of a stream of samples.
    pub fn compare_moments(&mut self, label: impl Into<String>, moments: &Moments, exact: f64) {
        self.compare(label, moments.mean(), exact, moments.standard_error());
    }

    /// All comparisons, in the order of their addition.
    #[must_use]
    pub fn comparisons(&self) -> &[Comparison] {
        &self.comparisons
    }

    /// The comparison with the largest |z|, NaN being larger than all; `None` of none.
    #[must_use]
    pub fn worst(&self) -> Option<&Comparison> {
        self.comparisons.iter().max_by(|a, b| size(a).total_cmp(&size(b)))
    }

    /// Those whose |z| exceeds the [`threshold`] at a false-alarm rate for the whole report, the
    /// worst first.
    ///
    /// # Panics
    /// If `false_alarm` is not in (0, 1).
    #[must_use]
    pub fn failures(&self, false_alarm: f64) -> Vec<&Comparison> {
        let limit = threshold(false_alarm, self.comparisons.len().max(1));
        let mut failures: Vec<_> = self.comparisons.iter().filter(|c| size(c) > limit).collect();
        failures.sort_by(|a, b| size(b).total_cmp(&size(a)));
        failures
    }

    /// Every failure with value, reference, standard error and tolerance, and the worst comparison
    /// in any case.
    ///
    /// # Panics
    /// If `false_alarm` is not in (0, 1).
    #[must_use]
    pub fn summary(&self, false_alarm: f64) -> String {
        let Some(worst) = self.worst() else { return "nothing was compared".into() };
        let limit = threshold(false_alarm, self.comparisons.len());
        let failures = self.failures(false_alarm);
        let line = |c: &Comparison| {
            let tolerance = limit * c.standard_error + self.rounding;
            format!(
                "{}: {:.6e} for {:.6e} ± {:.1e}, z = {:.2} (tolerance {tolerance:.1e})",
                c.label, c.mean, c.exact, c.standard_error, c.z
            )
        };
        let mut text = format!(
            "{} of {} comparisons beyond |z| = {limit:.2}; worst: {}",
            failures.len(),
            self.comparisons.len(),
            line(worst)
        );
        for failure in failures {
            write!(text, "\n  {}", line(failure)).expect("strings take all");
        }
        text
    }

    /// Prints the summary and fails if any comparison does, or if there is none.
    ///
    /// # Panics
    /// With the summary, if a comparison exceeds the threshold or nothing was compared.
    pub fn assert_unbiased(&self, false_alarm: f64) {
        let summary = self.summary(false_alarm);
        println!("{summary}");
        assert!(!self.comparisons.is_empty() && self.failures(false_alarm).is_empty(), "{summary}");
    }

    /// Prints the summary and fails unless some comparison does: what a negative control must do.
    ///
    /// # Panics
    /// With the summary, if no comparison exceeds the threshold.
    pub fn assert_rejected(&self, false_alarm: f64) {
        let summary = self.summary(false_alarm);
        println!("rejected: {summary}");
        assert!(!self.failures(false_alarm).is_empty(), "not rejected: {summary}");
    }
}

/// |z|, with NaN worse than everything.
fn size(comparison: &Comparison) -> f64 {
    if comparison.z.is_nan() { f64::INFINITY } else { comparison.z.abs() }
}

/// The slope of the least-squares line through (x, y): of logarithms, the rate of a power law.
///
/// # Panics
/// If the numbers of x and y differ, there are fewer than two, or all x are equal.
#[must_use]
pub fn regression_slope(x: &[f64], y: &[f64]) -> f64 {
    assert_eq!(x.len(), y.len(), "one y per x");
    assert!(x.len() >= 2, "a line needs two points");
    let mean = |v: &[f64]| v.iter().sum::<f64>() / v.len() as f64;
    let (mx, my) = (mean(x), mean(y));
    let (sxy, sxx) = x
        .iter()
        .zip(y)
        .fold((0.0, 0.0), |(sxy, sxx), (x, y)| (sxy + (x - mx) * (y - my), sxx + (x - mx) * (x - mx)));
    assert!(sxx > 0.0, "all x are equal");
    sxy / sxx
}

#[cfg(test)]
mod tests {
    use flatland::random::{open01, stream};

    use super::*;

    #[test]
    fn moments_are_those_of_the_numbers() {
        let numbers = [1e9 + 4.0, 1e9 + 7.0, 1e9 + 13.0, 1e9 + 16.0];
        let all: Moments = numbers.into_iter().collect();
        assert_eq!((all.count(), all.mean(), all.variance()), (4, 1e9 + 10.0, 30.0));
        assert_eq!(all.standard_error(), 7.5_f64.sqrt());
        for cut in 0..=4 {
            let part = |s: &[f64]| s.iter().copied().collect::<Moments>();
            let merged = part(&numbers[..cut]).merge(part(&numbers[cut..]));
            assert_eq!((merged.count(), merged.mean(), merged.variance()), (4, 1e9 + 10.0, 30.0));
        }
        assert_eq!(Moments::new().standard_error(), f64::INFINITY);
    }

    #[test]
    fn thresholds_are_normal_quantiles() {
        // 95% and the "five sigma" of physics, two-sided; and 1e-6 over 100 comparisons.
        for (rate, comparisons, z) in [
            (0.05, 1, 1.959_963_984_540_054),
            (5.733_031_437_583_87e-7, 1, 5.0),
            (0.1, 2, 1.959_963_984_540_054),
            (1e-6, 100, 5.730_728_868_235_683),
        ] {
            let found = threshold(rate, comparisons);
            assert!((found - z).abs() < 1e-8, "{rate} of {comparisons}: {found} for {z}");
        }
    }

    #[test]
    fn a_bias_is_found_and_no_bias_is_not() {
        let moments = |seed| {
            let mut rng = stream(seed, &[]);
            (0..2000).map(|_| open01(&mut rng)).collect::<Moments>()
        };
        let mut report = ZReport::new(0.0);
        for seed in 0..500 {
            report.compare_moments(format!("seed {seed}"), &moments(seed), 0.5);
        }
        report.assert_unbiased(1e-6);
        report.compare_moments("biased", &moments(1000), 0.45);
        report.compare("not a number", f64::NAN, 0.0, 1.0);
        report.assert_rejected(1e-6);
        assert_eq!(report.failures(1e-6).len(), 2);
        let summary = report.summary(1e-6);
        assert!(summary.contains("biased: ") && summary.contains("not a number"), "{summary}");
    }

    #[test]
    fn rounding_is_forgiven_and_a_difference_without_variance_is_not() {
        let mut report = ZReport::new(1e-12);
        report.compare("rounded", 1.0 + 1e-14, 1.0, 0.0);
        report.assert_unbiased(1e-6);
        report.compare("wrong", 1.0 + 1e-10, 1.0, 0.0);
        report.assert_rejected(1e-6);
        assert_eq!(report.worst().map(|c| c.z), Some(f64::INFINITY));
    }

    #[test]
    #[should_panic(expected = "nothing was compared")]
    fn an_empty_report_fails() {
        ZReport::new(0.0).assert_unbiased(1e-6);
    }

    #[test]
    fn heavy_tails_do_not_settle() {
        let mut rng = stream(3, &[]);
        let flat: Vec<_> = (0..20_000).map(|_| open01(&mut rng)).collect();
        // Density ∝ x⁻², without a mean.
        let heavy: Vec<_> = flat.iter().map(|u| 1.0 / u).collect();
        let settled = |v: &[f64], factor| {
            let part = |s: &[f64]| s.iter().copied().collect::<Moments>();
            (1..6).all(|k| {
                let n = v.len() >> k;
                part(&v[..n]).has_settled(&part(&v[..2 * n]), factor)
            })
        };
        assert!(settled(&flat, 1.05));
        assert!(!settled(&heavy, 1.2));
    }

    #[test]
    fn slopes_of_power_laws() {
        let x: Vec<f64> = (1..8).map(|k| f64::from(k).ln()).collect();
        let y: Vec<f64> = x.iter().map(|x| 3.0 - 0.5 * x).collect();
        assert!((regression_slope(&x, &y) + 0.5).abs() < 1e-14);
    }
}
