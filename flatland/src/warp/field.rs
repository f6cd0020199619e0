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

/// V and ∇·V at one point as a linear form in the rates of what moves them: its coefficients, which know of no motion.
/// Forward mode applies it, reverse mode its transpose, so that each is the other's by construction.
pub trait LinearField {
    /// V.
    type Vector: Vector;
    /// What moves V: something seen, a vertex, a point of a level set.
    type Source;
    /// How that moves: a velocity; of a level set the change of its function and of that function's gradient.
    type Rate;

    /// Forward mode: the field, from the rate of every source.
    fn field(&self, rate: impl FnMut(&Self::Source) -> Self::Rate) -> Field<Self::Vector>;

    /// Reverse mode: hands every source the covector c_i for which Σ c_i·rate_i = a·V + b ∇·V. A source may come more
    /// than once.
    fn scatter(&self, a: Self::Vector, b: f64, add: impl FnMut(&Self::Source, Self::Rate));
}

/// That scatter is the transpose of field: what every [`LinearField`] promises, for its own tests.
#[cfg(test)]
pub(crate) fn assert_transposed<F: LinearField>(
    field: &F,
    (a, b): (F::Vector, f64),
    rate: impl Fn(&F::Source) -> F::Rate,
    product: impl Fn(F::Rate, F::Rate) -> f64,
) {
    let found = field.field(&rate);
    let forward = a.dot(found.value) + b * found.divergence;
    let (mut reverse, mut size) = (0.0, 1.0);
    field.scatter(a, b, |source, covector| {
        let term = product(covector, rate(source));
        reverse += term;
        size += term.abs();
    });
    assert!((forward - reverse).abs() < 1e-13 * size, "{forward} {reverse}");
}

/// A construction of V over a domain: known exactly, or estimated with the help of random numbers.
pub trait WarpField<D: Domain>: Sync {
    /// (V, ∇·V) at u, or an estimate of them, and the number of rays it took.
    fn at(&self, u: D::Vector, rng: &mut Stream) -> (Field<D::Vector>, u64);
}
