//! A study: a reference, then every setting up a ladder of sample numbers, within what is allowed.
//!
//! Sample numbers are 1, 4, 16, …, and seeds are those of a setting, a rung and a run: time decides how far each
//! setting climbs, which unbiased method is the reference and how many samples it has, and nothing else.

use std::time::Instant;

use flatland::random::stream;
use glam::DVec3;
use rand::Rng;
use volume3d::gradient::{Estimator, GradientError, OneSided, Tangent};
use volume3d::scene::Scene;

use super::allowance::Allowance;
use super::law::Rung;
use super::settings::{Setting, makeshift, references};
use super::statistics::Images;
use crate::session::silent;

/// Independent runs of each setting and rung, and of the reference.
pub(super) const RUNS: usize = 16;
/// Those of a trial, which chooses the reference.
const TRIAL_RUNS: usize = 4;
/// From rung to rung there are so many times as many samples.
const CLIMB: usize = 4;
/// The part of a budget that the reference may take, and the part that a trial takes at least.
const REFERENCE_SHARE: f64 = 0.3;
const TRIAL_SHARE: f64 = 0.02;
/// How many times the samples of all else the reference has, if these are given.
const REFERENCE_SAMPLES: usize = 4;
/// The part of the reference's samples with which a filter is tried, and the most of a budget that one may take.
const FILTER_PART: usize = 8;
const FILTER_SHARE: f64 = 0.05;

/// What tells seeds apart.
const TRIAL: u64 = 1;
const REFERENCE: u64 = 2;
const SETTING: u64 = 3;
const FILTER: u64 = 4;

/// What everything is judged by.
pub(super) struct Reference {
    pub(super) setting: Setting,
    pub(super) images: Images,
    /// Samples a pixel of a run.
    pub(super) samples: usize,
    /// Of all runs.
    pub(super) seconds: f64,
    /// Runs of which one sample carries so much that errors are not to be trusted.
    pub(super) heavy: usize,
    /// Step of finite differences at a bound of a parameter's range, and the reason why they are one-sided.
    pub(super) one_sided: Option<(f64, OneSided)>,
}

/// What became of a setting.
pub(super) enum Outcome {
    /// Measured at these sample numbers, from few to many.
    Measured(Vec<Rung>),
    /// The method does not take the scene.
    Refused(GradientError),
    /// Not even runs of one sample a pixel fitted into the budget.
    TooSlow,
}

/// A scene, and how it changes.
pub(super) struct Study<'a> {
    pub(super) scene: &'a Scene,
    pub(super) change: &'a Tangent,
    pub(super) seed: u64,
    pub(super) allowance: &'a Allowance,
}

/// Some runs with one number of samples.
#[derive(Default)]
struct Batch {
    images: Vec<Vec<DVec3>>,
    seconds: Vec<f64>,
    heavy: usize,
    non_finite: usize,
    one_sided: Option<(f64, OneSided)>,
}

/// What a trial of a method finds: what the better one has less of, and the seconds of one sample a pixel.
struct Trial {
    demerit: f64,
    each: f64,
}

/// How many samples a pixel are drawn in all if every setting has as many, for a bar to go by.
pub(super) fn all_samples(settings: usize, most: usize) -> usize {
    let rungs = std::iter::successors(Some(1), |n| (*n < most).then(|| most.min(CLIMB * n)));
    (REFERENCE_SAMPLES * most + settings * rungs.sum::<usize>()).saturating_mul(RUNS)
}

