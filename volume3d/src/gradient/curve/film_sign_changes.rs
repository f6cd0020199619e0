//! Curves where a two-sided surface turns its other side to the camera (Theory 9).
//!
//! The side that reflects is that of the shading normal: with G = n_s·ω_o, the radiance is discontinuous at
//! G = 0, a curve within a triangle close to a silhouette. No field follows it. Let z be the film point and
//! the directions of a path, and let the integrand jump by Δf where G(z; θ) = 0. Along a change of variables
//! z → z + θ V(z),
//!
//! > |∇G| (v − V)·ν = −Ġ,
//!
//! with Ġ the derivative of G along the warped path: scene, film point and directions all move (Theory 7).
//!
//! The curve is sampled by its intersections with lines of the film: along a line of direction d with offset
//! h, dh = |ν·d| dl. Lines along x and along y are weighted by (ν·d)², so that no line tangent to the curve
//! has a large weight.

use flatland::calculus::Vec3;
use glam::{DMat3, DVec2, DVec3};

use super::address::{Address, FILM_SIGN_CHANGE};
use super::drawing::{CameraSubpath, Sensor, Table, Vertex, clear, largest};
use super::eye::Eye;
use super::field::WarpField;
use super::integral::{Curve, Difference};
use super::moving::Moving;
use crate::gradient::film::FilmPlane;
use crate::gradient::modes::differential::Differential;
use crate::path::{Calculus, Frame, Paths, Plain, Sequence, SurfacePoint};
use crate::scene::{Hit, NONE, Surface};

/// Distance from the curve, in pixels, at which the radiance on either side is evaluated; at least the
/// rounding of film points.
const ASIDE_PIXELS: f64 = 1e-6;

/// Half the step of central differences for ∇G, in pixels: their truncation error is its square, their
/// rounding error is inverse to it.
const STEP_PIXELS: f64 = 1e-4;

/// Least step in radians: rounding of directions is 10⁻⁶ of it.
const STEP: f64 = 1e-10;

/// A triangle that may turn its other side somewhere, with its bounding box on the film.
#[derive(Clone, Copy, Debug)]
struct Candidate {
    triangle: u32,
    low: DVec2,
    high: DVec2,
}

/// All candidate triangles, by the size of their boxes.
#[derive(Debug)]
pub(super) struct FilmSignChanges<'a, V> {
    sensor: Sensor<'a>,
    field: V,
    candidates: Vec<Candidate>,
    table: Table,
}

impl<'a, V: WarpField> FilmSignChanges<'a, V> {
    pub(super) fn new(paths: &'a Paths<'a>, moving: &Moving, field: V) -> Self {
        let scene = paths.scene;
        let (sensor, candidates, table) = (Sensor::new(paths), vec![], Table::default());
        let mut sign_changes = Self { sensor, field, candidates, table };
        for (t, triangle) in scene.triangles.iter().enumerate() {
            let moves = moving.camera || moving.shapes[triangle.shape as usize];
            if moves && triangle.normals[0] != NONE {
                sign_changes.candidates.extend(sign_changes.candidate(t as u32));
            }
        }
        let size = |c: &Candidate| (c.high - c.low).element_sum();
        sign_changes.table = Table::new(sign_changes.candidates.iter().map(size));
        sign_changes
    }

    fn normals(&self, triangle: u32) -> [DVec3; 3] {
        let scene = self.sensor.paths.scene;
        scene.triangles[triangle as usize].normals.map(|i| scene.normals[i as usize])
    }

    fn candidate(&self, triangle: u32) -> Option<Candidate> {
        let scene = self.sensor.paths.scene;
        let origin = self.sensor.frame.origin.value();
        let (p, n) = (scene.corners(triangle).map(|p| p - origin), self.normals(triangle));
        let film = &self.sensor.film;
        // G is a quadratic form in barycentric coordinates: it has one sign if all its coefficients do, for
        // all points of a lens.
        let form = |i: usize, j: usize| n[i].dot(p[j]) + n[j].dot(p[i]);
        let range = |i: usize, j: usize| film.lens_radius() * (n[i].length() + n[j].length());
        let all = [(0, 0), (1, 1), (2, 2), (0, 1), (1, 2), (2, 0)].map(|(i, j)| (form(i, j), range(i, j)));
        if all.iter().all(|&(f, range)| f > range) || all.iter().all(|&(f, range)| f < -range) {
            return None;
        }
        let (mut low, mut high) = film.bounds();
        let forward = self.sensor.frame.forward.value();
        if p.iter().all(|p| p.dot(forward) > 0.0) {
            let ends = p.map(|p| DVec2::from(film.project(&self.sensor.frame, Vec3::constant(origin + p))));
            // Defocus widens the box; 1/z has its extremes at corners.
            let spread = p.map(|p| film.confusion(p.dot(forward)));
            let spread = spread[0].max(spread[1]).max(spread[2]);
            low = low.max(ends[0].min(ends[1]).min(ends[2]) - spread);
            high = high.min(ends[0].max(ends[1]).max(ends[2]) + spread);
        } else if p.iter().all(|p| p.dot(forward) <= 0.0) {
            return None;
        }
        (low.x < high.x && low.y < high.y).then_some(Candidate { triangle, low, high })
    }

