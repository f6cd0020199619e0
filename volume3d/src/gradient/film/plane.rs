//! The film: positions of samples, and the motion of projected points.

use std::f64::consts::TAU;

use flatland::calculus::{Number, Vec3};
use glam::{DVec2, DVec3};

use super::cut::Cut;
use super::rounding;
use crate::gradient::{CameraTangent, NonFinite};
use crate::path::{Calculus, Draws, Frame};
use crate::scene::{Camera, Filter, Lens, Scene};

/// The image plane in pixels, x to the right and y down from the top left corner of the whole film.
#[derive(Clone, Copy, Debug)]
pub(crate) struct FilmPlane {
    pub(crate) columns: usize,
    pub(crate) rows: usize,
    /// Width, in cells, of the margin around the image into which samples fall.
    pub(crate) reach: usize,
    /// Position of the image's first pixel.
    pub(super) corner: DVec2,
    /// Principal point: where the camera's axis meets the film.
    pub(super) centre: DVec2,
    /// Ratio of focal lengths f_y/f_x.
    pub(super) aspect: f64,
    pub(super) filter: Filter,
    /// What the border cuts off filters, if it does.
    pub(super) cut: Option<Cut>,
    /// The camera's frame as it stands; its origin is the point of the lens that is looked through.
    pub(crate) still: Frame<f64>,
    pub(super) lens: Option<Lens>,
    /// From the camera's pivot to that point; nonzero only for lenses and orthographic sensors.
    pub(super) offset: DVec3,
    /// From that point to the camera's origin; nonzero only for orthographic sensors.
    pub(super) arm: DVec3,
    /// Offset of the lens point, to the right and up, divided by the focus distance: directions of a film
    /// point through two lens points differ by it.
    pub(super) shear: DVec2,
    /// df/d(field of view), with f = (W/2)/tan(fov/2); 0 for an orthographic sensor, which has no field of
    /// view.
    pub(super) focal_rate: f64,
    /// Half width of a pixel's border, in pixels: points within it count as on the border.
    pub(super) border: f64,
}

impl FilmPlane {
    pub(crate) fn new(scene: &Scene) -> Self {
        let (film, camera) = (&scene.description.film, scene.camera());
        let (columns, rows) = scene.size();
        let corner = film.crop.map_or(DVec2::ZERO, |c| DVec2::new(c.x as f64, c.y as f64));
        let focal = focal_length(camera, film.width);
        let arm = camera.orthographic.map_or(DVec3::ZERO, |distance| -distance * camera.forward);
        Self {
            columns,
            rows,
            // Edges of box pixels belong to the cells on both sides.
            reach: ((film.filter.radius() - 0.5).ceil() as usize).max(1),
            corner,
            centre: (camera.principal_point + 0.5) * DVec2::new(film.width as f64, film.height as f64),
            aspect: camera.pixel_aspect,
            filter: film.filter,
            cut: Cut::of(film),
            still: Frame {
                origin: Vec3::constant(camera.origin),
                right: Vec3::constant(camera.right),
                up: Vec3::constant(camera.up),
                forward: Vec3::constant(camera.forward),
                focal,
            },
            focal_rate: camera.orthographic.map_or(focal_rate(focal, camera.field_of_view), |_| 0.0),
            border: rounding::width(scene, focal * camera.pixel_aspect.max(1.0)),
            lens: camera.lens,
            offset: arm,
            arm,
            shear: DVec2::ZERO,
        }
    }

    /// Whether the camera has a lens, so that [`through`](Self::through) is random.
    pub(crate) fn has_lens(&self) -> bool {
        self.lens.is_some()
    }

    /// The film through a random point of the lens, if there is one.
    pub(crate) fn through(&self, numbers: &mut Draws<'_>) -> Self {
        let Some(Lens { radius, focus_distance }) = self.lens else { return *self };
        let [a, b] = numbers.pair();
        let (sin, cos) = (TAU * b).sin_cos();
        let point = DVec2::new(cos, sin) * (radius * a.sqrt());
        let (right, up) = (self.still.right.value(), self.still.up.value());
        let offset = self.arm + (right * point.x + up * point.y);
        let origin = Vec3::constant(self.still.origin.value() - self.offset + offset);
        Self { still: Frame { origin, ..self.still }, offset, shear: point / focus_distance, ..*self }
    }

