//! A warp field as a linear form in the rates of φ, and its transpose.

use crate::sdf::distance::{Jet, LevelSetVelocity, SecondOrder};
use crate::sdf::scalar::Scalar;
use crate::sdf::space::{Directions, Space};
use crate::sdf::tracer::{RayCount, View};
use crate::warp::{Domain, Field, LinearField, Vector};

/// A point with the coefficients of φ̇ = ∂_θφ and ∇φ̇ there in V and ∇·V.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Tap<V> {
    /// The point.
    pub point: V,
    /// The coefficient of φ̇ in V, before projection.
    pub value: V,
    /// The coefficient of φ̇ in ∇·V.
    pub slope: f64,
    /// The covector of ∇φ̇ in ∇·V.
    pub gradient: V,
}

impl<V: Space> Tap<V> {
    /// The tap of U(ω) = W G(x)/t with x = o + tω, where t and W depend on ω, and of the divergence of P_ω U
    /// (Theory 10):
    ///
    /// ```text
    /// ∇·V = ∇_ω·U − n ω·U,
    /// ∇_ω·U = (∇W/t − W ∇t/t²)·e φ̇ + (W/t) ∇_ω·G,
    /// ∇_ω·G = (∇t·Eω + t (tr E − ω·Eω)) φ̇ + ((e·∇t) ω + t P_ω e)·∇φ̇,
    /// ```
    ///
    /// with G = φ̇ e, e = −∇φ/|∇φ|² near surfaces, and E = De.
    #[must_use]
    pub fn new<D: Domain<Vector = V>>(
        view: &View<'_, V>,
        direction: V,
        t: Scalar<V>,
        weight: Scalar<V>,
    ) -> Self {
        let point = view.eye + direction * t.value;
        Self::of::<D>(point, view.sdf.second_order(point), direction, t, weight)
    }

    /// The tap, given φ(x), ∇φ(x) and ∇²φ(x).
    #[must_use]
    pub fn of<D: Domain<Vector = V>>(
        point: V,
        SecondOrder { jet, hessian }: SecondOrder<V>,
        direction: V,
        t: Scalar<V>,
        weight: Scalar<V>,
    ) -> Self {
        let velocity = LevelSetVelocity::new(jet.gradient);
        let e = velocity.e();
        let along = velocity.derivative(hessian, direction);
        let trace = velocity.trace(hessian);
        let turn = t.gradient.dot(along) + t.value * (trace - direction.dot(along));
        let shift = direction * e.dot(t.gradient) + D::project(direction, e) * t.value;
        let scale = weight.value / t.value;
        let change = (weight.gradient - t.gradient * scale).dot(e) / t.value;
        let projected = D::CURVATURE * scale * direction.dot(e);
        Self { point, value: e * scale, slope: change + scale * turn - projected, gradient: shift * scale }
    }
}

/// V = P_ω Σ a_i φ̇(x_i) and ∇·V = Σ α_i φ̇(x_i) + β_i·∇φ̇(x_i), in one direction ω.
#[derive(Clone, Debug)]
pub struct FieldForm<D: Directions> {
    direction: D::Vector,
    taps: Vec<Tap<D::Vector>>,
    rays: RayCount,
}

impl<D: Directions> FieldForm<D> {
    pub(super) fn new(direction: D::Vector, taps: Vec<Tap<D::Vector>>, rays: RayCount) -> Self {
        Self { direction, taps, rays }
    }

    /// The points and their coefficients.
    #[must_use]
    pub fn taps(&self) -> &[Tap<D::Vector>] {
        &self.taps
    }

    /// Number of rays.
    #[must_use]
    pub fn rays(&self) -> RayCount {
        self.rays
    }
}

impl<D: Directions> LinearField for FieldForm<D> {
    type Vector = D::Vector;
    type Source = D::Vector;
    /// φ̇ and ∇φ̇.
    type Rate = Jet<D::Vector>;

    fn field(&self, mut rate: impl FnMut(&D::Vector) -> Jet<D::Vector>) -> Field<D::Vector> {
        let mut sum = Field::<D::Vector>::ZERO;
        for tap in &self.taps {
            let rate = rate(&tap.point);
            sum.value = sum.value + tap.value * rate.value;
            sum.divergence += tap.slope * rate.value + tap.gradient.dot(rate.gradient);
        }
        Field { value: D::project(self.direction, sum.value), ..sum }
    }

    /// (c_i, q_i) for which Σ c_i φ̇_i + q_i·∇φ̇_i = a·V + b ∇·V.
    fn scatter(&self, a: D::Vector, b: f64, mut add: impl FnMut(&D::Vector, Jet<D::Vector>)) {
        let a = D::project(self.direction, a);
        for tap in &self.taps {
            let value = a.dot(tap.value) + b * tap.slope;
            add(&tap.point, Jet { value, gradient: tap.gradient * b });
        }
    }
}
