//! Flat convex polygons that emit and occlude.

use anyhow::{Result, ensure};
use glam::DVec3;
use num_dual::Dual64;

use crate::dual::Vector3;

/// Tolerance on the distance of a corner, or its velocity, from the plane of the others, relative to the size
/// of the surface, or to the speeds.
const FLAT: f64 = 1e-9;
/// Rounding of coordinates, relative to their magnitude.
const ROUNDING: f64 = 1e-15;

/// The emitting sides of a surface. Both occlude.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Sides {
    /// The side that the normal (b − a) × (c − a) points to, from which the corners are
    /// counterclockwise.
    #[default]
    Front,
    /// Both.
    Both,
}

/// A flat convex polygon: an emitter, or an occluder if its radiance is 0. It reflects nothing.
#[derive(Clone, Debug, PartialEq)]
pub struct Surface {
    /// Three corners or more, in order.
    pub vertices: Vec<DVec3>,
    /// Their velocities, under which the polygon stays flat.
    pub velocities: Vec<DVec3>,
    /// Emitted radiance, linear RGB.
    pub radiance: DVec3,
    /// The emitting sides.
    pub sides: Sides,
}

impl Surface {
    /// A surface at rest that emits from its front.
    pub fn emitter(vertices: Vec<DVec3>, radiance: DVec3) -> Self {
        let velocities = vec![DVec3::ZERO; vertices.len()];
        Self { vertices, velocities, radiance, sides: Sides::Front }
    }

    /// A surface at rest that emits nothing.
    pub fn occluder(vertices: Vec<DVec3>) -> Self {
        Self::emitter(vertices, DVec3::ZERO)
    }

    /// The surface at θ: every corner p at p + θ ṗ, at rest.
    pub fn displaced(&self, theta: f64) -> Self {
        assert_eq!(self.vertices.len(), self.velocities.len(), "one velocity per corner");
        let moved = |(p, v): (&DVec3, &DVec3)| *p + theta * *v;
        let vertices: Vec<_> = self.vertices.iter().zip(&self.velocities).map(moved).collect();
        let velocities = vec![DVec3::ZERO; vertices.len()];
        Self { vertices, velocities, ..self.clone() }
    }

    /// The corners as seen from a moving point.
    pub(in crate::space) fn seen_from(&self, point: Vector3) -> Vec<Vector3> {
        self.vertices.iter().zip(&self.velocities).map(|(p, v)| Vector3::new(*p, *v) - point).collect()
    }

    /// Whether a segment from x to a point meets it: brute force for tests, by the sides of its plane and
    /// edges.
    #[cfg(test)]
    pub(in crate::space) fn hides(&self, x: DVec3, point: DVec3) -> bool {
        let p = &self.vertices;
        let normal = (p[1] - p[0]).cross(p[2] - p[0]);
        let t = normal.dot(p[0] - x) / normal.dot(point - x);
        let at = x + t * (point - x);
        let inside = |k: usize| (p[(k + 1) % p.len()] - p[k]).cross(at - p[k]).dot(normal) >= 0.0;
        t > 0.0 && t < 1.0 && (0..p.len()).all(inside)
    }

    pub(super) fn check(&self) -> Result<()> {
        let (corners, velocities) = (self.vertices.len(), self.velocities.len());
        ensure!(corners >= 3 && velocities == corners, "{corners} corners and {velocities} velocities");
        let mut numbers = self.vertices.iter().chain(&self.velocities).chain([&self.radiance]);
        ensure!(numbers.all(|p| p.is_finite()), "a coordinate, velocity or radiance is not finite");
        self.check_flat()?;
        self.check_convex()
    }

    fn check_flat(&self) -> Result<()> {
        let corners = self.seen_from(Vector3::still(self.vertices[0]));
        let normal = area_vector(&corners).unit();
        let largest = |v: &[DVec3]| v.iter().map(|p| p.length()).fold(0.0, f64::max);
        let extent = corners.iter().map(|c| c.value().length()).fold(0.0, f64::max);
        let speed = largest(&self.velocities);
        for (k, corner) in corners.iter().enumerate() {
            let height: Dual64 = normal.dot(*corner - corners[0]);
            // NaN from a surface without area must be rejected too.
            ensure!(
                height.re.abs() <= FLAT * extent + ROUNDING * largest(&self.vertices)
                    && height.eps.abs() <= FLAT * (speed + normal.rate().length() * extent),
                "no area, or not flat at corner {k}, or it does not stay so"
            );
        }
        Ok(())
    }

    fn check_convex(&self) -> Result<()> {
        let (p, n) = (&self.vertices, self.vertices.len());
        let normal = area_vector(&self.seen_from(Vector3::still(p[0]))).value();
        for k in 0..n {
            let edge = p[(k + 1) % n] - p[k];
            let inside = |q: &DVec3| edge.cross(*q - p[k]).dot(normal) >= -FLAT * normal.length_squared();
            ensure!(p.iter().all(inside), "not convex at the edge from corner {k}");
        }
        Ok(())
    }
}

/// Twice the area of a flat polygon times its normal.
pub(in crate::space) fn area_vector(corners: &[Vector3]) -> Vector3 {
    let fan = |k: usize| (corners[k - 1] - corners[0]).cross(corners[k] - corners[0]);
    (3..corners.len()).fold(fan(2), |sum, k| sum + fan(k))
}
