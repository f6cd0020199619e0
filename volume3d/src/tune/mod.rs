//! Bias, noise and time of every method on a scene, and the best setting for a time or an error.
//!
//! Each setting is run [`RUNS`] times along a change, with different seeds, with 1, 4, 16, … samples per
//! pixel. The results are compared with a reference: the better of two unbiased methods, from independent
//! samples. Biases are estimated without the noise of the runs and of the reference.
//!
//! The error of a gradient image is the root mean square, over pixels and channels, of its difference from
//! the true gradient, divided by the root mean square of the true gradient.
//!
//! ```no_run
//! # use volume3d::{gradient::{Progress, Tangent}, scene::Scene, tune::{Limit, Setting, Target, Tune}};
//! # fn f(scene: &Scene, change: &Tangent) -> Result<(), Box<dyn std::error::Error>> {
//! let tune = Tune { limit: Limit::Seconds(60.0), seed: 0 };
//! let tuning = tune.run(scene, change, &Setting::all(scene, change), &Progress::none())?;
//! if let Some((best, expected)) = tuning.best(Target::Error(0.05)) {
//!     println!("{} with {} samples per pixel", best.setting, expected.samples);
//! }
//! # Ok(())
//! # }
//! ```

mod allowance;
mod filters;
mod law;
mod setting;
mod statistics;
mod study;

use allowance::Allowance;
pub use filters::FilterNoise;
pub use law::{Bias, Expected, Law, MAX_SAMPLES, Rung};
pub use setting::Setting;
pub use statistics::{Images, Measure, Statistics};
pub use study::{Outcome, RUNS, Reference};
use study::{Study, all_samples};

use crate::check::TOLERATED;
use crate::gradient::Progress;
use crate::gradient::{GradientError, Tangent};
use crate::scene::{Scene, SceneError};

/// The budget of a study.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Limit {
    /// Wall time in seconds, 30 % of it for the reference. The first run of each setting may exceed it.
    Seconds(f64),
    /// The largest number of samples per pixel of a setting, regardless of time; the reference has four times
    /// as many. All numbers except times then have the same bits for the same seed.
    Samples(usize),
}

/// A study of settings.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Tune {
    /// The budget.
    pub limit: Limit,
    /// Seed of all random numbers.
    pub seed: u64,
}

impl Default for Tune {
    /// A minute.
    fn default() -> Self {
        Self { limit: Limit::Seconds(60.0), seed: 0 }
    }
}

/// The results of a study.
#[derive(Clone, Debug)]
pub struct Tuning {
    /// The reference.
    pub reference: Reference,
    /// The settings, in the order given.
    pub settings: Vec<Tuned>,
    /// The noise under other pixel filters.
    pub filters: Vec<FilterNoise>,
    /// Duration of the study.
    pub seconds: f64,
}

/// A setting with its results.
#[derive(Clone, Debug)]
pub struct Tuned {
    /// The setting.
    pub setting: Setting,
    /// Whether it is proved to be unbiased for the change.
    pub unbiased: bool,
    /// The measurements.
    pub outcome: Outcome,
}

/// The target of an advice.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Target {
    /// The smallest error within a time in seconds.
    Seconds(f64),
    /// The shortest time to an error.
    Error(f64),
}

