//! A study: a reference, then all settings with increasing numbers of samples, within a budget.
//!
//! Sample numbers are 1, 4, 16, …; seeds depend on the setting, the rung and the run. Time decides only how
//! far each setting climbs, which unbiased method is the reference, and its number of samples.

use std::time::Instant;

use flatland::random::stream;
use glam::DVec3;
use rand::Rng;

use super::allowance::Allowance;
use super::law::Rung;
use super::setting::Setting;
use super::statistics::Images;
use crate::gradient::{Estimator, GradientError, OneSided, Tangent};
use crate::scene::Scene;

/// Independent runs of each setting and rung, and of the reference.
pub const RUNS: usize = 16;
/// Runs of a trial, which chooses the reference.
const TRIAL_RUNS: usize = 4;
/// Ratio of samples from rung to rung.
const CLIMB: usize = 4;
/// The part of the budget for the reference, and the smallest part for a trial.
const REFERENCE_SHARE: f64 = 0.3;
const TRIAL_SHARE: f64 = 0.02;
/// Without a time limit: ratio of the reference's samples to those of settings.
const REFERENCE_SAMPLES: usize = 4;
/// Ratio of the reference's samples to those of a trial of a filter, and the largest part of the budget for
/// one filter.
const FILTER_PART: usize = 8;
const FILTER_SHARE: f64 = 0.05;

/// Keys of random streams.
const TRIAL: u64 = 1;
const REFERENCE: u64 = 2;
const SETTING: u64 = 3;
const FILTER: u64 = 4;

/// The reference.
#[derive(Clone, Debug)]
pub struct Reference {
    /// Its setting.
    pub setting: Setting,
    /// Whether it is proved to be unbiased.
    pub unbiased: bool,
    /// The gradient images of all runs.
    pub images: Images,
    /// Samples per pixel of a run.
    pub samples: usize,
    /// The time of all runs.
    pub seconds: f64,
    /// The number of runs in which one sample carries so much that errors are unreliable.
    pub heavy: usize,
    /// Step of finite differences at a bound of a parameter's range, and the reason why they are one-sided.
    pub one_sided: Option<(f64, OneSided)>,
}

/// The result for a setting.
#[derive(Clone, Debug)]
pub enum Outcome {
    /// Measured at these numbers of samples, in increasing order.
    Measured(Vec<Rung>),
    /// The method refuses the scene.
    Refused(GradientError),
    /// Runs with one sample per pixel exceed the budget.
    TooSlow,
}

/// A scene and its change, with seed and budget.
pub(super) struct Study<'a> {
    pub(super) scene: &'a Scene,
    pub(super) change: &'a Tangent,
    pub(super) seed: u64,
    pub(super) allowance: &'a Allowance<'a>,
}

/// Runs with the same number of samples.
#[derive(Default)]
struct Batch {
    images: Vec<Vec<DVec3>>,
    seconds: Vec<f64>,
    heavy: usize,
    non_finite: usize,
    one_sided: Option<(f64, OneSided)>,
}

/// The result of a trial: the figure of merit (the smaller, the better), and the seconds per sample per
/// pixel.
struct Trial {
    demerit: f64,
    each: f64,
}

/// The number of samples per pixel over all runs if every setting climbs to the largest number; for the
/// progress bar.
pub(super) fn all_samples(settings: usize, most: usize) -> usize {
    let rungs = std::iter::successors(Some(1), |n| (*n < most).then(|| most.min(CLIMB * n)));
    (REFERENCE_SAMPLES * most + settings * rungs.sum::<usize>()).saturating_mul(RUNS)
}

