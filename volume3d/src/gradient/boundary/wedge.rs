//! Directions in which an edge of two triangles is a silhouette before an emitter.
//!
//! About an edge such directions fill two opposite wedges, and emitters that are seen past it lie in them with the
//! part of each of their triangles that is between two planes through the edge. One draws a plane, and a point of
//! the segment in which it cuts the triangle: no direction is drawn in vain.

use std::f64::consts::{PI, TAU};

use glam::DVec3;

use super::list::{Edge, EdgeList};
use super::table::Table;
use crate::path::{LightId, Paths};
use crate::scene::{Scene, Surface};

/// Above as many triangles of emitters directions are drawn from next-event estimation instead.
const MANY: usize = 32;

/// Directions u cos α + up sin α about an edge, α from 0 to the angle, and their opposites.
#[derive(Clone, Copy, Debug)]
pub(super) struct Wedge {
    pub(super) edge: DVec3,
    pub(super) u: DVec3,
    pub(super) up: DVec3,
    pub(super) angle: f64,
}

impl Wedge {
    /// `None` where every direction counts.
    pub(super) fn of(scene: &Scene, list: &EdgeList, edge: &Edge) -> Option<Self> {
        let [u, v] = list.limits(scene, edge).filter(|_| list.may_jump(scene, edge))?;
        let [a, b] = edge.span(scene);
        let angle = u.cross(v).length().atan2(u.dot(v));
        let up = (v - u.dot(v) * u).try_normalize()?;
        Some(Self { edge: (b - a).try_normalize()?, u, up, angle })
    }

    fn azimuth(&self, v: DVec3) -> f64 {
        v.dot(self.up).atan2(v.dot(self.u))
    }

    /// Whether a direction is within.
    pub(super) fn holds(&self, direction: DVec3) -> bool {
        self.azimuth(direction).rem_euclid(PI) <= self.angle
    }

    /// The azimuths, from where on and how many, under which a triangle is seen from the edge, within the wedges.
    fn parts(&self, corners: [DVec3; 3], from: DVec3) -> impl Iterator<Item = (f64, f64)> {
        let [a, b, c] = corners.map(|p| self.azimuth(p - from));
        let turn = |x: f64, y: f64| (y - x + PI).rem_euclid(TAU) - PI;
        let steps = [turn(a, b), turn(b, c), turn(c, a)];
        let ends = [a, a + steps[0], a + steps[0] + steps[1]];
        let low = ends.into_iter().fold(f64::INFINITY, f64::min);
        let high = ends.into_iter().fold(f64::NEG_INFINITY, f64::max);
        // The line of the edge pierces the triangle: it is seen all around.
        let around = steps.iter().sum::<f64>().abs() > PI;
        let (low, high) = if around { (0.0, TAU) } else { (low, high) };
        let (first, last) = (((low - self.angle) / PI).ceil() as i32, (high / PI).floor() as i32);
        let angle = self.angle;
        (first..=last).filter_map(move |k| {
            let start = low.max(PI * f64::from(k));
            let end = high.min(PI * f64::from(k) + angle);
            // All around, the end is the beginning.
            (end > start).then_some((start, end - start))
        })
    }
}

/// The triangles of all emitters, if they are few and there is no other light to choose.
#[derive(Debug)]
pub(super) struct Targets {
    triangles: Vec<u32>,
}

/// Part of a triangle within a wedge.
struct Part {
    triangle: u32,
    start: f64,
    angle: f64,
}

/// A direction to an emitter.
#[derive(Clone, Copy, Debug)]
pub(super) struct Aimed {
    pub(super) direction: DVec3,
    pub(super) distance: f64,
    /// Per solid angle.
    pub(super) density: f64,
    pub(super) surface: Surface,
    pub(super) id: LightId,
}

impl Targets {
    pub(super) fn new(paths: &Paths<'_>) -> Option<Self> {
        paths.lights.spheres()?;
        let scene = paths.scene;
        let emits = |t: &u32| {
            let shape = scene.triangles[*t as usize].shape as usize;
            scene.description.shapes[shape].radiance.is_some_and(|r| r != DVec3::ZERO)
        };
        let triangles: Vec<u32> = (0..scene.triangles.len() as u32).filter(emits).take(MANY + 1).collect();
        (triangles.len() <= MANY).then_some(Self { triangles })
    }

