//! Horizon of a face with shading normals (Theory 9).
//!
//! A ray that leaves a triangle never hits the same triangle. Directions ω on the two sides of the face's
//! plane see different surfaces, and a shading normal n_s reflects from both: reflected radiance is
//! discontinuous at n·ω = 0, with n the face's normal. As the face rotates, so does that great circle: with
//! ν = n, v·ν = −ω·ṅ, also as a point slides over the face. The curve consists of the triangle's own edges
//! seen from within its plane, where the directions through edge points that
//! [`edge_lines`](super::edge_lines) draws never lie.
//!
//! With V = 0 all light beyond a horizon counts. A field within lobes follows the edges; where shadows are
//! sampled, it is 0 towards lights, and the light of next-event estimation counts.

use flatland::calculus::Vec3;
use glam::DVec3;

use super::address::{Address, BEYOND_HORIZON, HORIZON};
use super::drawing::{CameraSubpath, Sensor, Table, Walk, aside};
use super::field::WarpField;
use super::integral::{Curve, Difference};
use super::moving::Moving;
use crate::gradient::modes::differential::Differential;
use crate::path::{Frame, Paths, Sequence, Shading};
use crate::scene::{Hit, NONE, Surface};

/// Horizons seen from shading points.
#[derive(Debug)]
pub(super) struct Horizons<'a, V> {
    field: V,
    walk: Walk<'a>,
    moving: &'a Moving,
    empty: bool,
    /// Emitting triangles, by area.
    emitters: Vec<u32>,
    table: Table,
}

/// A direction in the plane of a face, the length of curve per unit of density, and the emitter it was
/// sampled for.
struct Drawn {
    direction: DVec3,
    length: f64,
    emitter: Option<u32>,
}

impl<'a, V: WarpField> Horizons<'a, V> {
    pub(super) fn new(paths: &'a Paths<'a>, moving: &'a Moving, field: V) -> Self {
        let scene = paths.scene;
        let limit = scene.description.integrator.max_depth.unwrap_or(usize::MAX);
        let bends = scene.triangles.iter().any(|t| t.normals[0] != NONE && moving.shapes[t.shape as usize]);
        let emits = |t: &u32| {
            let shape = scene.triangles[*t as usize].shape as usize;
            scene.description.shapes[shape].radiance.is_some()
        };
        let emitters: Vec<u32> = (0..scene.triangles.len() as u32).filter(emits).collect();
        let area = |&t: &u32| {
            let [a, b, c] = scene.corners(t);
            (b - a).cross(c - a).length()
        };
        let table = Table::new(emitters.iter().map(area));
        let empty = limit < 2 || !bends;
        let walk = Walk::new(Sensor::new(paths), moving, limit.saturating_sub(1));
        Self { field, walk, moving, empty, emitters, table }
    }

    /// Two directions in the plane through x: one towards an emitter that the plane cuts, one uniform.
    fn directions(&self, x: DVec3, normal: DVec3, numbers: &mut Sequence) -> [Option<Drawn>; 2] {
        let (choice, [a, b]) = (numbers.one(), numbers.pair());
        let (s, t) = normal.any_orthonormal_pair();
        let (sin, cos) = (std::f64::consts::TAU * b).sin_cos();
        let any = Drawn { direction: cos * s + sin * t, length: std::f64::consts::TAU, emitter: None };
        let chord = || {
            if self.table.total() <= 0.0 {
                return None;
            }
            let chosen = self.table.at(choice);
            let emitter = self.emitters[chosen.index];
            let corners = self.walk.sensor.paths.scene.corners(emitter);
            let heights = corners.map(|p| (p - x).dot(normal));
            let cut = |i: usize, j: usize| {
                let (f, g) = (heights[i], heights[j]);
                ((f > 0.0) != (g > 0.0)).then(|| corners[i].lerp(corners[j], f / (f - g)))
            };
            let ends: Vec<DVec3> = [(0, 1), (1, 2), (2, 0)].iter().filter_map(|&(i, j)| cut(i, j)).collect();
            let &[p, q] = ends.as_slice() else { return None };
            let way = p.lerp(q, a) - x;
            let direction = way.try_normalize()?;
            // dl = |chord × ω|/t ds
            let length = (q - p).cross(direction).length() / way.length() / chosen.probability;
            Some(Drawn { direction, length, emitter: Some(emitter) })
        };
        [chord(), Some(any)]
    }

