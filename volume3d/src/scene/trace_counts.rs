//! Counts of rays: of all, and of those at implicit surfaces that could not be followed.

use std::cell::Cell;
use std::ops::{AddAssign, Sub};
use std::sync::atomic::{AtomicU64, Ordering};

/// How many rays at implicit surfaces ended otherwise than by a hit or by leaving, those of warp fields included.
///
/// Some run out of steps near silhouettes where second derivatives have no [bound](flatland::sdf::Sdf::second_derivative_bound): about one for 10,000 that hit a
/// ball, with the default [`tracer`](super::Description::tracer); with a bound, as of cubic grids, hardly any. Warp fields lose as many. More of them bias image and
/// gradient. The counts of an image or a gradient include what other
/// threads do with the same scene meanwhile.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct TraceCounts {
    /// Rays that ran out of steps, and count as misses.
    pub out_of_steps: u64,
    /// Rays that went through the surface by a step that its bound on |∇φ| allowed: it is too low, and other rays may have
    /// passed through parts of it.
    pub too_steep: u64,
    /// Rays that hit the surface where |∇φ| < √½: the field takes its silhouettes to be slower than they are, and
    /// gradients are biased. Make φ a distance, by [`redistance`](crate::sdf::redistance()) or an eikonal term.
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
    /// Rays that this thread has lost, in any scene.
    static LOST: Cell<u64> = const { Cell::new(0) };
    /// Rays that it has traced.
    static TRACED: Cell<u64> = const { Cell::new(0) };
}

/// Rays that this thread has ever lost for steps or slopes: the difference between two times is what was lost between them, which tells where on the
/// film it was.
pub(crate) fn lost_by_this_thread() -> u64 {
    LOST.get()
}

/// Rays that this thread has ever traced through a scene: the difference between two times says how dear what it did between them was, the same on
/// every machine.
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

/// Counts that all threads add to. They are rare, so that threads do not wait for one another, and their sums do not depend
/// on the order.
#[derive(Debug, Default)]
pub(super) struct Counters {
    out_of_steps: AtomicU64,
    too_steep: AtomicU64,
    too_flat: AtomicU64,
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