    /// Every part of an emitter before which an edge is a silhouette, with roughly its solid angle.
    fn parts(&self, scene: &Scene, wedge: &Wedge, [a, b]: [DVec3; 2]) -> (Vec<Part>, Table) {
        let (mut parts, mut weights) = (vec![], vec![]);
        let middle = a.midpoint(b);
        for &triangle in &self.triangles {
            let p = scene.corners(triangle);
            let normal = (p[1] - p[0]).cross(p[2] - p[0]);
            if [a, b].iter().all(|end| normal.dot(*end - p[0]) <= 0.0) {
                continue;
            }
            for (start, angle) in wedge.parts(p, middle) {
                if let Some([q, r]) = chord(wedge, p, middle, start + 0.5 * angle) {
                    let [y, z] = [q, r].map(|q| (q - middle).normalize_or_zero().dot(wedge.edge));
                    parts.push(Part { triangle, start, angle });
                    weights.push(angle * (y - z).abs());
                }
            }
        }
        (parts, Table::new(weights))
    }

    /// Roughly the solid angle of emitters before which an edge is a silhouette; 0 only where there is none.
    pub(super) fn solid_angle(&self, scene: &Scene, wedge: &Wedge, span: [DVec3; 2]) -> f64 {
        self.parts(scene, wedge, span).1.total()
    }

    /// Roughly the largest solid angle that emitters have from a point of an edge; 0 only where it never sees them.
    pub(super) fn reach(&self, scene: &Scene, [a, b]: [DVec3; 2]) -> f64 {
        let from = |x: DVec3| {
            let of = |&t: &u32| {
                let [p, q, r] = scene.corners(t);
                let way = (p + q + r) / 3.0 - x;
                let facing = 0.5 * (q - p).cross(r - p).dot(x - p);
                (facing / way.length().powi(3)).clamp(0.0, TAU)
            };
            self.triangles.iter().map(of).sum::<f64>()
        };
        from(a).max(from(a.midpoint(b))).max(from(b))
    }

    /// A direction to them from a point of the edge.
    pub(super) fn draw(
        &self,
        scene: &Scene,
        wedge: &Wedge,
        span: [DVec3; 2],
        point: DVec3,
        [c, a, b]: [f64; 3],
    ) -> Option<Aimed> {
        let (parts, table) = self.parts(scene, wedge, span);
        if table.total() <= 0.0 {
            return None;
        }
        let chosen = table.at(c);
        let part = &parts[chosen.index];
        let p = scene.corners(part.triangle);
        let [q, r] = chord(wedge, p, point, part.start + a * part.angle)?;
        let way = q.lerp(r, b) - point;
        let distance = way.length();
        let direction = way.try_normalize()?;
        let normal = (p[1] - p[0]).cross(p[2] - p[0]);
        if normal.dot(direction) >= 0.0 {
            return None;
        }
        // dω = sin θ dθ dα with θ the angle to the edge, and dθ = |chord × ω|/t ds in a plane through it.
        let sine = direction.cross(wedge.edge).length();
        let cut = (r - q).cross(direction).length() / distance;
        let density = chosen.probability / (part.angle * cut * sine);
        let surface = Surface::Triangle(part.triangle);
        let id = LightId::Shape(scene.shape_of(surface));
        Some(Aimed { direction, distance, density, surface, id }).filter(|a| a.density.is_finite())
    }
}

/// What the half plane that begins at an edge's line through a point, at an azimuth, cuts out of a triangle.
fn chord(wedge: &Wedge, corners: [DVec3; 3], point: DVec3, azimuth: f64) -> Option<[DVec3; 2]> {
    let (sin, cos) = azimuth.sin_cos();
    let along = cos * wedge.u + sin * wedge.up;
    let normal = along.cross(wedge.edge);
    let heights = corners.map(|p| (p - point).dot(normal));
    let cut = |i: usize, j: usize| {
        let (f, g) = (heights[i], heights[j]);
        ((f > 0.0) != (g > 0.0)).then(|| corners[i].lerp(corners[j], f / (f - g)))
    };
    let mut ends = [(0, 1), (1, 2), (2, 0)].into_iter().filter_map(|(i, j)| cut(i, j));
    let (mut q, mut r) = (ends.next()?, ends.next()?);
    let (f, g) = ((q - point).dot(along), (r - point).dot(along));
    match (f > 0.0, g > 0.0) {
        (false, false) => return None,
        (true, true) => {}
        // The part on the other side of the edge's line is another azimuth's.
        (true, false) => r = q.lerp(r, f / (f - g)),
        (false, true) => q = q.lerp(r, f / (f - g)),
    }
    Some([q, r])
}
