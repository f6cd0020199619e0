//! What the descents of one kind have in common: how many succeed, and where they end on average.

use glam::DVec3;

use super::protocol::SAMPLES;
use super::racer::Racer;
use super::record::Row;
use super::stage::Stage;
use super::study::{Experiment, Job, Study};
use crate::figures::common::median;
use crate::ratio::Ratio;

/// How many of so many descents succeeded.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) struct Rate {
    pub(super) successes: usize,
    pub(super) count: usize,
}

impl Rate {
    /// The part.
    pub(super) fn value(self) -> f64 {
        self.successes as f64 / self.count as f64
    }

    /// The interval that holds the true part with 95 % confidence (Wilson 1927).
    pub(super) fn interval(self) -> [f64; 2] {
        const Z: f64 = 1.96;
        let (p, n) = (self.value(), self.count as f64);
        let middle = p + Z * Z / (2.0 * n);
        let half = Z * (p * (1.0 - p) / n + Z * Z / (4.0 * n * n)).sqrt();
        [-half, half].map(|half| ((middle + half) / (1.0 + Z * Z / n)).clamp(0.0, 1.0))
    }

    /// "53 of 85".
    pub(super) fn shown(self) -> String {
        format!("{} of {}", self.successes, self.count)
    }
}

/// One method on one scene, from all starts.
pub(super) struct Race<'a> {
    pub(super) stage: Stage,
    pub(super) racer: Racer,
    pub(super) samples: usize,
    pub(super) rows: Vec<&'a Row>,
}

impl<'a> Race<'a> {
    pub(super) fn new(study: &'a Study, stage: Stage, racer: Racer, samples: usize) -> Self {
        let job = Job { experiment: Experiment::Away, stage, racer, samples, start: 0 };
        Self { stage, racer, samples, rows: study.descents(&job) }
    }

    pub(super) fn rate(&self) -> Rate {
        let successes = self.rows.iter().filter(|row| row.distance().relative() <= 1.0).count();
        Rate { successes, count: self.rows.len() }
    }

    /// Processor seconds of one step.
    pub(super) fn seconds(&self) -> f64 {
        self.rows.iter().map(|row| row.seconds).sum::<f64>() / self.rows.len() as f64
    }

    /// The median errors at the end: in extents, and in degrees.
    pub(super) fn medians(&self) -> [f64; 2] {
        let of = |error: fn(&Row) -> f64| median(&self.rows.iter().map(|row| error(row)).collect::<Vec<_>>());
        [of(|row| row.translation_error), of(|row| row.rotation_error)]
    }

    /// The same among the successful; nothing if there are none.
    pub(super) fn converged(&self) -> Option<[f64; 2]> {
        let rows: Vec<&Row> =
            self.rows.iter().copied().filter(|row| row.distance().relative() <= 1.0).collect();
        (!rows.is_empty()).then(|| Self { rows, ..*self }.medians())
    }

    /// The median error along the way, in units of success.
    pub(super) fn curve(&self) -> anyhow::Result<Vec<f64>> {
        let curves = self.rows.iter().map(|row| row.errors()).collect::<anyhow::Result<Vec<_>>>()?;
        let steps = curves.first().map_or(0, Vec::len);
        Ok((0..steps).map(|i| median(&curves.iter().map(|c| c[i]).collect::<Vec<_>>())).collect())
    }
}

/// Where descents from one place end: a mean of independent runs.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Drift {
    pub(super) racer: Racer,
    pub(super) samples: usize,
    pub(super) count: usize,
    /// The length of the mean translation, in extents.
    pub(super) shift: Offset,
    /// The length of the mean rotation vector, in degrees.
    pub(super) turn: Offset,
}

/// The length of a mean vector.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Offset {
    /// With its standard error along the mean.
    pub(super) length: Ratio,
    /// What the length would be by chance if the true mean were 0: the root of the sum of the squared standard errors.
    pub(super) chance: f64,
    /// The root mean square of the vectors of single runs.
    pub(super) single: f64,
}

impl Offset {
    /// Of vectors that independent runs found.
    pub(super) fn of(vectors: &[DVec3]) -> Self {
        let along = |axis: usize| Ratio::of_runs(&vectors.iter().map(|v| v[axis]).collect::<Vec<_>>());
        let axes = [0, 1, 2].map(along);
        let mean = DVec3::from_array(axes.map(|a| a.value));
        let error = DVec3::from_array(axes.map(|a| a.error));
        let single = vectors.iter().map(|v| v.length_squared()).sum::<f64>() / vectors.len() as f64;
        Self {
            length: Ratio { value: mean.length(), error: (mean.normalize_or_zero() * error).length() },
            chance: error.length(),
            single: single.sqrt(),
        }
    }

    /// Whether it is more than chance explains: with a dozen runs, one mean of 0 in a thousand is.
    pub(super) fn is_sure(&self) -> bool {
        self.length.value > 3.0 * self.chance
    }
}

impl Drift {
    pub(super) fn new(study: &Study, job: &Job) -> anyhow::Result<Self> {
        let rows = study.descents(job);
        let poses = rows.iter().map(|row| row.pose()).collect::<anyhow::Result<Vec<_>>>()?;
        let part = |at: usize, scale: f64| -> Vec<DVec3> {
            poses.iter().map(|x| scale * DVec3::from_slice(&x[at..at + 3])).collect()
        };
        Ok(Self {
            racer: job.racer,
            samples: job.samples,
            count: rows.len(),
            shift: Offset::of(&part(0, 1.0 / job.stage.extent())),
            turn: Offset::of(&part(3, 1f64.to_degrees())),
        })
    }

    /// Of the bunny from where it is.
    pub(super) fn from_truth(study: &Study) -> anyhow::Result<Vec<Self>> {
        let samples = [SAMPLES, 4 * SAMPLES];
        let jobs = Racer::DRIFTING.into_iter().flat_map(|racer| samples.map(|samples| (racer, samples)));
        jobs.map(|(racer, samples)| {
            let (experiment, stage) = (Experiment::Truth, Stage::Bunny);
            Self::new(study, &Job { experiment, stage, racer, samples, start: 0 })
        })
        .collect()
    }

    /// To a target that cannot be reached.
    pub(super) fn unreachable(study: &Study, stage: Stage) -> anyhow::Result<Vec<Self>> {
        let experiment = Experiment::Unreachable;
        let job = |racer| Job { experiment, stage, racer, samples: SAMPLES, start: 0 };
        Racer::ALL.into_iter().map(|racer| Self::new(study, &job(racer))).collect()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn intervals_are_wilsons() {
        // Newcombe (1998), table I: 81 of 263, and 0 of 20.
        let close = |rate: Rate, ends: [f64; 2]| {
            let off = rate.interval().iter().zip(ends).map(|(a, b)| (a - b).abs()).fold(0.0, f64::max);
            assert!(off < 5e-5, "{:?}", rate.interval());
        };
        close(Rate { successes: 81, count: 263 }, [0.2553, 0.3662]);
        close(Rate { successes: 0, count: 20 }, [0.0, 0.1611]);
    }

    #[test]
    fn means_of_vectors_have_lengths_and_errors() {
        let offset = Offset::of(&[DVec3::new(2.0, 1.0, 0.0), DVec3::new(4.0, -1.0, 0.0)]);
        assert_eq!(offset.length, Ratio { value: 3.0, error: 1.0 });
        assert!((offset.chance - 2f64.sqrt()).abs() < 1e-15 && (offset.single - 11f64.sqrt()).abs() < 1e-15);
        assert!(!offset.is_sure());
    }
}
