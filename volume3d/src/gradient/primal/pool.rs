//! Pool of reusable row workers.

use std::ops::{Deref, DerefMut};
use std::sync::{Mutex, PoisonError};

/// Idle workers: at most one per thread is ever made.
pub(super) struct Pool<W, F> {
    make: F,
    waiting: Mutex<Vec<W>>,
}

impl<W, F: Fn() -> W> Pool<W, F> {
    pub(super) fn new(make: F) -> Self {
        Self { make, waiting: Mutex::new(vec![]) }
    }

    /// Takes a worker, which returns to the pool when dropped.
    pub(super) fn take(&self) -> Taken<'_, W> {
        let waiting = self.waiting.lock().unwrap_or_else(PoisonError::into_inner).pop();
        Taken { worker: Some(waiting.unwrap_or_else(&self.make)), waiting: &self.waiting }
    }
}

/// A worker in use.
pub(super) struct Taken<'a, W> {
    worker: Option<W>,
    waiting: &'a Mutex<Vec<W>>,
}

impl<W> Deref for Taken<'_, W> {
    type Target = W;

    fn deref(&self) -> &W {
        self.worker.as_ref().expect("it is there until it is dropped")
    }
}

impl<W> DerefMut for Taken<'_, W> {
    fn deref_mut(&mut self) -> &mut W {
        self.worker.as_mut().expect("it is there until it is dropped")
    }
}

impl<W> Drop for Taken<'_, W> {
    fn drop(&mut self) {
        self.waiting.lock().unwrap_or_else(PoisonError::into_inner).extend(self.worker.take());
    }
}
