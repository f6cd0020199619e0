//! Validation of a gradient: comparison with central finite differences at several steps.
//!
//! Both estimate one number, the weighted total of the gradient image. The weights, between −1 and 1, come
//! from a third, independent estimate of the gradient, so that parts of opposite sign do not cancel. Standard
//! errors are those of [`RUNS`] independent runs; they include noise that pixels share. All steps use the
//! same random numbers.
//!
//! ```no_run
//! # use volume3d::{check::Check, gradient::{Estimator, Progress, Tangent}, scene::Scene};
//! # fn f(scene: &Scene, change: &Tangent) -> Result<(), Box<dyn std::error::Error>> {
//! let found = Check::default().run(scene, change, &Estimator::auto(16, 0), &Progress::none())?;
//! println!("{:?}", found.verdict);
//! # Ok(())
//! # }
//! ```

mod comparison;
#[cfg(test)]
mod tests;

use flatland::random::stream;
use glam::DVec3;
use rand::Rng as _;

pub use comparison::{Estimate, FALSE_ALARMS, RESOLUTION, RUNS, Slope, TOLERATED, Verdict};

use crate::gradient::{
    Choice, Contribution, Estimator, FiniteDifference, GradientError, NonFinite, OneSided, Progress, Tangent,
    Unsupported,
};
use crate::scene::Scene;

/// The budget of a check.
#[derive(Clone, Debug, PartialEq)]
pub struct Check {
    /// Samples per pixel of each run of finite differences; at least 1.
    pub samples: usize,
    /// Steps of finite differences, in units of the change; if there are none,
    /// [`FiniteDifference::steps_after_a_larger`].
    pub steps: Vec<f64>,
    /// Seed of all random numbers.
    pub seed: u64,
}

impl Default for Check {
    /// 16 samples per pixel and run, default steps.
    fn default() -> Self {
        Self { samples: 16, steps: vec![], seed: 0 }
    }
}

/// A gradient beside finite differences.
#[derive(Clone, Debug)]
pub struct Checked {
    /// The weighted total by the method.
    pub method: Estimate,
    /// The weighted total by finite differences, from the largest step to the smallest.
    pub slopes: Vec<Slope>,
    /// Whether both agree.
    pub verdict: Verdict,
    /// The choice of a pilot, for [`Estimator::Auto`].
    pub choice: Option<Choice>,
    /// Samples that were not finite, over all runs.
    pub non_finite: Vec<NonFinite>,
    /// Discontinuities that the method was permitted to omit.
    pub left_out: Vec<Unsupported>,
    /// Steps at which finite differences are one-sided, with the reason.
    pub one_sided: Vec<(f64, OneSided)>,
}

/// Reason why a gradient cannot be checked.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum CheckError {
    /// Finite differences would be compared with themselves.
    #[error("finite differences are the reference of a check; choose another method")]
    Reference,
    /// A gradient cannot be computed.
    #[error(transparent)]
    Gradient(#[from] GradientError),
}

/// Samples per pixel of the weights, which may be noisy.
const WEIGHT_SAMPLES: usize = 16;

/// Keys of the random streams of the three estimates, and of the pilot that chooses the method.
const WEIGHTS: u64 = 1;
const METHOD: u64 = 2;
const DIFFERENCES: u64 = 3;
const CHOICE: u64 = 4;

impl Check {
    /// Compares a method, with its number of samples in each run, with finite differences. The seed of the
    /// method is replaced. Progress is reported in runs.
    ///
    /// # Errors
    /// [`CheckError`]: the method is finite differences, does not support the scene, or was cancelled; or a
    /// step is not positive.
    pub fn run(
        &self,
        scene: &Scene,
        change: &Tangent,
        method: &Estimator,
        progress: &Progress,
    ) -> Result<Checked, CheckError> {
        if matches!(method, Estimator::FiniteDifference(_)) {
            return Err(CheckError::Reference);
        }
        if !change.fits(scene) {
            return Err(GradientError::Tangent.into());
        }
        let mut steps = self.steps.clone();
        if steps.is_empty() {
            steps = FiniteDifference::steps_after_a_larger(scene, change);
        }
        steps.sort_by(|a, b| b.total_cmp(a));
        steps.dedup();
        progress.start((steps.len() + 1) * RUNS);
        let (silent, seed) = (progress.silent(), self.seed(CHOICE, 0));
        let (method, choice) =
            method.with_seed(seed).chosen(|pilot| pilot.for_change(scene, change, &silent))?;
        let weights = self.weights(scene, change, steps[0], &silent)?;
        let mut all = Estimates { scene, change, weights, progress, silent, non_finite: vec![] };

        let mut of_method = all.runs(|r| method.with_seed(self.seed(METHOD, r)))?;
        let left_out = std::mem::take(&mut of_method.left_out);
        let of_method = Estimate::of(&of_method.totals, of_method.largest() / RUNS as f64);
        let mut runs = vec![];
        for &step in &steps {
            let samples = self.samples;
            runs.push(all.runs(|r| {
                Estimator::FiniteDifference(FiniteDifference {
                    samples,
                    step,
                    seed: self.seed(DIFFERENCES, r),
                })
            })?);
        }
        let grains: Vec<f64> = (0..steps.len()).map(|i| grain(&steps, &runs, i)).collect();
        let brightest = runs.iter().map(|r| r.brightest).fold(0.0, f64::max);
        // The change of one sample is divided by the distance between the two sides and by the number of
        // samples.
        let apart = if runs[0].one_sided.is_some() { steps[0] } else { 2.0 * steps[0] };
        let unseen = brightest / (apart * (self.samples * RUNS) as f64);
        let one_sided =
            steps.iter().zip(&mut runs).filter_map(|(&step, r)| Some((step, r.one_sided.take()?)));
        let one_sided = one_sided.collect();
        let totals: Vec<Vec<f64>> = runs.into_iter().map(|r| r.totals).collect();
        let slopes = Slope::of(&steps, &totals, &grains, unseen);
        let verdict = Verdict::of(of_method, &slopes);
        let non_finite = all.non_finite;
        Ok(Checked { method: of_method, slopes, verdict, choice, non_finite, left_out, one_sided })
    }

