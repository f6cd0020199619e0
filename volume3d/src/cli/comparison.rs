//! Two estimates of one number, and whether they can be told apart.

/// A mean of independent runs.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Estimate {
    pub(super) mean: f64,
    /// Its standard error.
    pub(super) error: f64,
}

impl Estimate {
    pub(super) fn of(runs: &[f64]) -> Self {
        let n = runs.len() as f64;
        let mean = runs.iter().sum::<f64>() / n;
        let spread = runs.iter().map(|x| (x - mean).powi(2)).sum::<f64>();
        Self { mean, error: (spread / (n - 1.0) / n).sqrt() }
    }

    /// (self − other) in standard errors of the difference.
    pub(super) fn z(self, other: Self) -> f64 {
        let difference = self.mean - other.mean;
        if difference == 0.0 { 0.0 } else { difference / self.error.hypot(other.error) }
    }
}

/// Finite differences with one step.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Slope {
    pub(super) step: f64,
    pub(super) estimate: Estimate,
    /// By how much it is off for its step, ~ h², estimated from the next larger step (Richardson's extrapolation),
    /// with that estimate's own noise.
    pub(super) bias: f64,
}

/// What a comparison says.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) enum Verdict {
    /// No difference beyond `within`, relative to the slope.
    Agrees {
        /// The step at which the comparison was sharpest.
        step: f64,
        within: f64,
    },
    /// A difference that neither noise nor the step explains.
    Differs { step: f64, by: f64 },
    /// Too noisy, or steps too large, to tell.
    Open {
        within: f64,
        /// How many times the samples would resolve [`RESOLUTION`], if the noise falls with their root and the steps
        /// allow it.
        more: Option<f64>,
    },
    /// Both are exactly 0, without any noise: there is nothing to compare.
    Nothing,
}

/// Standard errors that a difference may have. With 16 runs a side, that of two equal means is larger once in 2500
/// comparisons (Student's t with 30 degrees of freedom), once in 900 if one side has all the noise.
pub(super) const TOLERATED: f64 = 4.0;

/// The part of the slope that a comparison must resolve to count as one.
pub(super) const RESOLUTION: f64 = 0.1;

/// The verdict, from the step with the smallest sum of noise and bias.
pub(super) fn verdict(method: Estimate, slopes: &[Slope]) -> Verdict {
    let is_nothing = |e: Estimate| e.mean == 0.0 && e.error == 0.0;
    if is_nothing(method) && slopes.iter().all(|s| is_nothing(s.estimate)) {
        return Verdict::Nothing;
    }
    let noise = |s: &Slope| TOLERATED * method.error.hypot(s.estimate.error);
    let uncertainty = |s: &Slope| noise(s) + s.bias;
    let best = slopes.iter().min_by(|a, b| uncertainty(a).total_cmp(&uncertainty(b)));
    let Some(best) = best else { return Verdict::Open { within: f64::INFINITY, more: None } };
    let size = best.estimate.mean.abs();
    let (difference, uncertain) = ((method.mean - best.estimate.mean).abs(), uncertainty(best));
    if difference > uncertain {
        Verdict::Differs { step: best.step, by: difference / size }
    } else if uncertain <= RESOLUTION * size {
        Verdict::Agrees { step: best.step, within: uncertain / size }
    } else {
        // With more samples another step may be the best.
        let more = slopes.iter().filter_map(|s| {
            let room = RESOLUTION * s.estimate.mean.abs() - s.bias;
            (room > 0.0).then(|| (noise(s) / room).powi(2))
        });
        Verdict::Open { within: uncertain / size, more: more.min_by(f64::total_cmp) }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn slope(step: f64, mean: f64, error: f64, bias: f64) -> Slope {
        Slope { step, estimate: Estimate { mean, error }, bias }
    }

    #[test]
    fn the_error_of_a_mean_is_that_of_its_spread() {
        let estimate = Estimate::of(&[1.0, 2.0, 3.0]);
        assert_eq!(estimate.mean, 2.0);
        assert!((estimate.error - (1.0_f64 / 3.0).sqrt()).abs() < 1e-15);
    }

    #[test]
    fn verdicts() {
        let method = Estimate { mean: 1.0, error: 0.01 };
        let slopes =
            [slope(0.1, 1.3, 0.001, 0.3), slope(0.01, 1.01, 0.01, 0.003), slope(0.001, 0.8, 0.1, 0.0)];
        assert!(matches!(verdict(method, &slopes), Verdict::Agrees { step: 0.01, .. }));
        let flipped = Estimate { mean: -1.0, error: 0.01 };
        assert!(matches!(verdict(flipped, &slopes), Verdict::Differs { step: 0.01, .. }));
        assert!(matches!(verdict(method, &slopes[2..]), Verdict::Open { more: Some(_), .. }));
        let biased = [slope(0.1, 1.0, 0.0, 0.2)];
        assert!(matches!(verdict(method, &biased), Verdict::Open { more: None, .. }));
        // Four errors of 0.05 leave 20 % open; a tenth of them needs four times the samples.
        let noisy = Estimate { mean: 1.0, error: 0.05 };
        let Verdict::Open { within, more } = verdict(noisy, &[slope(0.1, 1.0, 0.0, 0.0)]) else { panic!() };
        assert!((within - 0.2).abs() < 1e-12 && (more.unwrap() - 4.0).abs() < 1e-12, "{within} {more:?}");
    }

    #[test]
    fn nothing_does_not_agree() {
        let (nothing, still) = (Estimate { mean: 0.0, error: 0.0 }, [slope(0.1, 0.0, 0.0, 0.0)]);
        assert_eq!(verdict(nothing, &still), Verdict::Nothing);
        let noisy = Estimate { mean: 0.1, error: 0.1 };
        assert!(matches!(verdict(noisy, &still), Verdict::Open { more: None, .. }));
        let wrong = Estimate { mean: 1.0, error: 0.1 };
        assert!(matches!(verdict(wrong, &still), Verdict::Differs { .. }));
    }
}
