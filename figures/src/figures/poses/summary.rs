//! Summary of the descents of one method on one scene: success rate and final errors.

use super::racer::Racer;
use super::record::Row;
use super::stage::Stage;
use super::study::{Experiment, Job, Study};
use crate::figures::common::median;

/// A success rate: successes out of a number of descents.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) struct Rate {
    pub(super) successes: usize,
    pub(super) count: usize,
}

impl Rate {
    /// The rate.
    pub(super) fn value(self) -> f64 {
        self.successes as f64 / self.count as f64
    }

    /// The 95 % confidence interval of the true rate (Wilson 1927).
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

    /// The descents that succeed.
    pub(super) fn found(&self) -> impl Iterator<Item = &'a Row> + '_ {
        self.rows.iter().copied().filter(|row| row.distance().relative() <= 1.0)
    }

    pub(super) fn rate(&self) -> Rate {
        Rate { successes: self.found().count(), count: self.rows.len() }
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

    /// The median errors at the end among the successful; `None` if there are none.
    pub(super) fn converged(&self) -> Option<[f64; 2]> {
        let rows: Vec<&Row> = self.found().collect();
        (!rows.is_empty()).then(|| Self { rows, ..*self }.medians())
    }

    /// The median error along the way, in units of the success thresholds.
    pub(super) fn curve(&self) -> anyhow::Result<Vec<f64>> {
        let curves = self.rows.iter().map(|row| row.errors()).collect::<anyhow::Result<Vec<_>>>()?;
        let steps = curves.first().map_or(0, Vec::len);
        Ok((0..steps).map(|i| median(&curves.iter().map(|c| c[i]).collect::<Vec<_>>())).collect())
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
}
