//! A pinhole camera in the plane and its film, a line of pixels.

use glam::DVec2;
use rand::Rng;

use crate::calculus::{Number, Vec2};
use crate::plane::Filter;

/// A pinhole at `position`, looking along the angle `angle`, and a film in front of it.
///
/// Let T = tan(field of view/2), a the optical axis, and b the axis rotated from +x towards +y by a right
/// angle. The film coordinate u ∈ [0, n] of a film of n pixels belongs to the direction a + (2u/n − 1) T b.
/// The image is I_p = ∫ h_p(u) L(position, ω(u)) du, with the filter normalised to ∫ h_p du = 1.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Camera {
    /// The pinhole.
    pub position: DVec2,
    /// Direction of the optical axis in radians, from +x towards +y.
    pub angle: f64,
    /// Angle between the directions of both ends of the film, in (0, π).
    pub field_of_view: f64,
    /// The film.
    pub film: Film,
}

/// A line of pixels of unit length: pixel i is [i, i + 1].
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Film {
    /// Number of pixels.
    pub pixels: usize,
    /// The pixel filter, in one dimension.
    pub filter: Filter,
}

/// Invalid parameters of a camera.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum CameraError {
    /// No pixels, or more than 2³².
    #[error("a film of {pixels} pixels")]
    Pixels {
        /// Number of pixels.
        pixels: usize,
    },
    /// A position or angle that is NaN or infinite.
    #[error("the camera's position or angle is not finite")]
    NotFinite,
    /// The field of view is not in (0, π).
    #[error("the field of view of {field_of_view} radians is not in (0, π)")]
    FieldOfView {
        /// The field of view.
        field_of_view: f64,
    },
}

/// A film coordinate sampled for a pixel, with the filter value divided by the density.
#[derive(Clone, Copy, Debug)]
pub struct FilmSample {
    /// u.
    pub u: f64,
    /// h(u)/p(u): mean 1.
    pub value: f64,
    /// h'(u)/p(u): mean 0.
    pub slope: f64,
}

/// Velocity of a film coordinate, or of a direction, per unit of each of the camera's parameters.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct CameraTangent {
    /// Per unit of the position.
    pub position: DVec2,
    /// Per radian of the angle.
    pub angle: f64,
    /// Per radian of the field of view.
    pub field_of_view: f64,
}

impl Camera {
    /// Checks the parameters once, so that no other call need.
    ///
    /// # Errors
    /// A [`CameraError`] that names the parameter.
    pub fn check(&self) -> Result<(), CameraError> {
        let Film { pixels, .. } = self.film;
        if pixels == 0 || u32::try_from(pixels).is_err() {
            return Err(CameraError::Pixels { pixels });
        }
        if !(self.position.is_finite() && self.angle.is_finite()) {
            return Err(CameraError::NotFinite);
        }
        let field_of_view = self.field_of_view;
        if !(field_of_view > 0.0 && field_of_view < std::f64::consts::PI) {
            return Err(CameraError::FieldOfView { field_of_view });
        }
        Ok(())
    }

    /// The optical axis a and the film's direction b.
    #[must_use]
    pub fn axes(&self) -> [DVec2; 2] {
        let axis = DVec2::from_angle(self.angle);
        [axis, axis.perp()]
    }

    /// T = tan(field of view/2).
    #[must_use]
    pub(crate) fn half_width(&self) -> f64 {
        (0.5 * self.field_of_view).tan()
    }

    /// Half the number of pixels: u = n/2 (1 + s).
    fn half_film(&self) -> f64 {
        0.5 * self.film.pixels as f64
    }

    /// The unit direction ω(u).
    #[must_use]
    pub fn direction(&self, u: f64) -> DVec2 {
        self.film.direction(u, self.angle, self.field_of_view).value()
    }

    /// Film coordinate of a point; `None` if it is not in front of the camera.
    #[must_use]
    pub fn project(&self, point: DVec2) -> Option<f64> {
        let [a, b] = self.axes();
        let d = point - self.position;
        let depth = d.dot(a);
        (depth > 0.0).then(|| self.half_film() * (1.0 + d.dot(b) / (depth * self.half_width())))
    }

