//! Rigid warp fields: one rigid motion per kernel (Loubet, Holzschuch and Jakob 2019; Theory 11).

use flatland::warp::{Domain, Field, LinearField, Plane, Vector as _};
use glam::{DVec2, DVec3};

use super::followed::FollowedPoint;
use crate::Sphere;

/// A domain with rigid motions that move a whole kernel with one of its points.
pub(crate) trait Rigid: Domain {
    /// Velocity at u of the rigid motion that moves the point `at` with velocity v.
    fn carry(u: Self::Vector, at: Self::Vector, v: Self::Vector) -> Self::Vector;

    /// Transpose of [`carry`](Self::carry): covector of v, from the covector c at u.
    fn carry_back(u: Self::Vector, at: Self::Vector, c: Self::Vector) -> Self::Vector;
}

impl Rigid for Plane {
    /// A translation.
    fn carry(_: DVec2, _: DVec2, v: DVec2) -> DVec2 {
        v
    }

    fn carry_back(_: DVec2, _: DVec2, c: DVec2) -> DVec2 {
        c
    }
}

impl Rigid for Sphere {
    /// The rotation with angular velocity `at` × v: (a × v) × u = v (a·u) − a (v·u).
    fn carry(u: DVec3, at: DVec3, v: DVec3) -> DVec3 {
        v * at.dot(u) - at * v.dot(u)
    }

    fn carry_back(u: DVec3, at: DVec3, c: DVec3) -> DVec3 {
        c * at.dot(u) - u * c.dot(at)
    }
}

/// Rigid motion of a kernel around μ that follows one of the points seen in it.
///
/// The integral is spread over kernels, ∫ f = ∫∫ f(u) k(μ, u) dμ du, and each kernel moves rigidly. A rigid
/// motion has no divergence, but k is part of the integrand: ∇_u k·V/k takes the place of ∇·V.
#[derive(Clone, Debug)]
pub(crate) struct RigidMotion<D: Domain> {
    pub(crate) point: D::Vector,
    /// Position at which the followed point is seen, and the point.
    pub(crate) at: D::Vector,
    pub(crate) seen: FollowedPoint,
    /// ∇_u k/k.
    pub(crate) slope: D::Vector,
}

impl<D: Rigid> LinearField for RigidMotion<D> {
    type Vector = D::Vector;
    type Source = FollowedPoint;
    type Rate = D::Vector;

    /// The field from the velocity of the followed point.
    fn field(&self, mut velocity: impl FnMut(&FollowedPoint) -> D::Vector) -> Field<D::Vector> {
        let value = D::carry(self.point, self.at, velocity(&self.seen));
        Field { value, divergence: self.slope.dot(value) }
    }

    /// Transpose of `field`: hands the point its covector in a·V + b ∇·V.
    fn scatter(&self, a: D::Vector, b: f64, mut add: impl FnMut(&FollowedPoint, D::Vector)) {
        add(&self.seen, D::carry_back(self.point, self.at, a + self.slope * b));
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_rotation_carries_its_point_and_its_transpose_is_one() {
        let (u, at) = (DVec3::new(0.6, 0.0, 0.8), DVec3::new(0.0, 0.6, 0.8));
        let v = at.cross(DVec3::new(0.3, 1.0, -0.2));
        assert!((Sphere::carry(at, at, v) - v).length() < 1e-15);
        assert!(Sphere::carry(u, at, v).dot(u).abs() < 1e-15);
        let c = DVec3::new(1.0, -2.0, 0.5);
        let (forward, back) = (Sphere::carry(u, at, v).dot(c), Sphere::carry_back(u, at, c).dot(v));
        assert!((forward - back).abs() < 1e-15);
    }
}
