//! (V, ∇·V) as a linear form in the velocities of auxiliary hits, or of discontinuities.

use super::domain::{Domain, Vector as _};
use super::field::{Field, LinearField};

/// An auxiliary hit, or a discontinuity, with its coefficients in V and ∇·V.
#[derive(Clone, Copy, Debug)]
pub struct Term<V, H> {
    /// The hit of the auxiliary ray, or the source of the discontinuity's motion.
    pub hit: H,
    /// Ω_i: the coefficient of V_i in V, before projection.
    pub weight: f64,
    /// M_i: the covector whose product with V_i enters ∇·V.
    pub divergence: V,
}

/// V = P_u Σ Ω_i V_i and ∇·V = Σ M_i·V_i at one point u, for velocities V_i of auxiliary hits or of
/// discontinuities.
#[derive(Clone, Debug)]
pub struct Stencil<D: Domain, H> {
    point: D::Vector,
    terms: Vec<Term<D::Vector, H>>,
}

impl<D: Domain, H> Stencil<D, H> {
    pub(super) fn new(point: D::Vector, terms: Vec<Term<D::Vector, H>>) -> Self {
        Self { point, terms }
    }

    /// The hits or discontinuities, and their coefficients.
    #[must_use]
    pub fn terms(&self) -> &[Term<D::Vector, H>] {
        &self.terms
    }
}

impl<D: Domain, H> LinearField for Stencil<D, H> {
    type Vector = D::Vector;
    type Source = H;
    type Rate = D::Vector;

    fn field(&self, mut velocity: impl FnMut(&H) -> D::Vector) -> Field<D::Vector> {
        let mut sum = Field::<D::Vector>::ZERO;
        for term in &self.terms {
            let v = velocity(&term.hit);
            sum.value = sum.value + v * term.weight;
            sum.divergence += term.divergence.dot(v);
        }
        Field { value: D::project(self.point, sum.value), ..sum }
    }

    /// c_i = Ω_i P_u a + b M_i.
    fn scatter(&self, a: D::Vector, b: f64, mut add: impl FnMut(&H, D::Vector)) {
        let a = D::project(self.point, a);
        for term in &self.terms {
            add(&term.hit, a * term.weight + term.divergence * b);
        }
    }
}
