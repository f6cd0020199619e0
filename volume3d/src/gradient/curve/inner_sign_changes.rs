//! Curves where a two-sided surface turns its other side to an earlier vertex of a path (Theory 9).
//!
//! As on the film (see [`film_sign_changes`](super::film_sign_changes)), the radiance from a point x of a
//! surface towards a point y is discontinuous at G = n_s(x)·d = 0, with n_s the interpolated normal and d the
//! direction from x to y. Over all points y the boundary term is
//!
//! > ∫∫ f ΔL (−Ġ) |n_x·d| dφ dA_x,
//!
//! with φ the angle along the great circle of directions orthogonal to n_s: sample a surface point and a
//! direction orthogonal to its shading normal, and trace to y. |n_x·d| is at most the sine of the angle
//! between the two normals.

use std::f64::consts::TAU;

use glam::DVec3;

use super::address::{Address, BEFORE_SIGN_CHANGE, INNER_SIGN_CHANGE};
use super::drawing::{CameraSubpath, Sensor, Table, Vertex, clear, largest, reflects};
use super::eye::end_of;
use super::field::WarpField;
use super::integral::{Curve, Difference};
use super::moving::Moving;
use crate::gradient::modes::differential::Differential;
use crate::path::{Frame, Paths, Sequence, SurfacePoint};
use crate::scene::{Hit, NONE, Scene, Surface};

/// Angle, in radians, between the plane where the surface turns and the viewers for which the radiance on
/// either side is evaluated; at least the angle of rounding at a triangle of its size. The error is of the
/// same order.
const ASIDE: f64 = 1e-6;

/// Triangles that may turn their other side to other surfaces.
#[derive(Debug)]
pub(super) struct InnerSignChanges<'a, V> {
    sensor: Sensor<'a>,
    field: V,
    moving: &'a Moving,
    table: Table,
    /// Largest number of path segments before the one that turns: at least two are left.
    longest: usize,
}

impl<'a, V: WarpField> InnerSignChanges<'a, V> {
    pub(super) fn new(paths: &'a Paths<'a>, moving: &'a Moving, field: V) -> Self {
        let scene = paths.scene;
        let limit = scene.description.integrator.max_depth.unwrap_or(usize::MAX);
        let longest = limit.saturating_sub(2);
        let mut table = Table::default();
        if longest > 0 && moving.anything() {
            let mut weights: Vec<f64> =
                (0..scene.triangles.len() as u32).map(|t| deviation(scene, t)).collect();
            let moves = |t: usize| moving.shapes[scene.triangles[t].shape as usize];
            moving.limit_still(&mut weights, moves);
            table = Table::new(weights);
        }
        Self { sensor: Sensor::new(paths), field, moving, table, longest }
    }

    fn moves(&self, surface: Surface) -> bool {
        self.moving.camera || self.moving.shapes[self.sensor.paths.scene.shape_of(surface) as usize]
    }
}

/// A surface point that turns its other side in a direction.
#[derive(Clone, Copy, Debug)]
struct Turn {
    surface: Surface,
    weights: [f64; 3],
    point: DVec3,
    /// Shading normal.
    normal: DVec3,
    towards: DVec3,
    /// Length scale of the triangle.
    size: f64,
    /// Largest coordinate.
    largest: f64,
}

impl Turn {
    /// The point as the next vertex of a path.
    fn next(&self) -> Vertex {
        Vertex { position: self.point, surface: self.surface }
    }

    fn draw(scene: &Scene, triangle: u32, numbers: &mut Sequence) -> Option<Self> {
        let ([a, b], turn) = (numbers.pair(), numbers.one());
        let root = a.sqrt();
        let weights = [1.0 - root, root * (1.0 - b), root * b];
        let mix = |v: [DVec3; 3]| v[0] * weights[0] + v[1] * weights[1] + v[2] * weights[2];
        let p = scene.corners(triangle);
        let normal = mix(normals(scene, triangle)).try_normalize()?;
        let (s, t) = normal.any_orthonormal_pair();
        let (sin, cos) = (TAU * turn).sin_cos();
        let size = p[0].distance(p[1]).max(p[0].distance(p[2]));
        let (surface, largest, towards) = (Surface::Triangle(triangle), largest(&p), cos * s + sin * t);
        Some(Self { surface, weights, point: mix(p), normal, towards, size, largest })
    }
}

