//! Predicts time and error of a setting at any number of samples.

use super::statistics::{Measure, Statistics};
use crate::check::TOLERATED;
use crate::gradient::OneSided;

/// The largest number of samples per pixel that is recommended: more than a day could compute.
pub const MAX_SAMPLES: usize = 1 << 30;

/// The measurements of a setting at one number of samples.
#[derive(Clone, Debug)]
pub struct Rung {
    /// Samples per pixel of each run.
    pub samples: usize,
    /// The median time of a run.
    pub seconds: f64,
    /// Errors relative to the reference.
    pub statistics: Statistics,
    /// The number of runs in which one sample carries so much that errors are unreliable.
    pub heavy: usize,
    /// The number of samples that were not finite, over all runs.
    pub non_finite: usize,
    /// Step of finite differences at a bound of a parameter's range, and the reason why they are one-sided.
    pub one_sided: Option<(f64, OneSided)>,
}

/// The bias relative to the gradient, as a root mean square.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Bias {
    /// Proved to be 0; measured to be below this.
    Proved {
        /// The measured bound.
        below: f64,
    },
    /// Not distinguishable from noise; below this, which is two standard errors above the measurement.
    Unresolved {
        /// The bound.
        below: f64,
    },
    /// Distinguishable from noise.
    Resolved(f64),
}

/// The error and time of a setting as functions of its number n of samples per pixel:
///
/// ```text
/// error² = bias² + variance/n,   seconds = fixed + n · each
/// ```
#[derive(Clone, Copy, Debug)]
pub struct Law {
    /// The bias.
    pub bias: Bias,
    /// The variance of one sample per pixel, relative to the mean square of the gradient.
    pub variance: Measure,
    /// Time of a run that does not depend on its samples: preparations and the control variate.
    fixed: f64,
    /// Time per sample per pixel.
    each: f64,
    /// The largest measured number of samples.
    pub measured: usize,
}

/// A number of samples with the expected time and error.
#[derive(Clone, Copy, Debug)]
pub struct Expected {
    /// Samples per pixel.
    pub samples: usize,
    /// Time of the gradient.
    pub seconds: f64,
    /// Root mean square error, relative to the gradient.
    pub error: Measure,
}

/// The bound on an unresolved bias is this many standard errors above the measurement.
const BOUND: f64 = 2.0;

impl Bias {
    fn of(statistics: &Statistics, unbiased: bool) -> Self {
        let Statistics { relative_bias2, slope, .. } = statistics;
        let too_small = (1.0 - slope.value).abs();
        // The projection on the gradient is a part of the bias, and often more accurate than the whole.
        if relative_bias2.value > TOLERATED * relative_bias2.error {
            return Self::Resolved(relative_bias2.value.sqrt());
        }
        if too_small > TOLERATED * slope.error {
            return Self::Resolved(too_small.max(relative_bias2.value.max(0.0).sqrt()));
        }
        let below = (relative_bias2.value.max(0.0) + BOUND * relative_bias2.error).sqrt();
        if unbiased { Self::Proved { below } } else { Self::Unresolved { below } }
    }

    /// The value in an expected error: 0 if proved, the bound if unresolved.
    #[must_use]
    pub fn counted(self) -> f64 {
        match self {
            Self::Proved { .. } => 0.0,
            Self::Unresolved { below } => below,
            Self::Resolved(value) => value,
        }
    }
}

impl Law {
    /// From all rungs of a setting: bias and variance from the last, the time from the first and last.
    pub(super) fn of(rungs: &[Rung], unbiased: bool) -> Option<Self> {
        let (first, last) = (rungs.first()?, rungs.last()?);
        let more = last.samples - first.samples;
        let each = if more > 0 { (last.seconds - first.seconds) / more as f64 } else { 0.0 };
        let whole = last.seconds / last.samples as f64;
        // If the noise of the clock hides the cost of samples, all time is attributed to them.
        let each = if each > 0.0 && each < whole { each } else { whole };
        Some(Self {
            bias: Bias::of(&last.statistics, unbiased),
            variance: last.statistics.relative_variance.scaled(last.samples as f64),
            fixed: last.seconds - each * last.samples as f64,
            each,
            measured: last.samples,
        })
    }