impl Study<'_> {
    /// The better of two unbiased methods, measured at length; where both are refused, finite differences of a small step.
    pub(super) fn reference(&self) -> anyhow::Result<Reference> {
        let mut best: Option<(Trial, Setting)> = None;
        for (i, setting) in references(self.change)?.into_iter().enumerate() {
            match self.trial(i as u64, &setting) {
                Ok(trial) if best.as_ref().is_none_or(|(other, _)| trial.demerit < other.demerit) => {
                    best = Some((trial, setting));
                }
                Err(GradientError::Stopped(stopped)) => return Err(stopped.into()),
                Ok(_) | Err(_) => {}
            }
        }
        let (trial, setting) = match best {
            Some(best) => best,
            None => {
                let setting = makeshift(self.scene, self.change)?;
                (self.trial(u64::MAX, &setting)?, setting)
            }
        };
        let fitting = REFERENCE_SHARE * self.allowance.budget() / (RUNS as f64 * trial.each);
        let samples = match self.allowance.samples() {
            Some(samples) => REFERENCE_SAMPLES.saturating_mul(samples),
            None => 1 << (fitting.max(1.0) as usize).ilog2(),
        };
        let start = Instant::now();
        let batch = self.batch(&setting, samples, 0..RUNS, &[REFERENCE])?;
        let Batch { images, heavy, one_sided, .. } = batch;
        let (images, seconds) = (Images::new(images), start.elapsed().as_secs_f64());
        Ok(Reference { setting, images, samples, seconds, heavy, one_sided })
    }

    /// Images of the reference's method on another scene, with a part of its samples and seeds of their own; nothing if they
    /// do not fit.
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
        let batch = study.batch(&reference.setting, samples, 0..RUNS, &[FILTER, number as u64])?;
        Ok(Some(Images::new(batch.images)))
    }

    fn trial(&self, number: u64, setting: &Setting) -> Result<Trial, GradientError> {
        let start = Instant::now();
        let mut samples = 1;
        loop {
            let address = [TRIAL, number, samples as u64];
            let batch = self.batch(setting, samples, 0..TRIAL_RUNS, &address)?;
            let each = median(batch.seconds) / samples as f64;
            let variance = Images::new(batch.images).variance().value * samples as f64;
            match self.allowance.samples() {
                // Without a look at the clock, so that it decides nothing.
                Some(most) if samples >= CLIMB.min(most) => return Ok(Trial { demerit: variance, each }),
                None if start.elapsed().as_secs_f64() > TRIAL_SHARE * self.allowance.budget() => {
                    return Ok(Trial { demerit: variance * each, each });
                }
                _ => samples *= CLIMB,
            }
        }
    }

    /// Every setting as far up as is allowed: always the one that has had least time, if its next rung fits.
    pub(super) fn climb(
        &self,
        settings: &[Setting],
        reference: &Reference,
    ) -> Result<Vec<Outcome>, GradientError> {
        let mut outcomes = vec![];
        for (i, setting) in settings.iter().enumerate() {
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
            match self.rung(i, &settings[i], samples, reference)? {
                Some(rung) => rungs.push(rung),
                None => full[i] = true,
            }
        }
        Ok(outcomes)
    }

    /// The setting that has had least time, among those whose next rung is allowed.
    fn next(&self, outcomes: &[Outcome], full: &[bool]) -> Option<usize> {
        let able = outcomes.iter().enumerate().filter(|(i, _)| !full[*i]).filter_map(|(i, outcome)| {
            let Outcome::Measured(rungs) = outcome else { return None };
            let (spent, last) = (rungs.iter().map(|r| r.seconds).sum::<f64>(), rungs.last()?);
            let foreseen = (CLIMB * RUNS) as f64 * last.seconds;
            self.allowance.allows(last.samples, foreseen).then_some((spent, i))
        });
        able.min_by(|a, b| a.0.total_cmp(&b.0)).map(|(_, i)| i)
    }

    /// All runs of a setting at one number of samples; nothing if the first shows that they will not fit into the budget.
    fn rung(
        &self,
        number: usize,
        setting: &Setting,
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
        setting: &Setting,
        samples: usize,
        runs: std::ops::Range<usize>,
        address: &[u64],
    ) -> Result<Batch, GradientError> {
        let mut batch = Batch::default();
        for run in runs {
            let start = Instant::now();
            let seed = stream(self.seed, &[address, &[run as u64]].concat()).next_u64();
            let estimator = setting.estimator(samples, seed);
            let result = estimator.forward(self.scene, self.change, &silent())?;
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

/// Of at least one number.
fn median(mut values: Vec<f64>) -> f64 {
    values.sort_by(f64::total_cmp);
    values[values.len() / 2]
}
