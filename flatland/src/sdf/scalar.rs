//! Functions of the direction of a ray, with their gradients.

use crate::warp::Vector;

/// A scalar function of ω and its gradient, tangent at ω.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Scalar<V> {
    /// Its value.
    pub value: f64,
    /// Its gradient.
    pub gradient: V,
}

impl<V: Vector> Scalar<V> {
    /// A constant function.
    #[must_use]
    pub fn constant(value: f64) -> Self {
        Self { value, gradient: V::ZERO }
    }
}
