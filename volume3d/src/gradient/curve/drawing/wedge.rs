//! Directions in which an edge is a silhouette in front of an emitter.
//!
//! About an edge of two triangles such directions fill two opposite wedges; about a border they are all
//! directions. An emitter triangle seen past the edge lies in them with the part between two planes through
//! the edge. Far from the triangle, sample a point of that part; near it, a plane and a direction to the
//! segment in which the plane cuts the triangle: no direction is wasted.

use std::f64::consts::{PI, TAU};

use glam::DVec3;

use super::table::Table;
use crate::geometry::solid_angle;
use crate::gradient::edges::{Edge, EdgeList};
use crate::path::{LightId, Paths};
use crate::scene::{Scene, Surface};

/// Distance, in triangle sizes, beyond which directions to a triangle are sampled by area.
const FAR: f64 = 2.0;

/// Number of emitter triangles above which directions are sampled by next-event estimation instead.
const MANY: usize = 32;

/// Directions u cos α + up sin α about an edge, α from 0 to the angle, and their opposites.
#[derive(Clone, Copy, Debug)]
pub(in crate::gradient::curve) struct Wedge {
    pub(in crate::gradient::curve) edge: DVec3,
    pub(in crate::gradient::curve) u: DVec3,
    pub(in crate::gradient::curve) up: DVec3,
    pub(in crate::gradient::curve) angle: f64,
}

impl Wedge {
    /// All directions about an edge.
    pub(in crate::gradient::curve) fn whole([a, b]: [DVec3; 2]) -> Option<Self> {
        let edge = (b - a).try_normalize()?;
        let (u, up) = edge.any_orthonormal_pair();
        Some(Self { edge, u, up, angle: PI })
    }

    /// `None` if every direction counts.
    pub(in crate::gradient::curve) fn of(scene: &Scene, list: &EdgeList, edge: &Edge) -> Option<Self> {
        let [u, v] = edge.limits.filter(|_| list.may_be_discontinuous(scene, edge))?;
        let [a, b] = edge.span(scene);
        let angle = u.cross(v).length().atan2(u.dot(v));
        let up = (v - u.dot(v) * u).try_normalize()?;
        Some(Self { edge: (b - a).try_normalize()?, u, up, angle })
    }

    fn azimuth(&self, v: DVec3) -> f64 {
        v.dot(self.up).atan2(v.dot(self.u))
    }

    /// Whether a direction is within the wedge.
    pub(in crate::gradient::curve) fn holds(&self, direction: DVec3) -> bool {
        self.azimuth(direction).rem_euclid(PI) <= self.angle
    }

    /// The part of a triangle between two azimuths at most π apart, seen from an edge point at the origin.
    fn clipped(&self, corners: [DVec3; 3], start: f64, angle: f64) -> Vec<DVec3> {
        let across = |azimuth: f64| azimuth.cos() * self.up - azimuth.sin() * self.u;
        clip(&clip(&corners, across(start)), -across(start + angle))
    }

    /// Solid angle of the part of a triangle between two azimuths at most π apart, seen from an edge point at
    /// the origin.
    fn solid_angle(&self, corners: [DVec3; 3], start: f64, angle: f64) -> f64 {
        let part = self.clipped(corners, start, angle);
        let fan = part.windows(2).skip(1).map(|pair| solid_angle(DVec3::ZERO, &[part[0], pair[0], pair[1]]));
        fan.sum::<f64>().abs()
    }

    fn is_whole(&self) -> bool {
        self.angle == PI
    }

    /// A direction to a part of a triangle, seen from the origin, uniform by area, and its density by solid
    /// angle: nearly constant if the triangle is far away.
    fn by_area(&self, part: &Part, corners: [DVec3; 3], [c, a, b]: [f64; 3]) -> Option<(DVec3, f64)> {
        let polygon =
            if self.is_whole() { corners.to_vec() } else { self.clipped(corners, part.start, part.angle) };
        let fan: Vec<[DVec3; 3]> =
            polygon.windows(2).skip(1).map(|pair| [polygon[0], pair[0], pair[1]]).collect();
        let area = |[p, q, r]: &[DVec3; 3]| 0.5 * (q - p).cross(r - p).length();
        let table = Table::new(fan.iter().map(area));
        if table.total() <= 0.0 {
            return None;
        }
        let [p, q, r] = fan[table.at(c).index];
        let root = a.sqrt();
        let way = p * (1.0 - root) + q * (root * (1.0 - b)) + r * (root * b);
        let (distance, normal) = (way.length(), (corners[1] - corners[0]).cross(corners[2] - corners[0]));
        let cosine = normal.normalize_or_zero().dot(way).abs() / distance;
        Some((way / distance, distance * distance / (cosine * table.total())))
    }

