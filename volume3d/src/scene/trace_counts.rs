//! Counters of rays: of all rays, and of implicit-surface rays that were lost.

use std::cell::Cell;
use std::ops::{AddAssign, Sub};
use std::sync::atomic::{AtomicU64, Ordering};

/// Number of rays at implicit surfaces, including rays of warp fields, that ended neither with a hit nor by
/// leaving.
///
/// Near silhouettes where second derivatives have no [bound](flatland::sdf::Sdf::second_derivative_bound)
/// some rays run out of steps: about 1 per 10,000 hits of a ball, with the default
/// [`tracer`](super::Description::tracer); with a bound, as for cubic grids, hardly any. Warp fields lose as
/// many. Larger numbers bias image and gradient. The counts of an image or gradient include rays of other
/// threads that use the same scene at the same time.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct TraceCounts {
    /// Rays that ran out of steps, and count as misses.
    pub out_of_steps: u64,
    /// Rays that passed through the surface in a step permitted by its bound on |∇φ|: the bound is too low,
    /// and other rays may have passed through parts of it unnoticed.
    pub too_steep: u64,
    /// Rays that hit the surface where |∇φ| < √½: the field underestimates the speed of its silhouettes, and
    /// gradients are biased. Make φ a distance, by [`redistance`](crate::sdf::redistance()) or an eikonal
    /// term.
    pub too_flat: u64,
}

impl AddAssign for TraceCounts {
    fn add_assign(&mut self, other: Self) {
        self.out_of_steps += other.out_of_steps;
        self.too_steep += other.too_steep;
        self.too_flat += other.too_flat;
    }
}

impl Sub for TraceCounts {
    type Output = Self;
    fn sub(self, other: Self) -> Self {
        Self {
            out_of_steps: self.out_of_steps.saturating_sub(other.out_of_steps),
            too_steep: self.too_steep.saturating_sub(other.too_steep),
            too_flat: self.too_flat.saturating_sub(other.too_flat),
        }
    }
}

thread_local! {
    /// Rays lost by this thread, in any scene.
    static LOST: Cell<u64> = const { Cell::new(0) };
    /// Rays traced by this thread.
    static TRACED: Cell<u64> = const { Cell::new(0) };
}

/// Number of rays that this thread has lost so far: differences locate lost rays on the film.
pub(crate) fn lost_by_this_thread() -> u64 {
    LOST.get()
}

/// Number of rays that this thread has traced so far: differences measure cost, reproducibly on every
/// machine.
pub(crate) fn traced_by_this_thread() -> u64 {
    TRACED.get()
}

#[inline]
pub(super) fn count_traced(rays: usize) {
    TRACED.set(TRACED.get() + rays as u64);
}

fn count_lost() {
    LOST.set(LOST.get() + 1);
}

/// Counters shared by all threads. Increments are rare, so that contention is low, and sums do not depend on
/// the order.
#[derive(Debug, Default)]
pub(super) struct Counters {
    out_of_steps: AtomicU64,
    too_steep: AtomicU64,
    too_flat: AtomicU64,
}

impl Clone for Counters {
    /// Counts from 0.
    fn clone(&self) -> Self {
        Self::default()
    }
}

impl Counters {
    pub(super) fn count_out_of_steps(&self) {
        count_lost();
        self.out_of_steps.fetch_add(1, Ordering::Relaxed);
    }

    pub(super) fn count_too_steep(&self) {
        count_lost();
        self.too_steep.fetch_add(1, Ordering::Relaxed);
    }

    pub(super) fn count_too_flat(&self) {
        self.too_flat.fetch_add(1, Ordering::Relaxed);
    }

    pub(super) fn get(&self) -> TraceCounts {
        let [out_of_steps, too_steep, too_flat] =
            [&self.out_of_steps, &self.too_steep, &self.too_flat].map(|n| n.load(Ordering::Relaxed));
        TraceCounts { out_of_steps, too_steep, too_flat }
    }
}
