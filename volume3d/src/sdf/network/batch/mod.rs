//! Batched evaluation of networks in single precision.
//!
//! Blocks of points pass through the layers together, one point per lane, so that each weight is loaded once
//! per block. No graph is stored.

mod block;
mod outer;
mod product;
mod softplus;
mod sweep;
mod weights;

#[cfg(test)]
mod tests;

use flatland::sdf::Jet;
use flatland::sdf::shapes::ShapeError;
use glam::DVec3;
use pulp::{Arch, Simd, WithSimd};
use rayon::prelude::*;

use self::block::{Block, Needs, Sums, covectors};
use self::product::BLOCK;
use self::weights::Weights;
use super::Network;

/// Groups whose gradients are in memory at once.
const ROUND: usize = 64;

/// Parameters that a thread sums at a time.
const SLICE: usize = 4096;

/// A single-precision copy of a [`Network`], for many points at once, on all threads of rayon's pool.
///
/// On one machine the bits of a point's result do not depend on the other points or on the number of threads.
/// (A machine without fused multiply–add rounds differently.) The deviation from the network itself is
/// single-precision rounding: about 3·10⁻⁷ in φ and 10⁻⁶ in derivatives, with sharpness 100. Coordinates are
/// rounded after the encoding. A point that is not finite has a value that is not finite, and does not affect
/// others.
///
/// After a step of the weights make a new copy, at the cost of about a hundred evaluations.
#[derive(Clone, Debug)]
pub struct SingleNetwork {
    weights: Weights,
    arch: Arch,
}

impl SingleNetwork {
    /// Number of points whose gradients are summed in single precision before they are added in double
    /// precision.
    pub const GROUP: usize = 8 * BLOCK;

    /// Rounds the weights.
    ///
    /// # Errors
    /// [`ShapeError::Parameter`] if a weight, the sharpness or its reciprocal exceeds the range of single
    /// precision.
    pub fn new(network: &Network) -> Result<Self, ShapeError> {
        Ok(Self { weights: Weights::new(network)?, arch: Arch::new() })
    }

    /// φ at each point.
    #[must_use]
    pub fn values(&self, points: &[DVec3]) -> Vec<f64> {
        let mut values = vec![0.0; points.len()];
        let groups = points.par_chunks(Self::GROUP).zip(values.par_chunks_mut(Self::GROUP));
        groups.for_each_init(
            || Block::new(&self.weights, Needs::Values),
            |block, (points, out)| {
                self.arch.dispatch(Values { weights: &self.weights, block, points, out });
            },
        );
        values
    }

    /// φ and ∇φ at each point.
    #[must_use]
    pub fn jets(&self, points: &[DVec3]) -> Vec<Jet<DVec3>> {
        let mut jets = vec![Jet::ZERO; points.len()];
        let groups = points.par_chunks(Self::GROUP).zip(jets.par_chunks_mut(Self::GROUP));
        groups.for_each_init(
            || Block::new(&self.weights, Needs::Jets),
            |block, (points, out)| {
                self.arch.dispatch(Jets { weights: &self.weights, block, points, out });
            },
        );
        jets
    }

    /// Adds Σ_i c_i ∂φ(x_i)/∂θ_j + q_i·∇∂φ(x_i)/∂θ_j to entry j, for covectors (c_i, q_i), like
    /// [`add_parameter_gradient`](flatland::sdf::Sdf::add_parameter_gradient) for single points.
    ///
    /// Points are summed in single precision within groups of [`GROUP`](Self::GROUP) consecutive points, and
    /// groups in double precision, in order. Bits do not depend on the threads, nor on a division into
    /// several calls at group boundaries.
    ///
    /// # Errors
    /// [`ShapeError::Count`] if there are not as many covectors as points, or as many entries as parameters.
    /// Nothing is added then.
    pub fn add_parameter_gradient(
        &self,
        points: &[DVec3],
        covectors: &[Jet<DVec3>],
        gradient: &mut [f64],
    ) -> Result<(), ShapeError> {
        for (expected, found) in [(points.len(), covectors.len()), (self.weights.count, gradient.len())] {
            if expected != found {
                return Err(ShapeError::Count { expected, found });
            }
        }
        let rounds = points.chunks(ROUND * Self::GROUP).zip(covectors.chunks(ROUND * Self::GROUP));
        for (points, covectors) in rounds {
            let groups = points.par_chunks(Self::GROUP).zip(covectors.par_chunks(Self::GROUP));
            let memory = || (Block::new(&self.weights, Needs::Gradient), Sums::new(&self.weights));
            let parts: Vec<Vec<f32>> = groups
                .map_init(memory, |(block, sums), (points, covectors)| {
                    sums.clear();
                    self.arch.dispatch(Reverse { weights: &self.weights, block, points, covectors, sums });
                    sums.parameters(self.weights.count)
                })
                .collect();
            gradient.par_chunks_mut(SLICE).enumerate().for_each(|(slice, entries)| {
                for part in &parts {
                    let part = &part[slice * SLICE..];
                    entries.iter_mut().zip(part).for_each(|(entry, &part)| *entry += f64::from(part));
                }
            });
        }
        Ok(())
    }
}

struct Values<'a> {
    weights: &'a Weights,
    block: &'a mut Block,
    points: &'a [DVec3],
    out: &'a mut [f64],
}

impl WithSimd for Values<'_> {
    type Output = ();

    #[inline(always)]
    fn with_simd<S: Simd>(self, simd: S) {
        let Self { weights, block, points, out } = self;
        for (points, out) in points.chunks(BLOCK).zip(out.chunks_mut(BLOCK)) {
            block.load(points, weights.frequencies);
            let values = sweep::values(simd, weights, block);
            for (out, &value) in out.iter_mut().zip(&values) {
                *out = f64::from(value);
            }
        }
    }
}

struct Jets<'a> {
    weights: &'a Weights,
    block: &'a mut Block,
    points: &'a [DVec3],
    out: &'a mut [Jet<DVec3>],
}

impl WithSimd for Jets<'_> {
    type Output = ();

    #[inline(always)]
    fn with_simd<S: Simd>(self, simd: S) {
        let Self { weights, block, points, out } = self;
        for (points, out) in points.chunks(BLOCK).zip(out.chunks_mut(BLOCK)) {
            block.load(points, weights.frequencies);
            let values = sweep::forward(simd, weights, block);
            let [x, y, z] = sweep::gradient(simd, weights, block);
            for (p, out) in out.iter_mut().enumerate() {
                let gradient = DVec3::new(f64::from(x[p]), f64::from(y[p]), f64::from(z[p]));
                *out = Jet { value: f64::from(values[p]), gradient };
            }
        }
    }
}

struct Reverse<'a> {
    weights: &'a Weights,
    block: &'a mut Block,
    points: &'a [DVec3],
    covectors: &'a [Jet<DVec3>],
    sums: &'a mut Sums,
}

impl WithSimd for Reverse<'_> {
    type Output = ();

    #[inline(always)]
    fn with_simd<S: Simd>(self, simd: S) {
        let Self { weights, block, points, covectors: all, sums } = self;
        for (points, some) in points.chunks(BLOCK).zip(all.chunks(BLOCK)) {
            block.load(points, weights.frequencies);
            sweep::forward(simd, weights, block);
            let (c, q) = covectors(some);
            sweep::reverse(simd, weights, block, (&c, &q), sums);
        }
    }
}