    /// A direction from a point, uniform in azimuth and, at fixed azimuth, by solid angle, dω = d cos θ dα
    /// with θ the angle to the edge, with its density. Near a triangle, sampling by area or length would give
    /// almost only directions along the edge.
    fn by_angle(
        &self,
        part: &Part,
        corners: [DVec3; 3],
        point: DVec3,
        [a, b]: [f64; 2],
    ) -> Option<(DVec3, f64)> {
        let azimuth = part.start + a * part.angle;
        let [y, z] = cosines(self, point, chord(self, corners, point, azimuth)?);
        let cosine = y + b * (z - y);
        let (sin, cos) = azimuth.sin_cos();
        let sine = ((1.0 - cosine) * (1.0 + cosine)).max(0.0).sqrt();
        let direction = cosine * self.edge + sine * (cos * self.u + sin * self.up);
        Some((direction, (part.angle * (z - y).abs()).recip()))
    }

    /// Width of a triangle in azimuth.
    fn range(&self, corners: [DVec3; 3], from: DVec3) -> f64 {
        let (low, high) = self.azimuths(corners, from);
        high - low
    }

    /// Start and width of the azimuth ranges under which a triangle is seen from the edge, within the wedges.
    fn parts(&self, corners: [DVec3; 3], from: DVec3) -> impl Iterator<Item = (f64, f64)> {
        let (low, high) = self.azimuths(corners, from);
        let (first, last) = (((low - self.angle) / PI).ceil() as i32, (high / PI).floor() as i32);
        let angle = self.angle;
        (first..=last).filter_map(move |k| {
            let start = low.max(PI * f64::from(k));
            let end = high.min(PI * f64::from(k) + angle);
            // For a full circle, the end is the beginning.
            (end > start).then_some((start, end - start))
        })
    }

    /// Least and largest azimuth of a triangle.
    fn azimuths(&self, corners: [DVec3; 3], from: DVec3) -> (f64, f64) {
        let [a, b, c] = corners.map(|p| self.azimuth(p - from));
        let turn = |x: f64, y: f64| (y - x + PI).rem_euclid(TAU) - PI;
        let steps = [turn(a, b), turn(b, c), turn(c, a)];
        let ends = [a, a + steps[0], a + steps[0] + steps[1]];
        let low = ends.into_iter().fold(f64::INFINITY, f64::min);
        let high = ends.into_iter().fold(f64::NEG_INFINITY, f64::max);
        // The line of the edge pierces the triangle, which is then seen at all azimuths.
        let around = steps.iter().sum::<f64>().abs() > PI;
        if around { (0.0, TAU) } else { (low, high) }
    }
}

/// The part of a polygon on the positive side of a plane through the origin.
fn clip(polygon: &[DVec3], normal: DVec3) -> Vec<DVec3> {
    let mut clipped = vec![];
    for (i, &p) in polygon.iter().enumerate() {
        let q = polygon[(i + 1) % polygon.len()];
        let (f, g) = (p.dot(normal), q.dot(normal));
        if f >= 0.0 {
            clipped.push(p);
        }
        if (f > 0.0 && g < 0.0) || (f < 0.0 && g > 0.0) {
            clipped.push(p.lerp(q, f / (f - g)));
        }
    }
    clipped
}

/// Triangles of all emitters, if they are few and there is no other kind of light.
#[derive(Debug)]
pub(in crate::gradient::curve) struct Targets {
    pub(in crate::gradient::curve) triangles: Vec<u32>,
}

/// The part of a triangle within a wedge.
struct Part {
    triangle: u32,
    start: f64,
    angle: f64,
    far: bool,
}

/// A direction to an emitter.
#[derive(Clone, Copy, Debug)]
pub(in crate::gradient::curve) struct Aimed {
    pub(in crate::gradient::curve) direction: DVec3,
    pub(in crate::gradient::curve) distance: f64,
    /// Density by solid angle.
    pub(in crate::gradient::curve) density: f64,
    pub(in crate::gradient::curve) surface: Surface,
    pub(in crate::gradient::curve) id: LightId,
}

impl Targets {
    pub(in crate::gradient::curve) fn new(paths: &Paths<'_>) -> Option<Self> {
        paths.lights.spheres()?;
        let scene = paths.scene;
        let emits = |t: &u32| {
            let shape = scene.triangles[*t as usize].shape as usize;
            scene.description.shapes[shape].radiance.is_some_and(|r| r != DVec3::ZERO)
        };
        let triangles: Vec<u32> = (0..scene.triangles.len() as u32).filter(emits).take(MANY + 1).collect();
        (triangles.len() <= MANY).then_some(Self { triangles })
    }

