//! Distance from a moving point, the building block of discs and of polygon corners.

use crate::sdf::distance::{Jet, SecondOrder};
use crate::sdf::space::Space;

/// ρ(x) = |x − p|, with derivatives, all of which are 0 at p itself.
#[derive(Clone, Copy)]
pub(super) struct PointDistance<V> {
    distance: f64,
    /// m = (x − p)/ρ.
    direction: V,
    /// 1/ρ.
    inverse: f64,
}

impl<V: Space> PointDistance<V> {
    pub(super) fn new(x: V, p: V) -> Self {
        let offset = x - p;
        let distance = offset.norm();
        let inverse = if distance > 0.0 { distance.recip() } else { 0.0 };
        Self { distance, direction: offset * inverse, inverse }
    }

    pub(super) fn jet(self) -> Jet<V> {
        Jet { value: self.distance, gradient: self.direction }
    }

    /// ∇²ρ v = (v − m m·v)/ρ
    fn hessian_times(self, v: V) -> V {
        (v - self.direction * self.direction.dot(v)) * self.inverse
    }

    /// ∇²ρ = (1 − m mᵀ)/ρ
    pub(super) fn second_order(self) -> SecondOrder<V> {
        let hessian = (V::IDENTITY - self.direction.outer(self.direction)) * self.inverse;
        SecondOrder { jet: self.jet(), hessian }
    }

    /// ρ̇ = −m·ṗ, ∇ρ̇ = −∇²ρ ṗ
    pub(super) fn rate(self, velocity: V) -> Jet<V> {
        Jet { value: -self.direction.dot(velocity), gradient: -self.hessian_times(velocity) }
    }

    /// The covector of ṗ.
    pub(super) fn transpose(self, covector: Jet<V>) -> V {
        self.direction * -covector.value - self.hessian_times(covector.gradient)
    }
}
