//! The distance from a moving point, which discs and the corners of polygons are made of.

use glam::DVec2;

use crate::sdf::distance::Jet;

/// ρ(x) = |x − p|, with the derivatives all of which are 0 at p itself.
#[derive(Clone, Copy)]
pub(super) struct PointDistance {
    distance: f64,
    /// m = (x − p)/ρ.
    direction: DVec2,
    /// 1/ρ.
    inverse: f64,
}

impl PointDistance {
    pub(super) fn new(x: DVec2, p: DVec2) -> Self {
        let offset = x - p;
        let distance = offset.length();
        let inverse = if distance > 0.0 { distance.recip() } else { 0.0 };
        Self { distance, direction: offset * inverse, inverse }
    }

    pub(super) fn jet(self) -> Jet<DVec2> {
        Jet { value: self.distance, gradient: self.direction }
    }

    /// ∇²ρ v = (v − m m·v)/ρ
    pub(super) fn hessian_times(self, v: DVec2) -> DVec2 {
        (v - self.direction.dot(v) * self.direction) * self.inverse
    }

    pub(super) fn laplacian(self) -> f64 {
        self.inverse
    }

    /// ρ̇ = −m·ṗ, ∇ρ̇ = −∇²ρ ṗ
    pub(super) fn rate(self, velocity: DVec2) -> Jet<DVec2> {
        Jet { value: -self.direction.dot(velocity), gradient: -self.hessian_times(velocity) }
    }

    /// The covector of ṗ.
    pub(super) fn transpose(self, covector: Jet<DVec2>) -> DVec2 {
        -covector.value * self.direction - self.hessian_times(covector.gradient)
    }
}
