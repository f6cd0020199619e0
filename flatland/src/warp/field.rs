//! What a warp field answers, however it was constructed.

use super::domain::{Domain, Vector};
use crate::random::Stream;

/// The warp field at a point.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Field<V> {
    /// V(u), tangent at u.
    pub value: V,
    /// ∇·V(u).
    pub divergence: f64,
}

impl<V: Vector> Field<V> {
    /// No motion.
    pub const ZERO: Self = Self { value: V::ZERO, divergence: 0.0 };
}

/// A construction of V over a domain: known exactly, or estimated with the help of random numbers.
pub trait WarpField<D: Domain>: Sync {
    /// (V, ∇·V) at u, or an estimate of them, and the number of rays it took.
    fn at(&self, u: D::Vector, rng: &mut Stream) -> (Field<D::Vector>, u64);
}
