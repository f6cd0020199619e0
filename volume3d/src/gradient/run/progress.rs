//! Progress reports and cancellation of long computations.

use std::sync::Arc;

/// Callbacks of a long computation: progress and cancellation.
#[derive(Default)]
pub struct Progress {
    start: Option<Box<dyn Fn(usize) + Send + Sync>>,
    step: Option<Box<dyn Fn() + Send + Sync>>,
    stop: Option<Arc<dyn Fn() -> bool + Send + Sync>>,
}

impl std::fmt::Debug for Progress {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        f.write_str("Progress")
    }
}

/// The computation was cancelled.
#[derive(Clone, Copy, Debug, PartialEq, Eq, thiserror::Error)]
#[error("stopped before the end")]
pub struct Stopped;

impl Progress {
    /// No reports, no cancellation.
    #[must_use]
    pub fn none() -> Self {
        Self::default()
    }

    /// Calls `start` with the number of steps of each stage, and `step` after each step.
    #[must_use]
    pub fn new(
        start: impl Fn(usize) + Send + Sync + 'static,
        step: impl Fn() + Send + Sync + 'static,
    ) -> Self {
        Self { start: Some(Box::new(start)), step: Some(Box::new(step)), stop: None }
    }

    /// Cancels when `stop` returns true. All threads call it before every sample, so that it must be fast: it
    /// reads a flag.
    ///
    /// ```
    /// use std::sync::Arc;
    /// use std::sync::atomic::{AtomicBool, Ordering};
    /// # use volume3d::gradient::Progress;
    /// let flag = Arc::new(AtomicBool::new(false));
    /// let read = Arc::clone(&flag);
    /// let progress = Progress::none().until(move || read.load(Ordering::Relaxed));
    /// ```
    #[must_use]
    pub fn until(mut self, stop: impl Fn() -> bool + Send + Sync + 'static) -> Self {
        self.stop = Some(Arc::new(stop));
        self
    }

    /// The same cancellation, without reports: for a part of a computation that reports its own steps.
    pub(crate) fn silent(&self) -> Self {
        Self { start: None, step: None, stop: self.stop.clone() }
    }

    pub(crate) fn start(&self, steps: usize) {
        if let Some(start) = &self.start {
            start(steps);
        }
    }

    pub(crate) fn advance(&self) {
        if let Some(step) = &self.step {
            step();
        }
    }

    pub(crate) fn stopped(&self) -> bool {
        self.stop.as_ref().is_some_and(|stop| stop())
    }
}