impl Study<'_> {
    /// Measures the reference: the better of two unbiased methods; if both refuse, finite differences with a
    /// small step.
    pub(super) fn reference(&self) -> Result<Reference, GradientError> {
        let mut best: Option<(Trial, Setting)> = None;
        for (i, &setting) in Setting::references(self.change).iter().enumerate() {
            match self.trial(i as u64, setting) {
                Ok(trial) if best.as_ref().is_none_or(|(other, _)| trial.demerit < other.demerit) => {
                    best = Some((trial, setting));
                }
                Err(stopped @ GradientError::Stopped(_)) => return Err(stopped),
                Ok(_) | Err(_) => {}
            }
        }
        let (trial, setting) = match best {
            Some(best) => best,
            None => {
                let setting = Setting::makeshift(self.scene, self.change);
                (self.trial(u64::MAX, setting)?, setting)
            }
        };
        let fitting = REFERENCE_SHARE * self.allowance.budget() / (RUNS as f64 * trial.each);
        let samples = match self.allowance.samples() {
            Some(samples) => REFERENCE_SAMPLES.saturating_mul(samples),
            None => 1 << (fitting.max(1.0) as usize).ilog2(),
        };
        let start = Instant::now();
        let batch = self.batch(setting, samples, 0..RUNS, &[REFERENCE])?;
        let Batch { images, heavy, one_sided, .. } = batch;
        let (images, seconds) = (Images::new(images), start.elapsed().as_secs_f64());
        let unbiased = setting.is_unbiased(self.change);
        Ok(Reference { setting, unbiased, images, samples, seconds, heavy, one_sided })
    }

    /// Images of the reference's method on another scene, with a part of its samples and other seeds; nothing
    /// if they exceed the budget.
    pub(super) fn elsewhere(
        &self,
        scene: &Scene,
        number: usize,
        reference: &Reference,
    ) -> Result<Option<Images>, GradientError> {
        let samples = (reference.samples / FILTER_PART).max(1);
        let foreseen = reference.seconds * samples as f64 / reference.samples as f64;
        if foreseen > FILTER_SHARE * self.allowance.budget() {
            return Ok(None);
        }
        let study = Study { scene, ..*self };
        let batch = study.batch(reference.setting, samples, 0..RUNS, &[FILTER, number as u64])?;
        Ok(Some(Images::new(batch.images)))
    }

    fn trial(&self, number: u64, setting: Setting) -> Result<Trial, GradientError> {
        let start = Instant::now();
        let mut samples = 1;
        loop {
            let address = [TRIAL, number, samples as u64];
            let batch = self.batch(setting, samples, 0..TRIAL_RUNS, &address)?;
            let each = median(batch.seconds) / samples as f64;
            let variance = Images::new(batch.images).variance().value * samples as f64;
            match self.allowance.samples() {
                // Does not use the time, so that it decides nothing.
                Some(most) if samples >= CLIMB.min(most) => return Ok(Trial { demerit: variance, each }),
                None if start.elapsed().as_secs_f64() > TRIAL_SHARE * self.allowance.budget() => {
                    return Ok(Trial { demerit: variance * each, each });
                }
                _ => samples *= CLIMB,
            }
        }
    }

    /// Measures all settings as far as the budget allows. The next rung is always that of the setting with
    /// the least time so far, if it fits.
    pub(super) fn climb(
        &self,
        settings: &[Setting],
        reference: &Reference,
    ) -> Result<Vec<Outcome>, GradientError> {
        let mut outcomes = vec![];
        for (i, &setting) in settings.iter().enumerate() {
            if !self.allowance.allows(0, 0.0) {
                outcomes.push(Outcome::TooSlow);
                continue;
            }
            outcomes.push(match self.rung(i, setting, 1, reference) {
                Ok(Some(rung)) => Outcome::Measured(vec![rung]),
                Ok(None) => Outcome::TooSlow,
                Err(stopped @ GradientError::Stopped(_)) => return Err(stopped),
                Err(refusal) => Outcome::Refused(refusal),
            });
        }
        let mut full = vec![false; settings.len()];
        while let Some(i) = self.next(&outcomes, &full) {
            let Outcome::Measured(rungs) = &mut outcomes[i] else { break };
            let samples = self.allowance.capped(CLIMB * rungs.last().map_or(1, |r| r.samples));
            match self.rung(i, settings[i], samples, reference)? {
                Some(rung) => rungs.push(rung),
                None => full[i] = true,
            }
        }
        Ok(outcomes)
    }

    /// The setting with the least time so far, among those whose next rung is allowed.
    fn next(&self, outcomes: &[Outcome], full: &[bool]) -> Option<usize> {
        let able = outcomes.iter().enumerate().filter(|(i, _)| !full[*i]).filter_map(|(i, outcome)| {
            let Outcome::Measured(rungs) = outcome else { return None };
            let (spent, last) = (rungs.iter().map(|r| r.seconds).sum::<f64>(), rungs.last()?);
            let foreseen = (CLIMB * RUNS) as f64 * last.seconds;
            self.allowance.allows(last.samples, foreseen).then_some((spent, i))
        });
        able.min_by(|a, b| a.0.total_cmp(&b.0)).map(|(_, i)| i)
    }

    /// All runs of a setting with one number of samples; nothing if the first run shows that they exceed the
    /// budget.
    fn rung(
        &self,
        number: usize,
        setting: Setting,
        samples: usize,
        reference: &Reference,
    ) -> Result<Option<Rung>, GradientError> {
        let address = [SETTING, number as u64, samples as u64];
        let mut batch = self.batch(setting, samples, 0..1, &address)?;
        if !self.allowance.allows(samples - 1, (RUNS - 1) as f64 * batch.seconds[0]) {
            return Ok(None);
        }
        batch.absorb(self.batch(setting, samples, 1..RUNS, &address)?);
        let Batch { images, seconds, heavy, non_finite, one_sided } = batch;
        let statistics = Images::new(images).beside(&reference.images);
        Ok(Some(Rung { samples, seconds: median(seconds), statistics, heavy, non_finite, one_sided }))
    }

    fn batch(
        &self,
        setting: Setting,
        samples: usize,
        runs: std::ops::Range<usize>,
        address: &[u64],
    ) -> Result<Batch, GradientError> {
        let mut batch = Batch::default();
        for run in runs {
            let start = Instant::now();
            let seed = stream(self.seed, &[address, &[run as u64]].concat()).next_u64();
            let estimator = setting.estimator(samples, seed);
            let result = estimator.forward(self.scene, self.change, &self.allowance.silent())?;
            batch.seconds.push(start.elapsed().as_secs_f64());
            batch.heavy += usize::from(result.outlier().is_some());
            batch.non_finite += result.non_finite.len();
            if let (Estimator::FiniteDifference(method), Some(found)) = (&estimator, result.one_sided) {
                batch.one_sided = Some((method.step, found));
            }
            batch.images.push(result.gradient.pixels);
            self.allowance.drew(samples);
        }
        Ok(batch)
    }
}

impl Batch {
    fn absorb(&mut self, more: Self) {
        self.images.extend(more.images);
        self.seconds.extend(more.seconds);
        self.heavy += more.heavy;
        self.non_finite += more.non_finite;
    }
}

/// The median of at least one number; the larger of the two middle ones if their number is even.
fn median(mut values: Vec<f64>) -> f64 {
    values.sort_by(f64::total_cmp);
    values[values.len() / 2]
}
