//! The pinhole camera.

use anyhow::{Result, ensure};
use glam::{DQuat, DVec2, DVec3};
use num_dual::{Dual64, DualNum};

use crate::dual::Vector3;
use crate::space::irradiance::Ray;

/// Tolerance on the orthonormality of the camera's axes: rounding of a rotation.
const ORTHONORMAL: f64 = 1e-12;

/// A perspective pinhole camera with square pixels.
///
/// The point p is seen at, in pixels, x to the right and y **down** from the film's upper left
/// corner,
///
/// ```text
/// u = (w/2 + s X/Z, h/2 − s Y/Z),   s = w/(2 tan(φ/2)),   (X, Y, Z) = (p − o)·(right, up, forward)
/// ```
///
/// so that pixel (i, j), row j from above, is [i, i+1] × [j, j+1].
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Camera {
    /// o, the common origin of all rays.
    pub origin: DVec3,
    /// Towards larger x on the film. `right`, `up` and `forward` are orthonormal; that is
    /// right-handed when right × up = −forward, as for a camera without mirror.
    pub right: DVec3,
    /// Towards smaller y on the film.
    pub up: DVec3,
    /// The direction of view, through the middle of the film.
    pub forward: DVec3,
    /// φ, the full horizontal field of view in radians, in (0, π).
    pub field_of_view: f64,
    /// Pixels per row.
    pub width: usize,
    /// Number of rows.
    pub height: usize,
}

/// The motion of a camera: its derivative at θ = 0.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct CameraMotion {
    /// The velocity of the origin.
    pub origin: DVec3,
    /// The angular velocity ω of the axes, in the world's coordinates: d right/dθ = ω × right.
    pub angular: DVec3,
    /// The rate of the field of view, in radians.
    pub field_of_view: f64,
}

impl Camera {
    /// The camera at θ: turned by the rotation vector θω, everything else linear in θ.
    pub fn displaced(&self, motion: &CameraMotion, theta: f64) -> Self {
        let turn = DQuat::from_scaled_axis(theta * motion.angular);
        Self {
            origin: self.origin + theta * motion.origin,
            right: turn * self.right,
            up: turn * self.up,
            forward: turn * self.forward,
            field_of_view: self.field_of_view + theta * motion.field_of_view,
            ..*self
        }
    }

    /// The direction, not normalised, of the film's point u.
    pub fn direction(&self, u: DVec2) -> DVec3 {
        let scale = self.pixels_per_slope();
        let offset = (u - 0.5 * DVec2::new(self.width as f64, self.height as f64)) / scale;
        self.forward + offset.x * self.right - offset.y * self.up
    }

    /// The ray through the film's point u, which is fixed while the camera moves.
    pub fn ray(&self, motion: &CameraMotion, u: DVec2) -> Ray {
        let direction = self.direction(u);
        // The offset from `forward` is proportional to tan(φ/2), of logarithmic derivative 1/sin φ.
        let opening = motion.field_of_view / self.field_of_view.sin() * (direction - self.forward);
        Ray {
            origin: self.origin,
            direction,
            origin_velocity: motion.origin,
            direction_rate: motion.angular.cross(direction) + opening,
        }
    }

    /// s: the distance in pixels of a direction of slope 1 from the film's centre.
    pub fn pixels_per_slope(&self) -> f64 {
        0.5 * self.width as f64 / (0.5 * self.field_of_view).tan()
    }

    /// Rejects invalid cameras.
    pub(in crate::space) fn check(&self, motion: &CameraMotion) -> Result<()> {
        let axes = [self.right, self.up, self.forward];
        let product = |i: usize, j: usize| axes[i].dot(axes[j]) - f64::from(u8::from(i == j));
        let is_frame = (0..3).all(|i| (0..=i).all(|j| product(i, j).abs() <= ORTHONORMAL));
        let is_finite = self.origin.is_finite() && motion.origin.is_finite() && motion.angular.is_finite();
        let is_open = self.field_of_view > 0.0 && self.field_of_view < std::f64::consts::PI;
        ensure!(is_frame, "the camera's axes are not orthonormal");
        ensure!(is_open && motion.field_of_view.is_finite(), "the field of view is not in (0, π)");
        ensure!(is_finite, "the camera is not finite");
        Ok(())
    }

    /// The axes to the right, up and forward, and s, as functions of θ.
    pub(in crate::space) fn moving(&self, motion: &CameraMotion) -> ([Vector3; 3], Dual64) {
        let axis = |a: DVec3| Vector3::new(a, motion.angular.cross(a));
        let half = Dual64::new(0.5 * self.field_of_view, 0.5 * motion.field_of_view);
        let scale = half.tan().recip() * (0.5 * self.width as f64);
        ([self.right, self.up, self.forward].map(axis), scale)
    }

    /// The image of a moving point under the moving camera, its velocity, and its depth Z.
    pub(super) fn project(&self, motion: &CameraMotion, point: Vector3) -> Projection {
        let offset = point - Vector3::new(self.origin, motion.origin);
        let (axes, scale) = self.moving(motion);
        let [x, y, z] = axes.map(|a| offset.dot(a));
        let (u, v) = (scale * x / z, -(scale * y / z));
        Projection {
            at: DVec2::new(0.5 * self.width as f64 + u.re, 0.5 * self.height as f64 + v.re),
            velocity: DVec2::new(u.eps, v.eps),
            depth: z.re,
        }
    }
}

/// A vertex on the film.
#[derive(Clone, Copy, Debug)]
pub(super) struct Projection {
    /// Position in pixels.
    pub(super) at: DVec2,
    /// Velocity in pixels per unit of θ.
    pub(super) velocity: DVec2,
    /// Depth along the direction of view.
    pub(super) depth: f64,
}