    /// Calls back with the points of the horizon that the last vertex of a path is given to see.
    fn look(
        &self,
        subpath: &CameraSubpath<'_>,
        shading: &Shading<'_, f64>,
        numbers: (&mut Sequence, &Sequence),
        mut found: impl FnMut(&Point),
    ) {
        let scene = self.walk.sensor.paths.scene;
        let x = subpath.vertices[0];
        let Surface::Triangle(index) = x.surface else { return };
        let triangle = &scene.triangles[index as usize];
        if triangle.normals[0] == NONE || !self.moving.shapes[triangle.shape as usize] {
            return;
        }
        let [a, b, c] = scene.corners(index);
        let Some(normal) = (b - a).cross(c - a).try_normalize() else { return };
        for drawn in self.directions(x.position, normal, numbers.0).into_iter().flatten() {
            let reflected = shading.evaluate(Vec3::constant(drawn.direction)).value();
            if reflected == DVec3::ZERO {
                continue;
            }
            let difference = self.light(subpath, (index, normal), &drawn, numbers.1);
            let light = reflected * difference * subpath.weight * drawn.length;
            if light == DVec3::ZERO {
                continue;
            }
            found(&Point { triangle: index, direction: drawn.direction, light });
        }
    }

    /// Radiance below the horizon less that above it.
    fn light(
        &self,
        subpath: &CameraSubpath<'_>,
        (triangle, normal): (u32, DVec3),
        drawn: &Drawn,
        numbers: &Sequence,
    ) -> DVec3 {
        let paths = self.walk.sensor.paths;
        let (x, direction) = (subpath.vertices[0], drawn.direction);
        let emits = |hit: Hit| match drawn.emitter {
            Some(emitter) => hit.surface == Surface::Triangle(emitter),
            None => true,
        };
        // The face may continue beyond its own triangle: the ray must be farther from the face's plane there
        // than x is.
        let [a, b, c] = paths.scene.corners(triangle);
        let border = a.distance(b).min(b.distance(c)).min(c.distance(a));
        let angle = aside([a, b], x.position, border).max(aside([b, c], x.position, border));
        let light = |side: f64| {
            let probe = (direction + side * angle * normal).normalize();
            let hit = paths.scene.closest(x.position, probe, Some(x.surface));
            if drawn.emitter.is_some() {
                return hit
                    .filter(|&h| emits(h))
                    .map_or(DVec3::ZERO, |h| paths.lit_by_all(Some(h), direction));
            }
            if !V::IS_ZERO {
                return if hit.is_none() { paths.lit_by_all(None, direction) } else { DVec3::ZERO };
            }
            let depth = subpath.vertices.len() + 1;
            let radiance = paths.still_radiance(x.position, direction, hit, depth, &mut numbers.clone());
            // Emitters are covered by the other direction.
            radiance - hit.map_or(DVec3::ZERO, |h| paths.lit_by_all(Some(h), direction))
        };
        light(-1.0) - light(1.0)
    }
}

/// A direction in the plane of the face on which the last vertex of a path lies.
#[derive(Debug)]
pub(super) struct Point {
    triangle: u32,
    direction: DVec3,
    /// Difference of reflected radiance divided by the density.
    light: DVec3,
}

impl<V: WarpField> Curve for Horizons<'_, V> {
    type Field = V;
    type Point = Point;

    fn field(&self) -> &V {
        &self.field
    }

    fn is_empty(&self) -> bool {
        self.empty
    }

    fn draw(&self, address: Address, found: &mut impl FnMut(&CameraSubpath<'_>, &Point)) {
        let mut numbers = address.numbers(HORIZON);
        let beyond = address.numbers(BEYOND_HORIZON);
        self.walk.each(&mut numbers, |path, shading, numbers| {
            self.look(path, shading, (numbers, &beyond), |point| found(path, point));
        });
    }

    fn difference(&self, _: &CameraSubpath<'_>, point: &Point) -> Difference {
        Difference::of(point.light)
    }

    fn speed<C: Differential>(
        &self,
        calculus: &mut C,
        _: &Frame<C::Number>,
        _: &CameraSubpath<'_>,
        point: &Point,
    ) -> C::Number {
        let triangle = &self.walk.sensor.paths.scene.triangles[point.triangle as usize];
        let [p, q, r] = triangle.positions.map(|i| calculus.position(i));
        let turning = (q - p).cross(r - p).normalized();
        -turning.dot(Vec3::constant(point.direction))
    }
}
