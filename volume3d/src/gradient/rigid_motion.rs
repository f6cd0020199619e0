//! One rigid motion per kernel (Loubet, Holzschuch and Jakob 2019).

use flatland::warp::{Domain, Field, LinearField, Plane, Stencil, Vector as _};
use glam::{DVec2, DVec3};

use super::followed::FollowedPoint;
use crate::Sphere;

/// A domain whose kernels can be carried along with one of their points.
pub(crate) trait Rigid: Domain {
    /// The velocity of u when the kernel moves so that the point `at` moves with velocity v.
    fn carry(u: Self::Vector, at: Self::Vector, v: Self::Vector) -> Self::Vector;

    /// The transpose: what a covector at u gives to v.
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

/// A kernel around μ that follows one of the points seen in it.
///
/// The integral is spread over kernels, ∫ f = ∫∫ f(u) k(μ, u) dμ du, and each kernel moves rigidly. A rigid motion has
/// no divergence, but k is part of the integrand: ∇_u k·V/k stands where ∇·V does.
#[derive(Clone, Debug)]
pub(crate) struct RigidMotion<D: Domain> {
    pub(crate) point: D::Vector,
    /// Where the point that is followed is seen, and what it is.
    pub(crate) at: D::Vector,
    pub(crate) seen: FollowedPoint,
    /// ∇_u k/k.
    pub(crate) slope: D::Vector,
}

/// The warp at a point, however it was constructed: linear in the velocities of what was seen.
#[derive(Clone, Debug)]
pub(crate) enum Warping<D: Domain> {
    /// The mean of velocities, weighted with regard to boundaries.
    Weighted(Stencil<D, FollowedPoint>),
    /// One rigid motion.
    Followed(RigidMotion<D>),
}

impl<D: Rigid> LinearField for Warping<D> {
    type Vector = D::Vector;
    type Source = FollowedPoint;
    type Rate = D::Vector;

    /// From the velocity of each hit.
    fn field(&self, mut velocity: impl FnMut(&FollowedPoint) -> D::Vector) -> Field<D::Vector> {
        match self {
            Self::Weighted(stencil) => stencil.field(velocity),
            Self::Followed(RigidMotion { point, at, seen, slope }) => {
                let value = D::carry(*point, *at, velocity(seen));
                Field { value, divergence: slope.dot(value) }
            }
        }
    }

    /// The transpose: hands each hit its covector in a·V + b ∇·V.
    fn scatter(&self, a: D::Vector, b: f64, mut add: impl FnMut(&FollowedPoint, D::Vector)) {
        match self {
            Self::Weighted(stencil) => stencil.scatter(a, b, add),
            Self::Followed(RigidMotion { point, at, seen, slope }) => {
                add(seen, D::carry_back(*point, *at, a + *slope * b));
            }
        }
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
