//! Warp fields: value and divergence, independent of their construction.

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
    /// The zero field.
    pub const ZERO: Self = Self { value: V::ZERO, divergence: 0.0 };
}

/// V and ∇·V at one point as a linear form in the rates of their sources: its coefficients do not depend on
/// the motion. Forward mode applies the form, reverse mode its transpose, so that each is the transpose of
/// the other by construction.
pub trait LinearField {
    /// V.
    type Vector: Vector;
    /// Source of motion: a hit, a vertex, a point of a level set.
    type Source;
    /// Rate of a source: a velocity; for a level set, the rates of its function and of that function's
    /// gradient.
    type Rate;

    /// Forward mode: the field, from the rate of every source.
    fn field(&self, rate: impl FnMut(&Self::Source) -> Self::Rate) -> Field<Self::Vector>;

    /// Reverse mode: hands every source the covector c_i for which Σ c_i·rate_i = a·V + b ∇·V. A source may
    /// occur more than once.
    fn scatter(&self, a: Self::Vector, b: f64, add: impl FnMut(&Self::Source, Self::Rate));
}

/// Asserts that scatter is the transpose of field, as every [`LinearField`] must satisfy.
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

/// A construction of V over a domain, exact or estimated with random numbers.
pub trait WarpField<D: Domain>: Sync {
    /// (V, ∇·V) at u, or an estimate of them, and the number of rays.
    fn at(&self, u: D::Vector, rng: &mut Stream) -> (Field<D::Vector>, u64);
}