    /// Points on the line from u along d where the plane of a triangle turns its other side.
    fn roots(&self, film: &FilmPlane, triangle: u32, u: DVec2, d: DVec2) -> impl Iterator<Item = DVec2> {
        let origin = film.still.origin.value();
        let place = DMat3::from_cols_array_2d(
            &self.sensor.paths.scene.corners(triangle).map(|p| (p - origin).to_array()),
        );
        let normals = DMat3::from_cols_array_2d(&self.normals(triangle).map(|n| n.to_array()));
        let inverse = place.inverse();
        // Rays of a line are D(τ) = D₀ + τ D₁ up to a factor, with barycentric coordinates P⁻¹ D.
        let forward = film.forward();
        let ray = |u: DVec2| {
            let w = film.ray(u);
            w / w.dot(forward)
        };
        let (d0, d1) = (ray(u), ray(u + d) - ray(u));
        let (n0, n1) = (normals * (inverse * d0), normals * (inverse * d1));
        let [a, b, c] = [n1.dot(d1), n0.dot(d1) + n1.dot(d0), n0.dot(d0)];
        let root = (b * b - 4.0 * a * c).sqrt();
        // Stable for small a; NaN if there is no root.
        let q = -0.5 * (b + root.copysign(b));
        [q / a, c / q].into_iter().filter(|t| t.is_finite()).map(move |t| u + t * d)
    }

    /// G at a film point, over numbers.
    fn cosine<C: Calculus>(&self, calculus: &C, eye: &Eye<'_, C::Number>, surface: Surface) -> C::Number {
        let scene = self.sensor.paths.scene;
        let direction = eye.film.direction(&eye.frame, eye.at);
        // Only triangles interpolate normals, and their distance follows from their plane.
        let distance = f64::NAN;
        let point = SurfacePoint::new(scene, calculus, eye.frame.origin, direction, surface, distance);
        point.interpolated_normal(scene, calculus).dot(point.viewer)
    }
}

/// A film point at which a triangle turns its other side.
#[derive(Debug)]
pub(super) struct Turn {
    hit: Hit,
    /// Unit vector along ∇G.
    normal: DVec2,
    /// 1/|∇G| divided by the density of the point.
    weight: f64,
    /// Random numbers of the paths on both sides.
    numbers: Sequence,
}

impl<V: WarpField> Curve for FilmSignChanges<'_, V> {
    type Field = V;
    type Point = Turn;

    fn field(&self) -> &V {
        &self.field
    }

    fn is_empty(&self) -> bool {
        self.table.total() <= 0.0
    }

    fn draw(&self, address: Address, found: &mut impl FnMut(&CameraSubpath<'_>, &Turn)) {
        let scene = self.sensor.paths.scene;
        let mut numbers = address.numbers(FILM_SIGN_CHANGE);
        let chosen = self.table.at(address.fraction(&mut numbers));
        let Sensor { film, frame: still, .. } = self.sensor.through(&mut numbers);
        let Candidate { triangle, low, high } = self.candidates[chosen.index];
        // The remainder of the random number selects a row or a column through the box.
        let size = high - low;
        let offset = chosen.rest * size.element_sum();
        let (u, d) = if offset < size.y {
            (DVec2::new(low.x, low.y + offset), DVec2::X)
        } else {
            (DVec2::new(low.x + offset - size.y, low.y), DVec2::Y)
        };
        let surface = Surface::Triangle(triangle);
        let step = STEP_PIXELS.max(STEP * film.pixels_by_angle());
        let plain = Plain { scene };
        let (origin, ray) = (still.origin.value(), |u: DVec2| film.direction(&still, [u.x, u.y]).value());
        for at in self.roots(&film, triangle, u, d) {
            let inside =
                (at - low).min_element() >= -ASIDE_PIXELS && (high - at).min_element() >= -ASIDE_PIXELS;
            if !inside {
                continue;
            }
            let direction = ray(at);
            let hit = scene.closest(origin, direction, None);
            let Some(hit) = hit.filter(|h| h.surface == surface) else { continue };
            let value = |step: DVec2| self.cosine(&plain, &Eye::still(&film, still, at + step), surface);
            let slope = |d: DVec2| (value(step * d) - value(-step * d)) / (2.0 * step);
            let gradient = DVec2::new(slope(DVec2::X), slope(DVec2::Y));
            let steepness = gradient.length();
            let normal = gradient / steepness;
            // (ν·d)² / |ν·d| divided by the density of lines.
            let weight = normal.dot(d).abs() * self.table.total() / steepness;
            let vertex = Vertex { position: origin + direction * hit.distance, surface };
            let path = CameraSubpath { film: &film, at, vertices: &[vertex], weight: DVec3::ONE };
            found(&path, &Turn { hit, normal, weight, numbers: numbers.clone() });
        }
    }

    fn difference(&self, path: &CameraSubpath<'_>, turn: &Turn) -> Difference {
        let (paths, film) = (self.sensor.paths, path.film);
        let distance = turn.hit.distance;
        let corners = turn.hit.surface.triangle().map(|t| paths.scene.corners(t));
        let largest = corners.map_or(0.0, |corners| largest(&corners)).max(distance);
        let aside = ASIDE_PIXELS.max(clear(largest, distance) * film.pixels_by_angle());
        let [before, behind] = [-1.0, 1.0].map(|side| {
            let direction = film.ray(path.at + side * aside * turn.normal);
            let (origin, mut numbers) = (film.still.origin.value(), turn.numbers.clone());
            if self.field.splits() {
                paths.still_radiance_of_first(origin, direction, Some(turn.hit), 1, &mut numbers)
            } else {
                paths.still_radiance(origin, direction, Some(turn.hit), 1, &mut numbers)
            }
        });
        Difference::of((before - behind) * turn.weight)
    }

    fn speed<C: Differential>(
        &self,
        calculus: &mut C,
        frame: &Frame<C::Number>,
        path: &CameraSubpath<'_>,
        turn: &Turn,
    ) -> C::Number {
        let eye = Eye::of::<V, C>(calculus, frame, path);
        -self.cosine(calculus, &eye, turn.hit.surface)
    }
}