    /// A ray of the static camera through a film point and a random point of the lens, if there is one.
    pub(crate) fn ray_through(&self, u: DVec2, numbers: &mut Draws<'_>) -> (DVec3, DVec3) {
        if self.has_lens() {
            let film = self.through(numbers);
            (film.still.origin.value(), film.ray(u))
        } else {
            (self.still.origin.value(), self.ray(u))
        }
    }

    /// Radius of the lens; 0 for a pinhole.
    pub(crate) fn lens_radius(&self) -> f64 {
        self.lens.map_or(0.0, |lens| lens.radius)
    }

    /// Bound on the displacement, at a given depth, of points that other lens points see at the same film
    /// point: in units of length, along columns larger by the aspect ratio.
    pub(crate) fn beside(&self, depth: f64) -> DVec2 {
        let shift = |lens: Lens| lens.radius * (1.0 + depth.abs() / lens.focus_distance);
        self.lens.map_or(DVec2::ZERO, |lens| DVec2::new(1.0, self.aspect) * shift(lens))
    }

    /// Half axes, in pixels, of the ellipse of confusion of a point at a given depth.
    pub(crate) fn confusion(&self, depth: f64) -> DVec2 {
        let defocus = |lens: Lens| lens.radius * (1.0 / depth - 1.0 / lens.focus_distance).abs();
        self.lens
            .map_or(DVec2::ZERO, |lens| DVec2::new(1.0, self.aspect) * (self.still.focal * defocus(lens)))
    }

    /// The camera frame over numbers through this lens point, given that of a pinhole.
    pub(crate) fn frame_through<C: Calculus>(
        &self,
        calculus: &C,
        pinhole: &Frame<C::Number>,
    ) -> Frame<C::Number> {
        if self.has_lens() { self.moving_frame(calculus) } else { *pinhole }
    }

    /// Velocity of the sampled lens point.
    pub(crate) fn origin_rate(&self, camera: &CameraTangent) -> DVec3 {
        if self.turns_in_place() {
            camera.translation
        } else {
            camera.translation + camera.rotation.cross(self.offset)
        }
    }

    /// Inverse of the distance at which the background is followed: 0 for infinity. For an orthographic
    /// sensor it is that of the sensor: a background at infinity would move on the film 10⁴ times as fast as
    /// all else when the camera rotates.
    pub(crate) fn background(&self) -> f64 {
        if self.arm == DVec3::ZERO { 0.0 } else { self.arm.length().recip() }
    }

    /// Whether the camera rotates about the sampled point.
    fn turns_in_place(&self) -> bool {
        self.offset == DVec3::ZERO
    }

    /// Transpose of [`origin_rate`](Self::origin_rate): covector of the rotation; that of the translation is
    /// the argument itself.
    pub(crate) fn origin_rate_transpose(&self, covector: DVec3) -> DVec3 {
        self.offset.cross(covector)
    }

    /// The pixel filter.
    pub(crate) fn filter(&self) -> Filter {
        self.filter
    }

    /// Whether the filter is the pixel itself.
    pub(crate) fn is_box(&self) -> bool {
        self.filter == Filter::Box
    }

    /// A point of the cell (i, j), counted from the image's first pixel less the filter's reach.
    pub(crate) fn point(&self, i: usize, j: usize, within: [f64; 2]) -> DVec2 {
        let reach = self.reach as f64;
        self.corner + DVec2::new(i as f64 - reach + within[0], j as f64 - reach + within[1])
    }

    /// Columns and rows of cells that receive samples.
    pub(crate) fn cells(&self) -> (usize, usize) {
        (self.columns + 2 * self.reach, self.rows + 2 * self.reach)
    }

    /// Whether samples of a cell reach any pixel.
    pub(crate) fn cell_counts(&self, i: usize, j: usize) -> bool {
        !self.ends_at_border() || self.is_within([i, j])
    }