    /// du/dθ of the point seen at u at the distance t along ω(u): the covectors of the point's velocity and
    /// of the camera's own change. A point at infinity has t = ∞.
    #[must_use]
    pub(crate) fn film_rate(&self, u: f64, distance: f64) -> (DVec2, CameraTangent) {
        let ([a, b], tan, half) = (self.axes(), self.half_width(), self.half_film());
        // With q = s T = (d·b)/(d·a): q̇ = (ḋ·b − q ḋ·a)/(d·a), d·a = t/√(1 + q²).
        let q = (u / half - 1.0) * tan;
        let stretch = 1.0 + q * q;
        let point = (b - q * a) * (half / tan * stretch.sqrt() / distance);
        let angle = -half / tan * stretch;
        // Ṫ = (1 + T²)/2 per radian.
        let field_of_view = -half * q * 0.5 * (1.0 + tan * tan) / (tan * tan);
        (point, CameraTangent { position: -point, angle, field_of_view })
    }

    /// The derivative of [`film_rate`](Self::film_rate) by u, along points whose distance changes by
    /// `slope` per unit of u.
    #[must_use]
    pub(crate) fn film_rate_slope(&self, u: f64, distance: f64, slope: f64) -> (DVec2, CameraTangent) {
        let ([a, b], tan, half) = (self.axes(), self.half_width(), self.half_film());
        let (q, dq) = ((u / half - 1.0) * tan, tan / half);
        let root = (1.0 + q * q).sqrt();
        let scale = half / (tan * distance);
        let point =
            -dq * root * scale * a + (b - q * a) * (scale * (q * dq / root - root * slope / distance));
        let field_of_view = -0.5 * (1.0 + tan * tan) / tan;
        (point, CameraTangent { position: -point, angle: -2.0 * q, field_of_view })
    }

    /// dψ/dθ of the angle ψ of the direction ω(u): per unit of u̇, and per unit of the camera's own change.
    #[must_use]
    pub fn direction_rate(&self, u: f64) -> (f64, CameraTangent) {
        let (tan, half) = (self.half_width(), self.half_film());
        let s = u / half - 1.0;
        let stretch = 1.0 + s * s * tan * tan;
        let field_of_view = s * 0.5 * (1.0 + tan * tan) / stretch;
        (tan / (half * stretch), CameraTangent { position: DVec2::ZERO, angle: 1.0, field_of_view })
    }
}

impl Film {
    /// The unit direction ω(u) of a camera with this film, its angle and its field of view.
    pub(crate) fn direction<T: Number>(&self, u: T, angle: T, field_of_view: T) -> Vec2<T> {
        let axis = Vec2::new(angle.cos(), angle.sin());
        let half = field_of_view * 0.5;
        let across = u / T::constant(0.5 * self.pixels as f64) - T::constant(1.0);
        (axis + axis.perp() * (across * (half.sin() / half.cos()))).normalized()
    }

    /// The centre of pixel i.
    #[must_use]
    pub fn centre(&self, i: usize) -> f64 {
        i as f64 + 0.5
    }

    /// h(u) of pixel i.
    #[must_use]
    pub fn filter_value(&self, i: usize, u: f64) -> f64 {
        self.filter.profile(u - self.centre(i))
    }

    /// Width of a pixel's end: several hundred times the rounding of positions there. A point at the end of
    /// box pixels belongs to both in equal parts, as in [the plane](crate::plane::Film).
    pub(crate) fn border(&self) -> f64 {
        1024.0 * f64::EPSILON * (self.pixels as f64).max(1.0)
    }

    /// h(u) of pixel i for a discontinuity; at the end of box pixels it is shared between them.
    pub(crate) fn filter_share(&self, i: usize, u: f64) -> f64 {
        if self.filter != Filter::Box {
            return self.filter_value(i, u);
        }
        let inside = 0.5 - (u - self.centre(i)).abs();
        (0.5 * inside / self.border() + 0.5).clamp(0.0, 1.0)
    }

    /// The parts [u₀, u₁] of pixel i's support on which its filter is smooth.
    pub fn cells(&self, i: usize) -> impl Iterator<Item = [f64; 2]> + use<> {
        let centre = self.centre(i);
        self.filter.intervals().iter().map(move |&(a, b)| [centre + a, centre + b])
    }

    /// Draws u in the support of pixel i.
    pub fn sample(&self, i: usize, rng: &mut impl Rng) -> FilmSample {
        let (offset, density) = self.filter.profile_sample(rng);
        FilmSample {
            u: self.centre(i) + offset,
            value: self.filter.profile(offset) / density,
            slope: self.filter.profile_slope(offset) / density,
        }
    }
}