    /// All parts of emitters in front of which an edge point is on a silhouette, weighted by solid angle; the
    /// shapes `except` are excluded.
    fn parts(&self, scene: &Scene, wedge: &Wedge, point: DVec3, except: &[u32]) -> (Vec<Part>, Table) {
        let (mut parts, mut weights) = (vec![], vec![]);
        for &triangle in &self.triangles {
            if except.contains(&scene.triangles[triangle as usize].shape) {
                continue;
            }
            let p = scene.corners(triangle);
            if (p[1] - p[0]).cross(p[2] - p[0]).dot(point - p[0]) <= 0.0 {
                continue;
            }
            let centre = (p[0] + p[1] + p[2]) / 3.0 - point;
            let size = p[0].distance(p[1]).max(p[1].distance(p[2])).max(p[2].distance(p[0]));
            if centre.length() > FAR * size {
                let whole = 0.5 * (p[1] - p[0]).cross(p[2] - p[0]).dot(-centre) / centre.length().powi(3);
                if wedge.is_whole() {
                    parts.push(Part { triangle, start: 0.0, angle: PI, far: true });
                    weights.push(whole);
                    continue;
                }
                let first = parts.len();
                parts.extend(wedge.parts(p, point).map(|(start, angle)| Part {
                    triangle,
                    start,
                    angle,
                    far: true,
                }));
                // Parts are weighted by the width of their azimuth range, which estimates the area within it
                // to a factor of 2.
                let range = wedge.range(p, point);
                weights.extend(parts[first..].iter().map(|part| whole * part.angle / range));
                continue;
            }
            for (start, angle) in wedge.parts(p, point) {
                parts.push(Part { triangle, start, angle, far: false });
                weights.push(wedge.solid_angle(p.map(|p| p - point), start, angle));
            }
        }
        (parts, Table::new(weights))
    }

    /// Largest solid angle, over three points, of emitters in front of which a stretch is a silhouette; 0
    /// only if it is none.
    pub(in crate::gradient::curve) fn solid_angle(
        &self,
        scene: &Scene,
        wedge: &Wedge,
        [a, b]: [DVec3; 2],
        except: &[u32],
    ) -> f64 {
        let at = |point| self.parts(scene, wedge, point, except);
        let (parts, middle) = at(a.midpoint(b));
        if middle.total() > 0.0 && parts.iter().all(|part| part.far) {
            return middle.total();
        }
        at(a).1.total().max(middle.total()).max(at(b).1.total())
    }

    /// Samples a direction towards them from an edge point.
    pub(in crate::gradient::curve) fn draw(
        &self,
        scene: &Scene,
        wedge: &Wedge,
        point: DVec3,
        except: &[u32],
        [c, a, b]: [f64; 3],
    ) -> Option<Aimed> {
        let (parts, table) = self.parts(scene, wedge, point, except);
        if table.total() <= 0.0 {
            return None;
        }
        let chosen = table.at(c);
        let part = &parts[chosen.index];
        let p = scene.corners(part.triangle);
        let (direction, density) = if part.far {
            wedge.by_area(part, p.map(|p| p - point), [chosen.rest, a, b])?
        } else {
            wedge.by_angle(part, p, point, [a, b])?
        };
        let normal = (p[1] - p[0]).cross(p[2] - p[0]);
        let facing = normal.dot(direction);
        if facing >= 0.0 {
            return None;
        }
        let distance = normal.dot(p[0] - point) / facing;
        let density = chosen.probability * density;
        let surface = Surface::Triangle(part.triangle);
        let id = LightId::Shape(scene.shape_of(surface));
        Some(Aimed { direction, distance, density, surface, id })
            .filter(|a| a.density.is_finite() && a.distance > 0.0)
    }
}

/// Cosines of the angles between an edge and the ends of a chord, seen from a point of the edge.
fn cosines(wedge: &Wedge, point: DVec3, ends: [DVec3; 2]) -> [f64; 2] {
    ends.map(|end| (end - point).normalize_or_zero().dot(wedge.edge))
}

/// Segment in which the half plane at an azimuth, bounded by the edge's line through a point, cuts a
/// triangle.
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
        // The part on the other side of the edge's line belongs to another azimuth.
        (true, false) => r = q.lerp(r, f / (f - g)),
        (false, true) => q = q.lerp(r, f / (f - g)),
    }
    Some([q, r])
}