    /// The expected time and error of n samples per pixel.
    #[must_use]
    pub fn expected(&self, samples: usize) -> Expected {
        let noise = self.variance.scaled(1.0 / samples as f64);
        let error = (self.bias.counted().powi(2) + noise.value.max(0.0)).sqrt();
        let of_error = if error > 0.0 { noise.error / (2.0 * error) } else { 0.0 };
        let seconds = self.fixed + self.each * samples as f64;
        Expected { samples, seconds, error: Measure { value: error, error: of_error } }
    }

    /// The expectation for the most samples that fit into a time; nothing if one sample per pixel does not.
    #[must_use]
    pub fn within(&self, seconds: f64) -> Option<Expected> {
        let samples = ((seconds - self.fixed) / self.each).floor();
        (samples >= 1.0).then(|| self.expected(whole_strata(samples.min(MAX_SAMPLES as f64) as usize, false)))
    }

    /// The expectation for the fewest samples with at most this error; nothing if the bias exceeds it, or too
    /// many samples are needed.
    #[must_use]
    pub fn reaching(&self, error: f64) -> Option<Expected> {
        let room = error.powi(2) - self.bias.counted().powi(2);
        let samples = (self.variance.value.max(0.0) / room).ceil().max(1.0);
        let able = room > 0.0 && samples < MAX_SAMPLES as f64;
        able.then(|| self.expected(whole_strata(samples as usize, true)))
    }
}

/// Rounds down or up to a multiple of 8 from 8 on: samples are drawn in 8 groups that are stratified
/// separately and should have equal sizes.
fn whole_strata(samples: usize, up: bool) -> usize {
    if samples < 8 || samples.is_multiple_of(8) {
        samples
    } else if up {
        samples.next_multiple_of(8)
    } else {
        samples - samples % 8
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn rung(samples: usize, seconds: f64, bias2: (f64, f64), slope: (f64, f64)) -> Rung {
        let measure = |(value, error)| Measure { value, error };
        let statistics = Statistics {
            variance: measure((9.0, 1.0)),
            relative_variance: measure((1.0 / samples as f64, 0.1 / samples as f64)),
            relative_bias2: measure(bias2),
            slope: measure(slope),
        };
        Rung { samples, seconds, statistics, heavy: 0, non_finite: 0, one_sided: None }
    }

    #[test]
    fn times_and_errors_follow() {
        let rungs = [1, 64].map(|n| rung(n, 0.5 + 0.1 * n as f64, (-1e-4, 1e-4), (1.0, 0.01)));
        let law = Law::of(&rungs, true).unwrap();
        let expected = law.within(10.55).unwrap();
        assert_eq!(expected.samples, 96);
        assert!((expected.seconds - 10.1).abs() < 1e-9);
        assert!((expected.error.value - 1.0 / 96.0_f64.sqrt()).abs() < 1e-12);
        assert!((expected.error.error - 0.05 * expected.error.value).abs() < 1e-12);
        let expected = law.reaching(0.1).unwrap();
        assert!((100..=104).contains(&expected.samples) && expected.error.value <= 0.1, "{expected:?}");
        assert!(law.within(0.55).is_none());
        assert!(law.reaching(1e-6).is_none(), "more samples than can be asked for");
    }

    #[test]
    fn bias_counts_where_it_may_be() {
        let law = |bias2, slope, unbiased| Law::of(&[rung(64, 1.0, bias2, slope)], unbiased).unwrap();
        let proved = law((1e-4, 1e-4), (1.0, 0.1), true);
        assert_eq!(proved.bias.counted(), 0.0);
        let unresolved = law((1e-4, 1e-4), (1.0, 0.1), false);
        assert!((unresolved.bias.counted() - 3e-4_f64.sqrt()).abs() < 1e-12);
        let resolved = law((0.04, 0.001), (0.9, 0.1), false);
        assert_eq!(resolved.bias, Bias::Resolved(0.2));
        assert!(resolved.reaching(0.19).is_none() && resolved.reaching(0.3).is_some());
        assert_eq!(law((0.0, 0.04), (0.5, 0.1), false).bias, Bias::Resolved(0.5));
        // A measured bias overrides the proof.
        assert_eq!(law((0.04, 0.001), (0.9, 0.1), true).bias, Bias::Resolved(0.2));
    }
}
