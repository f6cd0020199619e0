//! What a study may spend: time, or samples.

use std::time::Instant;

use crate::session::Bar;

/// How much.
#[derive(Clone, Copy, Debug)]
pub(super) enum Limit {
    /// Seconds of wall time in all.
    Seconds(f64),
    /// Samples a pixel of every run, whatever the time; and of all runs together, more or less.
    Samples { most: usize, all: usize },
}

/// What may be spent, and what has been.
pub(super) struct Allowance {
    limit: Limit,
    start: Instant,
    bar: Bar,
}

/// Steps of the bar for a time.
const STEPS: usize = 1000;

impl Allowance {
    pub(super) fn new(limit: Limit) -> Self {
        let steps = match limit {
            Limit::Seconds(_) => STEPS,
            Limit::Samples { all, .. } => all,
        };
        Self { limit, start: Instant::now(), bar: Bar::new(steps, "tune") }
    }

    /// The samples a pixel, if they are what is given.
    pub(super) fn samples(&self) -> Option<usize> {
        match self.limit {
            Limit::Seconds(_) => None,
            Limit::Samples { most, .. } => Some(most),
        }
    }

    /// Seconds in all.
    pub(super) fn budget(&self) -> f64 {
        match self.limit {
            Limit::Seconds(seconds) => seconds,
            Limit::Samples { .. } => f64::INFINITY,
        }
    }

    /// Whether more than so many samples may be drawn, which will take so many seconds.
    pub(super) fn allows(&self, samples: usize, seconds: f64) -> bool {
        match self.limit {
            Limit::Seconds(budget) => self.spent() + seconds <= budget,
            Limit::Samples { most, .. } => samples < most,
        }
    }

    /// So many samples, or as many as are allowed.
    pub(super) fn capped(&self, samples: usize) -> usize {
        self.samples().map_or(samples, |most| samples.min(most))
    }

    /// Moves the bar, as a run with so many samples a pixel is over.
    pub(super) fn drew(&self, samples: usize) {
        match self.limit {
            Limit::Seconds(budget) => {
                self.bar.reach((STEPS as f64 * (self.spent() / budget).min(1.0)) as usize);
            }
            Limit::Samples { .. } => self.bar.advance(samples),
        }
    }

    /// Seconds since the beginning.
    pub(super) fn spent(&self) -> f64 {
        self.start.elapsed().as_secs_f64()
    }
}
