//! Whether two estimates of one number differ.
//!
//! Finite differences see a moving discontinuity only in the few samples that it crosses, and in fewer for
//! smaller steps. The spread of runs does not account for such rare events that did not happen. A bound is
//! therefore the sum of three parts:
//!
//! - Student's quantile times the standard error of 16 runs;
//! - the rule of three, for samples like the largest: an event that none of n samples saw has a rate below
//!   ln(1/δ)/n with confidence 1 − δ (3/n for 95 %). The largest sample is that of this step and of all
//!   larger ones, because a discontinuity seen at one step exists at all of them. (The empirical Bernstein
//!   bound of Maurer and Pontil, 2009, has 7/3 times this term and holds for any bounded variable; rare
//!   events do not need it, as the tests show.)
//! - the same for a change that no sample of any step saw; a sample changes by at most the brightest pixel.
//!
//! Each step has its own bound, with confidences that make all of them hold together (Bonferroni). The method
//! differs if it is outside the bound of any step, and agrees within the narrowest bound.

/// The mean of independent runs.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Estimate {
    pub(super) mean: f64,
    /// Its standard error.
    pub(super) error: f64,
    /// The most that one sample contributes to the mean, estimated from the samples seen.
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

/// The slope by finite differences with one step.
#[derive(Clone, Debug, PartialEq)]
pub(super) struct Slope {
    pub(super) step: f64,
    pub(super) estimate: Estimate,
    /// The slope extrapolated to a step of 0 from this step h and each larger step H, for an error
    /// proportional to the step: F(h) − (F(H) − F(h))/(H/h − 1). If the error falls faster than the step, the
    /// true slope is between F(h) and these.
    pub(super) extrapolated: Vec<Estimate>,
    /// The contribution to the slope at the largest step of a sample that changes by the brightest pixel.
    pub(super) unseen: f64,
}

impl Slope {
    /// The slopes at all steps, sorted from large to small, from the totals of runs with common random
    /// numbers. `grains`: for each step, the most that one sample like the largest contributes to the mean of
    /// all runs. `unseen`: see [`Slope::unseen`].
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

    /// Upper bound on the error due to the step; ∞ at the largest step.
    pub(super) fn bias(&self) -> f64 {
        let apart = self.extrapolated.iter().map(|e| (e.mean - self.estimate.mean).abs());
        apart.reduce(f64::max).unwrap_or(f64::INFINITY)
    }

    /// Bounds on the method's value minus the true slope. With `times` as many samples, the noise is smaller
    /// and everything else is the same.
    fn bounds(&self, method: Estimate, tolerance: Tolerance, times: f64) -> [f64; 2] {
        let all = std::iter::once(&self.estimate).chain(&self.extrapolated);
        all.fold([f64::INFINITY, f64::NEG_INFINITY], |[low, high], e| {
            let difference = method.minus(*e);
            let slack = tolerance.slack(difference, self.unseen, times);
            [low.min(difference.mean - slack), high.max(difference.mean + slack)]
        })
    }

    /// The smallest factor on the number of samples that resolves [`RESOLUTION`], in powers of √2 up to 2²⁰;
    /// nothing if the steps do not allow it.
    fn more(&self, method: Estimate, tolerance: Tolerance) -> Option<f64> {
        let wanted = RESOLUTION * self.estimate.mean.abs();
        let times = (1..=40).map(|k| 2.0_f64.powf(0.5 * f64::from(k)));
        times.into_iter().find(|&times| half_width(self.bounds(method, tolerance, times)) <= wanted)
    }
}

fn half_width([low, high]: [f64; 2]) -> f64 {
    0.5 * (high - low)
}

/// The result of a comparison.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) enum Verdict {
    /// No difference larger than `within`, relative to the slope.
    Agrees {
        /// The step with the narrowest bounds.
        step: f64,
        within: f64,
    },
    /// A difference that neither noise nor the step explains.
    Differs { step: f64, by: f64 },
    /// Undecided: too much noise, or too large steps.
    Open {
        within: f64,
        /// The factor on the number of samples that resolves [`RESOLUTION`], if the noise falls as 1/√samples
        /// and the steps allow it.
        more: Option<f64>,
    },
    /// Both estimates are exactly 0, without noise.
    Nothing,
}

/// The number of independent runs of each estimate.
pub(super) const RUNS: usize = 16;

/// Tolerance for the mean of 16 runs in standard errors: exceeded by one mean in 900 (Student's t with 15
/// degrees of freedom).
pub(super) const TOLERATED: f64 = 4.0;

/// The probability that a correct gradient gets the verdict [`Verdict::Differs`], at most.
pub(super) const FALSE_ALARMS: f64 = 1.0 / 900.0;

/// The relative difference that a comparison must resolve to be decided.
pub(super) const RESOLUTION: f64 = 0.1;

/// The tolerance of each of several comparisons, so that the probability of a false alarm in any of them is
/// [`FALSE_ALARMS`].
#[derive(Clone, Copy)]
struct Tolerance {
    /// In standard errors: Student's quantile for 16 runs, because one of the two estimates may have all the
    /// noise.
    errors: f64,
    /// ln(2/δ), for the rule of three on both sides.
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

/// Student's quantile of |t| for the mean of [`RUNS`] normal numbers.
///
/// With t = √ν tan φ, Student's density in φ is proportional to cosᵛ⁻¹ φ.
fn student(probability: f64) -> f64 {
    const FREEDOM: i32 = RUNS as i32 - 1;
    const NODES: usize = 4096;
    let width = 0.5 * std::f64::consts::PI / NODES as f64;
    let parts = (0..NODES).rev().map(|i| ((i as f64 + 0.5) * width).cos().powi(FREEDOM - 1));
    let whole: f64 = parts.clone().sum();
    let mut beyond = 0.0;
    // Sums from the tail inwards.
    let inner = parts.take_while(|part| {
        beyond += part;
        beyond <= probability * whole
    });
    let angle = width * (NODES - inner.count()) as f64;
    f64::from(FREEDOM).sqrt() * angle.tan()
}

/// The verdict. The largest step is not compared: it only bounds the error of the next one.
pub(super) fn verdict(method: Estimate, slopes: &[Slope]) -> Verdict {
    let is_nothing = |e: Estimate| e.mean == 0.0 && e.error == 0.0;
    if is_nothing(method) && slopes.iter().all(|s| is_nothing(s.estimate)) {
        return Verdict::Nothing;
    }
    let compared = || slopes.iter().filter(|s| !s.extrapolated.is_empty());
    let tolerance = Tolerance::of(compared().count().max(1));
    let bounds = |s: &Slope| s.bounds(method, tolerance, 1.0);
    // The method's distance from its bounds, in units of their half-width.
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
    // With more samples another step may have the narrowest bounds.
    let more = compared().filter_map(|s| s.more(method, tolerance)).min_by(f64::total_cmp);
    Verdict::Open { within, more }
}

#[cfg(test)]
mod tests;