fn normals(scene: &Scene, triangle: u32) -> [DVec3; 3] {
    scene.triangles[triangle as usize].normals.map(|i| scene.normals[i as usize])
}

/// A triangle's area times the largest sine of the angle between its own normal and that of a corner; 0 if it
/// does not reflect.
fn deviation(scene: &Scene, triangle: u32) -> f64 {
    let t = &scene.triangles[triangle as usize];
    if t.normals[0] == NONE || !reflects(scene, triangle) {
        return 0.0;
    }
    let [a, b, c] = scene.corners(triangle);
    let face = (b - a).cross(c - a);
    normals(scene, triangle).map(|n| 0.5 * n.cross(face).length()).into_iter().fold(0.0, f64::max)
}

/// A surface that turns its other side to the last vertex of a path.
#[derive(Debug)]
pub(super) struct Seen {
    turn: Turn,
    /// |n_x·d| divided by the density.
    scale: f64,
    /// Random numbers of the paths on both sides.
    numbers: Sequence,
}

impl<V: WarpField> Curve for InnerSignChanges<'_, V> {
    type Field = V;
    type Point = Seen;

    fn field(&self) -> &V {
        &self.field
    }

    fn is_empty(&self) -> bool {
        self.table.total() <= 0.0
    }

    fn draw(&self, address: Address, found: &mut impl FnMut(&CameraSubpath<'_>, &Seen)) {
        let paths = self.sensor.paths;
        let scene = paths.scene;
        let mut numbers = address.numbers(INNER_SIGN_CHANGE);
        let chosen = self.table.at(address.fraction(&mut numbers));
        let triangle = chosen.index as u32;
        let Some(turn) = Turn::draw(scene, triangle, &mut numbers) else { return };
        let Some(hit) = scene.closest(turn.point, turn.towards, Some(turn.surface)) else { return };
        if self.longest == 1 && !self.moves(turn.surface) && !self.moves(hit.surface) {
            return;
        }
        let start = Vertex { position: turn.point + turn.towards * hit.distance, surface: hit.surface };
        let [a, b, c] = scene.corners(triangle);
        // |n_x·d| dA divided by the density of points and angles.
        let scale = 0.5 * (b - a).cross(c - a).dot(turn.towards).abs() * TAU / chosen.probability;
        let mut backwards = address.numbers(BEFORE_SIGN_CHANGE);
        let seen = Seen { turn, scale, numbers };
        self.sensor.each_subpath(start, -turn.towards, self.longest, &mut backwards, |path| {
            found(&path, &seen);
        });
    }

    /// Radiance from x less that from its other side, for a viewer on the plane between.
    fn difference(&self, path: &CameraSubpath<'_>, Seen { turn, scale, numbers }: &Seen) -> Difference {
        let paths = self.sensor.paths;
        let depth = path.vertices.len() + 1;
        let angle = ASIDE.max(clear(turn.largest, turn.size));
        let [before, behind] = [-1.0, 1.0].map(|side| {
            let towards = (turn.towards + side * angle * turn.normal).normalize();
            // Any point on the line is equivalent; at a distance of the triangle's size rounding is harmless.
            let viewer = turn.point + turn.size * towards;
            let hit = Hit { surface: turn.surface, distance: turn.size, coordinates: turn.weights };
            let mut numbers = numbers.clone();
            if self.field.splits() {
                paths.still_radiance_of_first(viewer, -towards, Some(hit), depth, &mut numbers)
            } else {
                paths.still_radiance(viewer, -towards, Some(hit), depth, &mut numbers)
            }
        });
        Difference::of((before - behind) * (path.weight * *scale))
    }

    fn speed<C: Differential>(
        &self,
        calculus: &mut C,
        frame: &Frame<C::Number>,
        path: &CameraSubpath<'_>,
        Seen { turn, .. }: &Seen,
    ) -> C::Number {
        let paths = self.sensor.paths;
        let (origin, direction) = end_of::<V, C>(paths, calculus, frame, path, Some(&turn.next()));
        // Only triangles interpolate normals, and their distance follows from their plane.
        let distance = f64::NAN;
        let point = SurfacePoint::new(paths.scene, calculus, origin, direction, turn.surface, distance);
        -point.interpolated_normal(paths.scene, calculus).dot(point.viewer)
    }
}
