//! Receivers: points at which irradiance is computed.

use anyhow::{Result, ensure};
use glam::DVec3;

use crate::dual::Vector3;

/// A surface point and its lit side, as functions of θ to first order.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Receiver {
    /// x.
    pub point: DVec3,
    /// n: only its direction counts. Light below the horizon n·ω = 0 does not arrive.
    pub normal: DVec3,
    /// dx/dθ.
    pub velocity: DVec3,
    /// dn/dθ, of which only the part perpendicular to n matters.
    pub normal_rate: DVec3,
}

/// A ray, as a function of θ to first order.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Ray {
    /// The origin.
    pub origin: DVec3,
    /// The direction, not normalised.
    pub direction: DVec3,
    /// The velocity of the origin.
    pub origin_velocity: DVec3,
    /// The derivative of the direction.
    pub direction_rate: DVec3,
}

/// A triangle, as a function of θ to first order.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Ground {
    /// Its corners.
    pub corners: [DVec3; 3],
    /// Their velocities.
    pub velocities: [DVec3; 3],
}

impl Receiver {
    /// A point at rest.
    pub fn still(point: DVec3, normal: DVec3) -> Self {
        Self { point, normal, velocity: DVec3::ZERO, normal_rate: DVec3::ZERO }
    }

    /// The intersection of a ray with the plane of a triangle, on the side that faces the ray: the point of
    /// the triangle that a pixel shows, which is a different one at every θ.
    ///
    /// # Errors
    /// If the ray is parallel to the plane, leads away from it, or the triangle has no area.
    pub fn on_ray(ray: &Ray, ground: &Ground) -> Result<Self> {
        let corner = |k: usize| Vector3::new(ground.corners[k], ground.velocities[k]);
        let origin = Vector3::new(ray.origin, ray.origin_velocity);
        let direction = Vector3::new(ray.direction, ray.direction_rate);
        let normal = (corner(1) - corner(0)).cross(corner(2) - corner(0)).unit();
        let t = normal.dot(corner(0) - origin) / normal.dot(direction);
        ensure!(t.re.is_finite() && t.re > 0.0, "the ray meets no receiver");
        let point = origin + direction * t;
        let side = -normal.dot(direction).re.signum();
        Ok(Self {
            point: point.value(),
            normal: side * normal.value(),
            velocity: point.rate(),
            normal_rate: side * normal.rate(),
        })
    }

    /// The receiver at θ, at rest.
    pub fn displaced(&self, theta: f64) -> Self {
        Self::still(self.point + theta * self.velocity, self.normal + theta * self.normal_rate)
    }

    pub(super) fn check(&self) -> Result<()> {
        let parts = [self.point, self.normal, self.velocity, self.normal_rate];
        let has_normal = self.normal.length_squared().is_normal();
        ensure!(
            parts.iter().all(|p| p.is_finite()) && has_normal,
            "no receiver: not finite, or without a normal"
        );
        Ok(())
    }
}

impl Ray {
    /// A ray at rest.
    pub fn still(origin: DVec3, direction: DVec3) -> Self {
        Self { origin, direction, origin_velocity: DVec3::ZERO, direction_rate: DVec3::ZERO }
    }

    /// The ray at θ, at rest.
    pub fn displaced(&self, theta: f64) -> Self {
        let origin = self.origin + theta * self.origin_velocity;
        Self::still(origin, self.direction + theta * self.direction_rate)
    }
}

impl Ground {
    /// The triangle at θ, at rest.
    pub fn displaced(&self, theta: f64) -> Self {
        let corners = std::array::from_fn(|k| self.corners[k] + theta * self.velocities[k]);
        Self { corners, velocities: [DVec3::ZERO; 3] }
    }
}
