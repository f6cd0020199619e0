//! Two estimates of one number, and whether they can be told apart.
//!
//! Finite differences see a discontinuity move only in the few samples that it crosses: rare events, the
//! rarer the smaller the step. The spread of runs contains nothing of events that did not happen, and is
//! smallest where fewest were seen. So a bound has three parts:
//!
//! - Student's quantile times the standard error of 16 runs;
//! - the rule of three, for samples like the largest: an event that n samples did not see has a rate below ln(1/δ)/n, with a
//!   confidence of 1 − δ (3/n of 95 %). The largest is that of this step and of all larger ones, as a jump that one step saw is
//!   there at all of them. (The empirical Bernstein bound of Maurer and Pontil, 2009, which holds for all that is bounded, has
//!   7/3 of that; events alone do not need as much, as the tests show.)
//! - the same for what no sample of any step saw, which changes a sample by no more than the brightest pixel.
//!
//! Each step has its own bound, and all hold together (Bonferroni). The method differs if it is outside the
//! bound of any step; it agrees within the narrowest bound.

/// A mean of independent runs.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Estimate {
    pub(super) mean: f64,
    /// Its standard error.
    pub(super) error: f64,
    /// The most that one sample may contribute to the mean, judged by those that were seen.
    pub(super) grain: f64,
}

impl Estimate {
    pub(super) fn of(runs: &[f64], grain: f64) -> Self {
        let n = runs.len() as f64;
        let mean = runs.iter().sum::<f64>() / n;
        let spread = runs.iter().map(|x| (x - mean).powi(2)).sum::<f64>();
        Self { mean, error: (spread / (n - 1.0) / n).sqrt(), grain }
    }

    /// The difference from an independent estimate.
    fn minus(self, other: Self) -> Self {
        Self {
            mean: self.mean - other.mean,
            error: self.error.hypot(other.error),
            grain: self.grain.max(other.grain),
        }
    }

    /// (self − other) in standard errors of the difference.
    pub(super) fn z(self, other: Self) -> f64 {
        let Self { mean, error, .. } = self.minus(other);
        if mean == 0.0 { 0.0 } else { mean / error }
    }
}

/// Finite differences with one step.
#[derive(Clone, Debug, PartialEq)]
pub(super) struct Slope {
    pub(super) step: f64,
    pub(super) estimate: Estimate,
    /// The slope extrapolated to a step of 0 from this and each larger step, as if the error were
    /// proportional to the step: F(h) − (F(H) − F(h))/(H/h − 1). An error that falls faster leaves the truth
    /// between F(h) and these.
    pub(super) extrapolated: Vec<Estimate>,
    /// Contribution of one sample that changes, at the largest step, by as much as the brightest pixel.
    pub(super) unseen: f64,
}

impl Slope {
    /// Finite differences at all steps, from large to small, from the totals of runs with common random
    /// numbers. Of each step, the most that a sample like the largest would add to the mean of all runs, and
    /// at the largest step what one would that changes by as much as the brightest pixel.
    pub(super) fn of(steps: &[f64], totals: &[Vec<f64>], grains: &[f64], unseen: f64) -> Vec<Self> {
        let slope = |(i, &step): (usize, &f64)| {
            let grain = grains[i];
            let from = |(&larger, of_larger): (&f64, &Vec<f64>)| {
                let more = 1.0 / (larger / step - 1.0);
                let both = totals[i].iter().zip(of_larger);
                let runs: Vec<f64> = both.map(|(small, large)| small + more * (small - large)).collect();
                Estimate::of(&runs, (1.0 + more) * grain)
            };
            let extrapolated = steps[..i].iter().zip(totals).map(from).collect();
            Self { step, estimate: Estimate::of(&totals[i], grain), extrapolated, unseen }
        };
        steps.iter().enumerate().map(slope).collect()
    }

    /// Upper bound on the error due to the step.
    pub(super) fn bias(&self) -> f64 {
        let apart = self.extrapolated.iter().map(|e| (e.mean - self.estimate.mean).abs());
        apart.reduce(f64::max).unwrap_or(f64::INFINITY)
    }

    /// Bounds of the method less the truth. With `times` the samples, noise is as much less; all else stays
    /// as it is.
    fn bounds(&self, method: Estimate, tolerance: Tolerance, times: f64) -> [f64; 2] {
        let all = std::iter::once(&self.estimate).chain(&self.extrapolated);
        all.fold([f64::INFINITY, f64::NEG_INFINITY], |[low, high], e| {
            let difference = method.minus(*e);
            let slack = tolerance.slack(difference, self.unseen, times);
            [low.min(difference.mean - slack), high.max(difference.mean + slack)]
        })
    }