impl CameraTangent {
    /// Rate of a quantity with these derivatives when the camera changes by `change`.
    #[must_use]
    pub fn dot(&self, change: &Self) -> f64 {
        self.to_array().into_iter().zip(change.to_array()).map(|(a, b)| a * b).sum()
    }

    /// Without the position, where it enters as the velocity of the origin.
    #[must_use]
    pub(crate) fn without_position(self) -> Self {
        Self { position: DVec2::ZERO, ..self }
    }

    /// The rates in order.
    #[must_use]
    pub fn to_array(&self) -> [f64; 4] {
        [self.position.x, self.position.y, self.angle, self.field_of_view]
    }

    /// Adds `factor` times another.
    pub fn add(&mut self, factor: f64, other: &Self) {
        self.position += factor * other.position;
        self.angle += factor * other.angle;
        self.field_of_view += factor * other.field_of_view;
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn camera() -> Camera {
        let film = Film { pixels: 12, filter: Filter::Tent };
        Camera { position: DVec2::new(0.3, -0.2), angle: 0.7, field_of_view: 1.1, film }
    }

    fn moved(h: f64, change: &CameraTangent) -> Camera {
        let mut camera = camera();
        camera.position += h * change.position;
        camera.angle += h * change.angle;
        camera.field_of_view += h * change.field_of_view;
        camera
    }

    #[test]
    fn projection_inverts_direction() {
        let camera = camera();
        for u in [0.0, 1.7, 6.0, 12.0, 14.0] {
            let back = camera.project(camera.position + 3.0 * camera.direction(u));
            assert!((back.expect("in front") - u).abs() < 1e-12);
        }
        assert_eq!(camera.project(camera.position - camera.direction(3.0)), None);
    }

    #[test]
    fn rates_are_derivatives() {
        let changes = [
            CameraTangent { position: DVec2::X, ..CameraTangent::default() },
            CameraTangent { position: DVec2::Y, ..CameraTangent::default() },
            CameraTangent { angle: 1.0, ..CameraTangent::default() },
            CameraTangent { field_of_view: 1.0, ..CameraTangent::default() },
        ];
        let (h, u, t) = (1e-6, 8.3, 2.5);
        let camera = camera();
        let point = camera.position + t * camera.direction(u);
        let (by_point, by_camera) = camera.film_rate(u, t);
        let project = |camera: &Camera, p: DVec2| camera.project(p).expect("in front");
        for axis in [DVec2::X, DVec2::Y] {
            let found = (project(&camera, point + h * axis) - project(&camera, point - h * axis)) / (2.0 * h);
            assert!((found - by_point.dot(axis)).abs() < 1e-7);
        }
        let (_, direction) = camera.direction_rate(u);
        let (_, at_infinity) = camera.film_rate(u, f64::INFINITY);
        assert_eq!(at_infinity.position, DVec2::ZERO);
        for change in changes {
            let (plus, minus) = (moved(h, &change), moved(-h, &change));
            let found = (project(&plus, point) - project(&minus, point)) / (2.0 * h);
            assert!((found - by_camera.dot(&change)).abs() < 1e-7, "{change:?}");
            let turn = (plus.direction(u).to_angle() - minus.direction(u).to_angle()) / (2.0 * h);
            assert!((turn - direction.dot(&change)).abs() < 1e-7, "{change:?}");
        }
        // Along a line through the point, the distance changes with u.
        let (slope, distance) = (-0.7, |x: f64| t - 0.7 * (x - u));
        let (by_point, by_camera) = camera.film_rate_slope(u, t, slope);
        let rate = |x: f64| camera.film_rate(x, distance(x));
        let (plus, minus) = (rate(u + h), rate(u - h));
        assert!(((plus.0 - minus.0) / (2.0 * h) - by_point).length() < 1e-7);
        for change in changes {
            let found = (plus.1.dot(&change) - minus.1.dot(&change)) / (2.0 * h);
            assert!((found - by_camera.dot(&change)).abs() < 1e-7, "{change:?}");
        }
        let turn = (camera.direction(u + h).to_angle() - camera.direction(u - h).to_angle()) / (2.0 * h);
        assert!((turn - camera.direction_rate(u).0).abs() < 1e-7);
    }
}