    /// A rough gradient image divided by the root mean square of its channels that are not 0, and clamped to
    /// ±1.
    ///
    /// Where discontinuities move, the variance of differences is proportional to |gradient|, which varies
    /// over the image; the weights let all changing pixels count alike. No sample counts more than in the
    /// image itself.
    fn weights(
        &self,
        scene: &Scene,
        change: &Tangent,
        step: f64,
        progress: &Progress,
    ) -> Result<Vec<DVec3>, GradientError> {
        let method = FiniteDifference { samples: WEIGHT_SAMPLES, step, seed: self.seed(WEIGHTS, 0) };
        let image = method.forward(scene, change, progress)?.gradient;
        let channels = || image.pixels.iter().flat_map(DVec3::to_array).filter(|c| *c != 0.0);
        let (sum, count) = channels().fold((0.0, 0.0), |(sum, count), c| (sum + c * c, count + 1.0));
        if count == 0.0 {
            return Ok(vec![DVec3::ONE; image.pixels.len()]);
        }
        let range: f64 = f64::sqrt(sum / count);
        Ok(image.pixels.iter().map(|p| (*p / range).clamp(DVec3::NEG_ONE, DVec3::ONE)).collect())
    }

    /// The seed of a run.
    fn seed(&self, purpose: u64, run: usize) -> u64 {
        stream(self.seed, &[purpose, run as u64]).next_u64()
    }
}

/// The data that all estimates share.
struct Estimates<'a> {
    scene: &'a Scene,
    change: &'a Tangent,
    weights: Vec<DVec3>,
    progress: &'a Progress,
    silent: Progress,
    non_finite: Vec<NonFinite>,
}

/// The results of all runs of an estimate.
#[derive(Default)]
struct Runs {
    /// The weighted total of each run.
    totals: Vec<f64>,
    /// The sample of each run that contributes most to the gradient.
    largest: Vec<Option<Contribution>>,
    /// The largest sum of the channels' absolute values over pixels and runs.
    brightest: f64,
    /// The reason if finite differences are one-sided.
    one_sided: Option<OneSided>,
    /// Omitted discontinuities.
    left_out: Vec<Unsupported>,
}

impl Runs {
    /// The largest contribution of one sample.
    fn largest(&self) -> f64 {
        self.largest.iter().flatten().map(|sample| sample.amount).fold(0.0, f64::max)
    }
}

impl Estimates<'_> {
    fn runs(&mut self, estimator: impl Fn(usize) -> Estimator) -> Result<Runs, GradientError> {
        let mut runs = Runs::default();
        for r in 0..RUNS {
            let result = estimator(r).forward(self.scene, self.change, &self.silent)?;
            runs.totals.push(result.gradient.pixels.iter().zip(&self.weights).map(|(g, w)| g.dot(*w)).sum());
            runs.largest.push(result.largest);
            let brightness = result.image.pixels.iter().map(|p| p.abs().element_sum());
            runs.brightest = brightness.fold(runs.brightest, f64::max);
            self.non_finite.extend(result.non_finite);
            if r == 0 {
                runs.left_out = result.left_out;
                runs.one_sided = result.one_sided;
            }
            self.progress.advance();
        }
        Ok(runs)
    }
}

/// The most that one sample like the largest would contribute to the mean of all runs at a step. A
/// discontinuity that a larger step saw and this one did not would be divided by this step, so its
/// contribution is scaled by the ratio of steps. A smooth change is seen at both steps, as the same largest
/// sample, and is not scaled.
fn grain(steps: &[f64], runs: &[Runs], of: usize) -> f64 {
    let place = |sample: Contribution| (sample.column, sample.row, sample.sample);
    let of_run = |r: usize| {
        let own = runs[of].largest[r];
        let larger = (0..of).filter_map(|j| runs[j].largest[r].map(|sample| (steps[j] / steps[of], sample)));
        let missed = larger.filter(|(_, sample)| own.map(place) != Some(place(*sample)));
        let missed = missed.map(|(ratio, sample)| ratio * sample.amount);
        missed.fold(own.map_or(0.0, |sample| sample.amount), f64::max)
    };
    (0..RUNS).map(of_run).fold(0.0, f64::max) / RUNS as f64
}
