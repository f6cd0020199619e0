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
//! The error of the quotient itself, e(h) = F(h) − T for the slope F(h) at step h and the true slope T, is
//! bounded by the slopes at larger steps H. Let the error fall at least in proportion to the step, whatever
//! its sign: |e(h)| ≤ (h/H) |e(H)|. Then
//!
//! ```text
//! |F(H) − F(h)| = |e(H) − e(h)| ≥ |e(H)| − |e(h)| ≥ (H/h − 1) |e(h)|,
//! |e(h)| ≤ |F(H) − F(h)|/(H/h − 1).
//! ```
//!
//! The bound holds on both sides of F(h): an error may change its sign between H and h. It fails where e(H)
//! is small because the sign changes near H. Three steps H₂ > H₁ > h show that the error does not fall in
//! proportion: if it did, then |F(H₁) − F(h)| ≤ (1 + h/H₁) |e(H₁)| and |F(H₂) − F(H₁)| ≥ (H₂/H₁ − 1)
//! |e(H₁)|, so that
//!
//! ```text
//! |F(H₁) − F(h)| ≤ (1 + h/H₁)/(H₂/H₁ − 1) · |F(H₂) − F(H₁)|.
//! ```
//!
//! Three steps can contradict this, and at the second largest step it cannot be tested. There the whole
//! difference |F(H₁) − F(h)| replaces the bound from the next larger step. It bounds |e(h)| if both errors
//! have opposite signs, if e(H₁) = 0, or if |e(H₁)| ≥ 2 |e(h)|. The largest bound from all larger steps
//! counts. An error that is as large at H₁ as at h, with the same sign, is not found by two steps.
//!
//! Each step has its own bound, with confidences that make all of them hold together (Bonferroni). The method
//! differs if it is outside the bound of any step, and agrees within the narrowest bound.

/// The mean of independent runs.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Estimate {
    /// The mean.
    pub mean: f64,
    /// Its standard error.
    pub error: f64,
    /// The most that one sample contributes to the mean, estimated from the samples seen.
    pub grain: f64,
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
    #[must_use]
    pub fn z(self, other: Self) -> f64 {
        let Self { mean, error, .. } = self.minus(other);
        if mean == 0.0 { 0.0 } else { mean / error }
    }
}

/// The slope by finite differences with one step.
#[derive(Clone, Debug, PartialEq)]
pub struct Slope {
    /// The step.
    pub step: f64,
    /// The slope.
    pub estimate: Estimate,
    /// Values between which the true slope lies, apart from noise, a pair F(h) ± b for each larger step; none
    /// at the largest step.
    bounds: Vec<Estimate>,
    /// The contribution to the slope at the largest step of a sample that changes by the brightest pixel.
    unseen: f64,
}

impl Slope {
    /// The slopes at all steps, sorted from large to small, from the totals of runs with common random
    /// numbers. `grains`: for each step, the most that one sample like the largest contributes to the mean of
    /// all runs. `unseen`: see [`Slope::unseen`].
    pub(super) fn of(steps: &[f64], totals: &[Vec<f64>], grains: &[f64], unseen: f64) -> Vec<Self> {
        let means: Vec<f64> = totals.iter().map(|runs| Estimate::of(runs, 0.0).mean).collect();
        let slope = |i: usize| {
            let bounds = (0..i).flat_map(|larger| {
                let part = bias_per_difference(steps, &means, larger, i);
                [part, -part].map(|part| {
                    let both = totals[i].iter().zip(&totals[larger]);
                    let runs: Vec<f64> = both.map(|(small, large)| small + part * (large - small)).collect();
                    Estimate::of(&runs, (1.0 + part.abs()) * grains[i])
                })
            });
            let (step, estimate) = (steps[i], Estimate::of(&totals[i], grains[i]));
            Self { step, estimate, bounds: bounds.collect(), unseen }
        };
        (0..steps.len()).map(slope).collect()
    }

    /// Upper bound on the error due to the step; ∞ at the largest step.
    #[must_use]
    pub fn bias(&self) -> f64 {
        let apart = self.bounds.iter().map(|e| (e.mean - self.estimate.mean).abs());
        apart.reduce(f64::max).unwrap_or(f64::INFINITY)
    }