    /// Image column that is the `a`-th of the neighbourhood of cells in column `i`.
    pub(crate) fn pixel_column(&self, i: usize, a: usize) -> Option<usize> {
        (i + a).checked_sub(2 * self.reach).filter(|&x| x < self.columns)
    }

    /// Image row that is the `b`-th of the neighbourhood of cells in row `j`.
    pub(crate) fn pixel_row(&self, j: usize, b: usize) -> Option<usize> {
        (j + b).checked_sub(2 * self.reach).filter(|&y| y < self.rows)
    }

    /// Location of a non-finite sample.
    pub(crate) fn located(&self, i: usize, j: usize, sample: usize) -> NonFinite {
        let reach = self.reach as isize;
        NonFinite { column: i as isize - reach, row: j as isize - reach, sample }
    }

    /// The camera frame over numbers.
    pub(crate) fn moving_frame<C: Calculus>(&self, calculus: &C) -> Frame<C::Number> {
        let motion = calculus.camera();
        let Frame { origin, right, up, forward, focal } = self.still;
        let turned = |axis: Vec3<f64>| Vec3::turned(axis.value(), motion.map(|m| m.rotation));
        let (origin, focal) = (Vec3::constant(origin.value()), C::Number::constant(focal));
        Frame {
            origin: motion.map_or(origin, |m| match self.turns_in_place() {
                true => origin + m.translation,
                false => origin + m.translation + m.rotation.cross(Vec3::constant(self.offset)),
            }),
            right: turned(right),
            up: turned(up),
            forward: turned(forward),
            focal: motion.map_or(focal, |m| focal + m.field_of_view * self.focal_rate),
        }
    }

    /// Direction of the ray through a film point.
    pub(crate) fn direction<T: Number>(&self, frame: &Frame<T>, [x, y]: [T; 2]) -> Vec3<T> {
        let a = (x - T::constant(self.centre.x)) / frame.focal;
        let b = (T::constant(self.centre.y) - y) / (frame.focal * self.aspect);
        let (a, b) = match self.lens {
            None => (a, b),
            Some(_) => (a - T::constant(self.shear.x), b - T::constant(self.shear.y)),
        };
        (frame.forward + frame.right * a + frame.up * b).normalized()
    }

    /// Direction of the ray through a film point for the static camera.
    #[inline]
    pub(crate) fn ray(&self, u: DVec2) -> DVec3 {
        self.direction(&self.still, [u.x, u.y]).value()
    }

    /// Lower bound on film motion, in pixels per radian, of a ray at angle θ to the camera's axis: f/cos θ
    /// around the axis, and 1/cos θ times as much towards it.
    pub(crate) fn scale(&self, direction: DVec3) -> f64 {
        self.still.focal * self.aspect.min(1.0) / direction.dot(self.forward())
    }

    /// Film area, in pixels, of a unit area perpendicular to the camera's axis at distance 1.
    pub(crate) fn focal_area(&self) -> f64 {
        self.still.focal * self.still.focal * self.aspect
    }

    /// Ratio of focal lengths, columns to rows.
    pub(crate) fn aspect(&self) -> f64 {
        self.aspect
    }

    /// Upper bound on pixels per radian.
    pub(crate) fn pixels_by_angle(&self) -> f64 {
        let (low, high) = self.bounds();
        let farthest = (low - self.centre).abs().max((high - self.centre).abs());
        let focal = self.still.focal;
        (focal + farthest.length_squared() / focal) * self.aspect.max(1.0)
    }

    /// Width in radians of a pixel at the principal point.
    pub(crate) fn pixel_angle(&self) -> f64 {
        1.0 / self.still.focal
    }

    /// Velocity of the direction of a fixed film point per unit rate of the field of view.
    pub(crate) fn zoom(&self, direction: DVec3) -> DVec3 {
        let across = self.across(direction);
        (across - across.dot(direction) * direction) * self.growth()
    }

    /// Component of a vector orthogonal to the camera's axis, relative to the principal ray at the same
    /// depth: the part that scales with the image.
    pub(crate) fn across(&self, way: DVec3) -> DVec3 {
        let across = way - self.forward() * self.forward().dot(way);
        if self.has_lens() { across + self.sheared() * self.forward().dot(way) } else { across }
    }

