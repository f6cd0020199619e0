//! The budget of a study: time or samples.

use std::time::Instant;

use crate::session::Bar;

/// The limit.
#[derive(Clone, Copy, Debug)]
pub(super) enum Limit {
    /// Wall time of the whole study in seconds.
    Seconds(f64),
    /// Largest number of samples per pixel of a run, regardless of time; and the approximate sum over all
    /// runs, for the progress bar.
    Samples { most: usize, all: usize },
}

/// The limit, and what has been spent.
pub(super) struct Allowance {
    limit: Limit,
    start: Instant,
    bar: Bar,
}

/// Steps of the progress bar if the limit is a time.
const STEPS: usize = 1000;

impl Allowance {
    pub(super) fn new(limit: Limit) -> Self {
        let steps = match limit {
            Limit::Seconds(_) => STEPS,
            Limit::Samples { all, .. } => all,
        };
        Self { limit, start: Instant::now(), bar: Bar::new(steps, "tune") }
    }

    /// The largest number of samples per pixel, if the limit is a number of samples.
    pub(super) fn samples(&self) -> Option<usize> {
        match self.limit {
            Limit::Seconds(_) => None,
            Limit::Samples { most, .. } => Some(most),
        }
    }

    /// The limit on time in seconds; ∞ if the limit is a number of samples.
    pub(super) fn budget(&self) -> f64 {
        match self.limit {
            Limit::Seconds(seconds) => seconds,
            Limit::Samples { .. } => f64::INFINITY,
        }
    }

    /// Whether a run may follow one with this number of samples, if it takes this many seconds.
    pub(super) fn allows(&self, samples: usize, seconds: f64) -> bool {
        match self.limit {
            Limit::Seconds(budget) => self.spent() + seconds <= budget,
            Limit::Samples { most, .. } => samples < most,
        }
    }

    /// A number of samples, limited to the allowed one.
    pub(super) fn capped(&self, samples: usize) -> usize {
        self.samples().map_or(samples, |most| samples.min(most))
    }

    /// Advances the progress bar after a run with this number of samples per pixel.
    pub(super) fn drew(&self, samples: usize) {
        match self.limit {
            Limit::Seconds(budget) => {
                self.bar.reach((STEPS as f64 * (self.spent() / budget).min(1.0)) as usize);
            }
            Limit::Samples { .. } => self.bar.advance(samples),
        }
    }

    /// Seconds since the start.
    pub(super) fn spent(&self) -> f64 {
        self.start.elapsed().as_secs_f64()
    }
}
