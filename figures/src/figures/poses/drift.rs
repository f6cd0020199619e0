//! Mean end points of descents that begin at the true pose.

use glam::DVec3;

use super::protocol::SAMPLES;
use super::racer::Racer;
use super::stage::Stage;
use super::study::{Experiment, Job, Study};
use crate::ratio::Ratio;

/// Mean end point of one method's descents over independent runs.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Drift {
    pub(super) racer: Racer,
    pub(super) samples: usize,
    pub(super) count: usize,
    /// The translation, in extents.
    pub(super) shift: Offset,
    /// The rotation vector, in degrees.
    pub(super) turn: Offset,
}

/// A mean vector.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Offset {
    mean: DVec3,
    /// Standard errors, axis by axis.
    error: DVec3,
    /// The root mean square of the vectors of single runs.
    pub(super) single: f64,
}

impl Offset {
    /// The mean of vectors of independent runs.
    pub(super) fn of(vectors: &[DVec3]) -> Self {
        let along = |axis: usize| Ratio::of_runs(&vectors.iter().map(|v| v[axis]).collect::<Vec<_>>());
        let axes = [0, 1, 2].map(along);
        let single = vectors.iter().map(|v| v.length_squared()).sum::<f64>() / vectors.len() as f64;
        Self {
            mean: DVec3::from_array(axes.map(|a| a.value)),
            error: DVec3::from_array(axes.map(|a| a.error)),
            single: single.sqrt(),
        }
    }

    /// The difference from another mean, of other runs.
    pub(super) fn less(&self, other: &Self) -> Self {
        let error = DVec3::from_array([0, 1, 2].map(|i| self.error[i].hypot(other.error[i])));
        Self { mean: self.mean - other.mean, error, ..*self }
    }

    /// The length of the mean, with its standard error along it.
    pub(super) fn length(&self) -> Ratio {
        let along = self.mean.normalize_or_zero();
        Ratio { value: self.mean.length(), error: (along * self.error).length() }
    }

    /// The length expected by chance if the true mean were 0: the root of the sum of the squared standard
    /// errors.
    pub(super) fn chance(&self) -> f64 {
        self.error.length()
    }

    /// Whether the length is more than chance explains. With a dozen runs at most one true mean of 0 in
    /// eighty is, which occurs if all errors lie along one axis (Student's t with 11 degrees of freedom).
    pub(super) fn is_sure(&self) -> bool {
        self.mean.length() > 3.0 * self.chance()
    }
}

impl Drift {
    fn new(study: &Study, job: &Job) -> anyhow::Result<Self> {
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

    /// The drift of the bunny before its own picture.
    pub(super) fn from_truth(study: &Study) -> anyhow::Result<Vec<Self>> {
        let samples = [SAMPLES, 4 * SAMPLES];
        let jobs = Racer::DRIFTING.into_iter().flat_map(|racer| samples.map(|samples| (racer, samples)));
        jobs.map(|(racer, samples)| {
            let (experiment, stage) = (Experiment::Truth, Stage::Bunny);
            Self::new(study, &Job { experiment, stage, racer, samples, start: 0 })
        })
        .collect()
    }

    /// The drift before a target that cannot be reached.
    pub(super) fn unreachable(study: &Study, stage: Stage) -> anyhow::Result<Vec<Self>> {
        let experiment = Experiment::Unreachable;
        let job = |racer| Job { experiment, stage, racer, samples: SAMPLES, start: 0 };
        Racer::ALL.into_iter().map(|racer| Self::new(study, &job(racer))).collect()
    }

    /// Translation and rotation relative to those of edge sampling among others on the same target.
    pub(super) fn beyond(&self, others: &[Self]) -> Option<[Offset; 2]> {
        let edges = others.iter().find(|other| other.racer == Racer::EdgeSampling)?;
        Some([self.shift.less(&edges.shift), self.turn.less(&edges.turn)])
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn means_of_vectors_have_lengths_and_errors() {
        let offset = Offset::of(&[DVec3::new(2.0, 1.0, 0.0), DVec3::new(4.0, -1.0, 0.0)]);
        assert_eq!(offset.length(), Ratio { value: 3.0, error: 1.0 });
        assert!(
            (offset.chance() - 2f64.sqrt()).abs() < 1e-15 && (offset.single - 11f64.sqrt()).abs() < 1e-15
        );
        assert!(!offset.is_sure());
        let none = offset.less(&offset);
        assert_eq!((none.length().value, none.chance()), (0.0, 2.0));
        let sure = Offset::of(&[DVec3::new(3.1, 0.0, 0.0), DVec3::new(5.1, 0.0, 0.0)]);
        assert!(sure.is_sure() && !sure.less(&offset).is_sure());
    }
}