    /// The transpose of [`across`](Self::across).
    pub(crate) fn across_transpose(&self, covector: DVec3) -> DVec3 {
        let across = covector - self.forward() * self.forward().dot(covector);
        if self.has_lens() { across + self.forward() * self.sheared().dot(covector) } else { across }
    }

    fn sheared(&self) -> DVec3 {
        self.still.right.value() * self.shear.x + self.still.up.value() * self.shear.y
    }

    /// Relative growth of the image per radian of field of view.
    pub(crate) fn growth(&self) -> f64 {
        self.focal_rate / self.still.focal
    }

    /// Projection of a point in front of the camera onto the film.
    pub(crate) fn project<T: Number>(&self, frame: &Frame<T>, point: Vec3<T>) -> [T; 2] {
        let way = point - frame.origin;
        let scale = frame.focal / way.dot(frame.forward);
        let (right, up) = (way.dot(frame.right) * scale, way.dot(frame.up) * scale * self.aspect);
        let (right, up) = match self.lens {
            None => (right, up),
            Some(_) => (right + frame.focal * self.shear.x, up + frame.focal * (self.aspect * self.shear.y)),
        };
        [T::constant(self.centre.x) + right, T::constant(self.centre.y) - up]
    }

    /// The cell of a film point, if samples there reach any pixel.
    pub(crate) fn cell(&self, u: DVec2) -> Option<(usize, usize)> {
        let u = if self.ends_at_border() { self.within_borders(u) } else { u };
        let at = (u - self.corner).floor() + self.reach as f64;
        let (i, j) = (at.x as usize, at.y as usize);
        let (columns, rows) = self.cells();
        let inside = at.min_element() >= 0.0 && i < columns && j < rows;
        (inside && self.cell_counts(i, j)).then_some((i, j))
    }

    /// Lower and upper corner of all cells whose samples may count.
    pub(crate) fn bounds(&self) -> (DVec2, DVec2) {
        if self.is_cut() {
            let (low, high) = self.image();
            return (low - 2.0 * self.border, high + 2.0 * self.border);
        }
        let reach = self.reach as f64;
        let size = DVec2::new(self.columns as f64, self.rows as f64);
        (self.corner - reach, self.corner + size + reach)
    }

    /// Jacobian of the film point with respect to direction.
    pub(crate) fn jacobian(&self, direction: DVec3) -> FilmJacobian {
        let Frame { right, up, forward, focal, .. } = self.still;
        let (right, up, forward) = (right.value(), up.value(), forward.value());
        let depth = direction.dot(forward);
        let (a, b) = (direction.dot(right) / depth, direction.dot(up) / depth);
        let (across, down) = (focal / depth, focal * self.aspect / depth);
        FilmJacobian([(right - a * forward) * across, (b * forward - up) * down])
    }

    /// The static camera's axis.
    pub(crate) fn forward(&self) -> DVec3 {
        self.still.forward.value()
    }
}

/// ∂u/∂ω in pixels, 2 × 3; see [`FilmPlane::jacobian`].
#[derive(Clone, Copy, Debug)]
pub(crate) struct FilmJacobian([DVec3; 2]);

impl FilmJacobian {
    /// u̇ from the velocity of the direction.
    pub(crate) fn apply(&self, velocity: DVec3) -> DVec2 {
        DVec2::new(self.0[0].dot(velocity), self.0[1].dot(velocity))
    }

    /// Transpose of [`apply`](Self::apply): covector of the direction's velocity, from that of u̇.
    pub(crate) fn transpose(&self, covector: DVec2) -> DVec3 {
        self.0[0] * covector.x + self.0[1] * covector.y
    }
}

fn focal_length(camera: &Camera, width: usize) -> f64 {
    0.5 * width as f64 / (0.5 * camera.field_of_view).tan()
}

fn focal_rate(focal: f64, field_of_view: f64) -> f64 {
    // d(1/tan(φ/2))/dφ = −1/(2 sin²(φ/2)) = −1/(tan(φ/2) sin φ)
    -focal / field_of_view.sin()
}
