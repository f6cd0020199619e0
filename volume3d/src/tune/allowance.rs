//! The budget of a study: time or samples.

use std::cell::Cell;
use std::time::Instant;

use super::Limit;
use crate::gradient::Progress;

/// The limit, and what has been spent.
pub(super) struct Allowance<'a> {
    limit: Limit,
    start: Instant,
    progress: &'a Progress,
    /// Steps of progress that were reported.
    reported: Cell<usize>,
}

/// Steps of progress if the limit is a time.
const STEPS: usize = 1000;

impl<'a> Allowance<'a> {
    /// Starts the clock. `all`: the approximate number of samples per pixel over all runs, if time decides
    /// nothing.
    pub(super) fn new(limit: Limit, all: usize, progress: &'a Progress) -> Self {
        progress.start(match limit {
            Limit::Seconds(_) => STEPS,
            Limit::Samples(_) => all,
        });
        Self { limit, start: Instant::now(), progress, reported: Cell::new(0) }
    }

    /// The largest number of samples per pixel, if the limit is a number of samples.
    pub(super) fn samples(&self) -> Option<usize> {
        match self.limit {
            Limit::Seconds(_) => None,
            Limit::Samples(most) => Some(most),
        }
    }

    /// The limit on time in seconds; ∞ if the limit is a number of samples.
    pub(super) fn budget(&self) -> f64 {
        match self.limit {
            Limit::Seconds(seconds) => seconds,
            Limit::Samples(_) => f64::INFINITY,
        }
    }

    /// Whether a run may follow one with this number of samples, if it takes this many seconds.
    pub(super) fn allows(&self, samples: usize, seconds: f64) -> bool {
        match self.limit {
            Limit::Seconds(budget) => self.spent() + seconds <= budget,
            Limit::Samples(most) => samples < most,
        }
    }

    /// A number of samples, limited to the allowed one.
    pub(super) fn capped(&self, samples: usize) -> usize {
        self.samples().map_or(samples, |most| samples.min(most))
    }

    /// Reports progress after a run with this number of samples per pixel.
    pub(super) fn drew(&self, samples: usize) {
        let reached = match self.limit {
            Limit::Seconds(budget) => (STEPS as f64 * (self.spent() / budget).min(1.0)) as usize,
            Limit::Samples(_) => self.reported.get() + samples,
        };
        (self.reported.get()..reached).for_each(|_| self.progress.advance());
        self.reported.set(reached.max(self.reported.get()));
    }

    /// Progress of a run: cancellation only.
    pub(super) fn silent(&self) -> Progress {
        self.progress.silent()
    }

    /// Seconds since the start.
    pub(super) fn spent(&self) -> f64 {
        self.start.elapsed().as_secs_f64()
    }
}