/// Reason why settings cannot be compared.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum TuneError {
    /// The budget is not positive.
    #[error("the budget must be positive and finite, not {0}")]
    Budget(f64),
    /// The gradient is exactly 0.
    #[error("the gradient is exactly 0 at every pixel; neither what moves nor its shadow is visible")]
    Nothing,
    /// The noise of the reference is too large.
    #[error(
        "the noise of the reference ({setting}, {samples} spp) hides the gradient, so nothing can be compared with it; \
         allow a larger budget"
    )]
    Noise {
        /// Setting of the reference.
        setting: Setting,
        /// Its samples per pixel.
        samples: usize,
    },
    /// The budget was too small for every setting.
    #[error("nothing was measured; a budget of {seconds:.0} seconds or so is enough")]
    Budgeted {
        /// Sufficient budget in seconds.
        seconds: f64,
    },
    /// A gradient cannot be computed.
    #[error(transparent)]
    Gradient(#[from] GradientError),
    /// The scene is invalid with another pixel filter.
    #[error(transparent)]
    Scene(#[from] SceneError),
}

impl Tune {
    /// Measures settings along a change.
    ///
    /// # Errors
    /// [`TuneError`]: the gradient is 0 or hidden by noise, the budget is too small, or the study was
    /// cancelled. Settings that refuse the scene are no error.
    pub fn run(
        &self,
        scene: &Scene,
        change: &Tangent,
        settings: &[Setting],
        progress: &Progress,
    ) -> Result<Tuning, TuneError> {
        let all = match self.limit {
            Limit::Seconds(seconds) if !(seconds > 0.0 && seconds.is_finite()) => {
                return Err(TuneError::Budget(seconds));
            }
            Limit::Samples(0) => return Err(TuneError::Budget(0.0)),
            Limit::Seconds(_) => 0,
            Limit::Samples(most) => all_samples(settings.len(), most),
        };
        if !change.fits(scene) {
            return Err(GradientError::Tangent.into());
        }
        let allowance = Allowance::new(self.limit, all, progress);
        let study = Study { scene, change, seed: self.seed, allowance: &allowance };
        let reference = study.reference()?;
        check_usable(&reference)?;
        let filters = filters::compared(&study, &reference)?;
        let outcomes = study.climb(settings, &reference)?;
        if !outcomes.iter().any(|outcome| matches!(outcome, Outcome::Measured(_))) {
            let needed = (2 * settings.len()) as f64 * reference.seconds / reference.samples as f64;
            return Err(TuneError::Budgeted { seconds: needed.max(1.0) });
        }
        let tuned = |(&setting, outcome): (&Setting, Outcome)| Tuned {
            setting,
            unbiased: setting.is_unbiased(change),
            outcome,
        };
        let settings = settings.iter().zip(outcomes).map(tuned).collect();
        Ok(Tuning { reference, settings, filters, seconds: allowance.spent() })
    }
}

/// Refuses a reference that is 0 or hidden by its noise.
fn check_usable(reference: &Reference) -> Result<(), TuneError> {
    if reference.images.are_zero() {
        return Err(TuneError::Nothing);
    }
    let Measure { value, error } = reference.images.power();
    if value > TOLERATED * error {
        return Ok(());
    }
    Err(TuneError::Noise { setting: reference.setting, samples: reference.samples })
}

impl Tuned {
    /// The measurements at each number of samples, in increasing order; none if the setting was not measured.
    #[must_use]
    pub fn rungs(&self) -> &[Rung] {
        match &self.outcome {
            Outcome::Measured(rungs) => rungs,
            Outcome::Refused(_) | Outcome::TooSlow => &[],
        }
    }

    /// Error and time as functions of the number of samples, if the setting was measured.
    #[must_use]
    pub fn law(&self) -> Option<Law> {
        Law::of(self.rungs(), self.unbiased)
    }

    /// Whether single samples carry so much that the numbers are unreliable.
    #[must_use]
    pub fn is_heavy(&self) -> bool {
        self.rungs().last().is_some_and(|rung| rung.heavy > 0)
    }
}

impl Tuning {
    /// The best setting for a target, with its expected error and time; nothing if no setting reaches it.
    #[must_use]
    pub fn best(&self, target: Target) -> Option<(&Tuned, Expected)> {
        let able = self.settings.iter().filter_map(|tuned| {
            let law = tuned.law()?;
            let expected = match target {
                Target::Seconds(seconds) => law.within(seconds),
                Target::Error(error) => law.reaching(error),
            };
            expected.map(|e| (tuned, e))
        });
        let cost = |e: &Expected| match target {
            Target::Seconds(_) => e.error.value,
            Target::Error(_) => e.seconds,
        };
        able.min_by(|a, b| cost(&a.1).total_cmp(&cost(&b.1)))
    }
}
