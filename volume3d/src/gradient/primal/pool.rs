//! What rows are computed with, and what they leave to later ones.

use std::ops::{Deref, DerefMut};
use std::sync::{Mutex, PoisonError};

/// Workers that wait for a row: at most one for each thread is ever made.
pub(super) struct Pool<W, F> {
    make: F,
    waiting: Mutex<Vec<W>>,
}

impl<W, F: Fn() -> W> Pool<W, F> {
    pub(super) fn new(make: F) -> Self {
        Self { make, waiting: Mutex::new(vec![]) }
    }

    /// A worker, until it is dropped.
    pub(super) fn take(&self) -> Taken<'_, W> {
        let waiting = self.waiting.lock().unwrap_or_else(PoisonError::into_inner).pop();
        Taken { worker: Some(waiting.unwrap_or_else(&self.make)), waiting: &self.waiting }
    }
}

/// A worker that goes back to where it was taken from.
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
