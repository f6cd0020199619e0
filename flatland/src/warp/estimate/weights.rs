//! Quotients of weighted sums, with logarithmic weights.

use crate::warp::domain::Vector;
use crate::warp::stencil::Term;

/// ln w̃ up to a constant, and ℓ = ∇_u ln w.
pub(super) struct LogWeight<V> {
    pub(super) weight: f64,
    pub(super) gradient: V,
}

/// Weights of all points, relative to the largest.
pub(super) struct Weights<V> {
    logs: Vec<LogWeight<V>>,
    relative: Vec<f64>,
}

impl<V: Vector> Weights<V> {
    pub(super) fn new(logs: Vec<LogWeight<V>>) -> Self {
        let relative = relative(&logs, 0..logs.len());
        Self { logs, relative }
    }

    /// Adds `coefficient` times the quotient estimate from a subset of the points: ω_i and ω_i (ℓ_i − ℓ̄).
    pub(super) fn accumulate<H>(
        &self,
        subset: impl Iterator<Item = usize> + Clone,
        coefficient: f64,
        terms: &mut [Term<V, H>],
    ) {
        let sum: f64 = subset.clone().map(|i| self.relative[i]).sum();
        if sum < f64::MIN_POSITIVE / f64::EPSILON {
            // If the subset is so far below the largest that its weights underflow, they are recomputed.
            let indices: Vec<usize> = subset.collect();
            let weights = relative(&self.logs, indices.iter().copied());
            self.add(indices.into_iter().zip(weights), coefficient, terms);
        } else {
            self.add(subset.map(|i| (i, self.relative[i])), coefficient, terms);
        }
    }

    fn add<H>(
        &self,
        weighted: impl Iterator<Item = (usize, f64)> + Clone,
        coefficient: f64,
        terms: &mut [Term<V, H>],
    ) {
        let mut sum = 0.0;
        let mut gradient = V::ZERO;
        for (i, w) in weighted.clone() {
            sum += w;
            gradient = gradient + self.logs[i].gradient * w;
        }
        let (mean, scale) = (gradient * (1.0 / sum), coefficient / sum);
        for (i, w) in weighted {
            let w = w * scale;
            terms[i].weight += w;
            terms[i].divergence = terms[i].divergence + (self.logs[i].gradient - mean) * w;
        }
    }
}

/// Weights of some points, relative to the largest of these.
fn relative<V>(logs: &[LogWeight<V>], indices: impl Iterator<Item = usize> + Clone) -> Vec<f64> {
    let largest = indices.clone().map(|i| logs[i].weight).fold(f64::NEG_INFINITY, f64::max);
    indices.map(|i| (logs[i].weight - largest).exp()).collect()
}