    /// Factor on the samples that would resolve [`RESOLUTION`], to √2, if the steps allow it.
    fn more(&self, method: Estimate, tolerance: Tolerance) -> Option<f64> {
        let wanted = RESOLUTION * self.estimate.mean.abs();
        let times = (1..=40).map(|k| 2.0_f64.powf(0.5 * f64::from(k)));
        times.into_iter().find(|&times| half_width(self.bounds(method, tolerance, times)) <= wanted)
    }
}

fn half_width([low, high]: [f64; 2]) -> f64 {
    0.5 * (high - low)
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

/// Independent runs of each estimate.
pub(super) const RUNS: usize = 16;

/// Standard errors that the mean of 16 runs may be off: more than that happens once in 900 means (Student's t
/// with 15 degrees of freedom).
pub(super) const TOLERATED: f64 = 4.0;

/// How often a verdict may say of a right gradient that it differs.
pub(super) const FALSE_ALARMS: f64 = 1.0 / 900.0;

/// The part of the slope that a comparison must resolve to count as one.
pub(super) const RESOLUTION: f64 = 0.1;

/// What chance may do in each of several comparisons, so that all of them together raise a false alarm once
/// in 1/[`FALSE_ALARMS`].
#[derive(Clone, Copy)]
struct Tolerance {
    /// In standard errors: Student's quantile for 16 runs, as one side may have all the noise.
    errors: f64,
    /// ln(2/δ).
    logarithm: f64,
}

impl Tolerance {
    fn of(comparisons: usize) -> Self {
        let rate = FALSE_ALARMS / comparisons as f64;
        Self { errors: student(rate), logarithm: (2.0 / rate).ln() }
    }

    fn slack(self, difference: Estimate, unseen: f64, times: f64) -> f64 {
        let rare = difference.grain + unseen;
        self.errors * difference.error / times.sqrt() + self.logarithm * rare / times
    }
}

/// Student's quantile of |t| for a mean of [`RUNS`] normal numbers.
///
/// With t = √ν tan φ Student's density is ~ cosᵛ⁻¹ φ.
fn student(probability: f64) -> f64 {
    const FREEDOM: i32 = RUNS as i32 - 1;
    const NODES: usize = 4096;
    let width = 0.5 * std::f64::consts::PI / NODES as f64;
    let parts = (0..NODES).rev().map(|i| ((i as f64 + 0.5) * width).cos().powi(FREEDOM - 1));
    let whole: f64 = parts.clone().sum();
    let mut beyond = 0.0;
    // From the end of the tail inwards.
    let inner = parts.take_while(|part| {
        beyond += part;
        beyond <= probability * whole
    });
    let angle = width * (NODES - inner.count()) as f64;
    f64::from(FREEDOM).sqrt() * angle.tan()
}

/// The verdict. The largest step is not compared itself: it says how far off the next one may be.
pub(super) fn verdict(method: Estimate, slopes: &[Slope]) -> Verdict {
    let is_nothing = |e: Estimate| e.mean == 0.0 && e.error == 0.0;
    if is_nothing(method) && slopes.iter().all(|s| is_nothing(s.estimate)) {
        return Verdict::Nothing;
    }
    let compared = || slopes.iter().filter(|s| !s.extrapolated.is_empty());
    let tolerance = Tolerance::of(compared().count().max(1));
    let bounds = |s: &Slope| s.bounds(method, tolerance, 1.0);
    // Distance of the method from its bounds, in units of their width.
    let outside = |s: &Slope| {
        let [low, high] = bounds(s);
        let beyond = low.max(-high);
        if beyond > 0.0 { beyond / half_width([low, high]) } else { 0.0 }
    };
    let farthest = compared().max_by(|a, b| outside(a).total_cmp(&outside(b)));
    let sharpest = compared().min_by(|a, b| half_width(bounds(a)).total_cmp(&half_width(bounds(b))));
    let (Some(farthest), Some(sharpest)) = (farthest, sharpest) else {
        return Verdict::Open { within: f64::INFINITY, more: None };
    };
    if outside(farthest) > 0.0 {
        let slope = farthest.estimate.mean;
        return Verdict::Differs { step: farthest.step, by: ((method.mean - slope) / slope).abs() };
    }
    let within = half_width(bounds(sharpest)) / sharpest.estimate.mean.abs();
    if within <= RESOLUTION {
        return Verdict::Agrees { step: sharpest.step, within };
    }
    // With more samples another step may be the best.
    let more = compared().filter_map(|s| s.more(method, tolerance)).min_by(f64::total_cmp);
    Verdict::Open { within, more }
}

#[cfg(test)]
mod tests;