    /// Bounds on the method's value minus the true slope. With `times` as many samples, the noise is smaller
    /// and everything else is the same.
    fn difference(&self, method: Estimate, tolerance: Tolerance, times: f64) -> [f64; 2] {
        let all = std::iter::once(&self.estimate).chain(&self.bounds);
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
        times.into_iter().find(|&times| half_width(self.difference(method, tolerance, times)) <= wanted)
    }
}

/// The bound on the bias of the slope at step `i`, divided by its difference from that at a larger step: see
/// the module.
fn bias_per_difference(steps: &[f64], means: &[f64], larger: usize, i: usize) -> f64 {
    let falls_in_proportion = || {
        let [before, last] = [means[i - 2] - means[i - 1], means[i - 1] - means[i]];
        let most = (1.0 + steps[i] / steps[i - 1]) / (steps[i - 2] / steps[i - 1] - 1.0);
        last.abs() <= most * before.abs()
    };
    let is_next = larger + 1 == i;
    if is_next && (i < 2 || !falls_in_proportion()) { 1.0 } else { 1.0 / (steps[larger] / steps[i] - 1.0) }
}

fn half_width([low, high]: [f64; 2]) -> f64 {
    0.5 * (high - low)
}

/// The result of a comparison.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Verdict {
    /// No difference larger than `within`, relative to the slope.
    Agrees {
        /// The step with the narrowest bounds.
        step: f64,
        /// The half-width of the bounds, relative to the slope.
        within: f64,
    },
    /// A difference that neither noise nor the step explains.
    Differs {
        /// The step at which the method is farthest outside the bounds.
        step: f64,
        /// The difference, relative to the slope; infinite if that is 0.
        by: f64,
    },
    /// Undecided: too much noise, or too large steps.
    Open {
        /// The half-width of the bounds, relative to the slope; infinite if there is no slope.
        within: f64,
        /// The factor on the number of samples that resolves [`RESOLUTION`], if the noise falls as 1/√samples
        /// and the steps allow it.
        more: Option<f64>,
    },
    /// Both estimates are exactly 0, without noise.
    Nothing,
}

/// The number of independent runs of each estimate.
pub const RUNS: usize = 16;

/// Tolerance for the mean of 16 runs in standard errors: exceeded by one mean in 900 (Student's t with 15
/// degrees of freedom).
pub const TOLERATED: f64 = 4.0;

/// The probability that a correct gradient gets the verdict [`Verdict::Differs`], at most.
pub const FALSE_ALARMS: f64 = 1.0 / 900.0;

/// The relative difference that a comparison must resolve to be decided.
pub const RESOLUTION: f64 = 0.1;

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

impl Verdict {
    /// The verdict. The largest step is not compared: it only bounds the error of the next one.
    pub(super) fn of(method: Estimate, slopes: &[Slope]) -> Self {
        let is_nothing = |e: Estimate| e.mean == 0.0 && e.error == 0.0;
        if is_nothing(method) && slopes.iter().all(|s| is_nothing(s.estimate)) {
            return Self::Nothing;
        }
        let compared = || slopes.iter().filter(|s| !s.bounds.is_empty());
        let tolerance = Tolerance::of(compared().count().max(1));
        let bounds = |s: &Slope| s.difference(method, tolerance, 1.0);
        // The method's distance from its bounds, in units of their half-width.
        let outside = |s: &Slope| {
            let [low, high] = bounds(s);
            let beyond = low.max(-high);
            if beyond > 0.0 { beyond / half_width([low, high]) } else { 0.0 }
        };
        let farthest = compared().max_by(|a, b| outside(a).total_cmp(&outside(b)));
        let sharpest = compared().min_by(|a, b| half_width(bounds(a)).total_cmp(&half_width(bounds(b))));
        let (Some(farthest), Some(sharpest)) = (farthest, sharpest) else {
            return Self::Open { within: f64::INFINITY, more: None };
        };
        if outside(farthest) > 0.0 {
            let slope = farthest.estimate.mean;
            return Self::Differs { step: farthest.step, by: ((method.mean - slope) / slope).abs() };
        }
        let within = half_width(bounds(sharpest)) / sharpest.estimate.mean.abs();
        if within <= RESOLUTION {
            return Self::Agrees { step: sharpest.step, within };
        }
        // With more samples another step may have the narrowest bounds.
        let more = compared().filter_map(|s| s.more(method, tolerance)).min_by(f64::total_cmp);
        Self::Open { within, more }
    }
}

#[cfg(test)]
mod tests;
