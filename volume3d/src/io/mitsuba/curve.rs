//! Curves with a thickness: the shapes `bsplinecurve` and `linearcurve`, as meshes.

use std::f64::consts::TAU;

use glam::{DAffine3, DVec2, DVec3};

use super::object::Object;
use super::reader::Reader;
use super::transform;
use crate::geometry::{Attribute, Mesh, MeshError, Normals, TOLERANCE};
use crate::io::error::excerpt;
use crate::io::{At, Error, MeshProblem, Place};

/// Segments of a circle, so that no point is farther than [`TOLERANCE`] times the radius from its mesh.
const AROUND: u32 = 72;
/// The most rings of one segment of a curve, and the most vertices of all.
const MOST_RINGS: f64 = 256.0;
const MOST_VERTICES: usize = 1 << 24;

/// A control point: where it is and how thick the curve is there.
#[derive(Clone, Copy, Debug, PartialEq)]
struct Knot {
    position: DVec3,
    radius: f64,
}

impl<'a> Reader<'a> {
    /// The mesh of the curves in a file, where they stand: `to_world` moves control points and leaves radii as they are.
    pub(super) fn curves(&self, object: &Object<'a>) -> Result<Mesh, Error> {
        let element = object.element;
        let name = object.string("filename")?.ok_or_else(|| object.missing("filename"))?;
        object.float("silhouette_sampling_weight")?;
        let map = match object.transform("to_world")? {
            Some(element) => transform::invertible(element)?,
            None => DAffine3::IDENTITY,
        };
        let (path, bytes) = self.file(element, name)?;
        let failure =
            |(at, problem)| element.referenced(Error::Mesh { place: Place::new(&path, at), problem });
        let is_spline = object.plugin == "bsplinecurve";
        let degree = if is_spline { 3 } else { 1 };
        let mut curves = parse(&bytes, degree + 1).map_err(failure)?;
        for knot in curves.iter_mut().flatten() {
            knot.position = map.transform_point3(knot.position);
        }
        let sphere = Mesh::sphere();
        if curves.iter().map(|curve| vertices(curve, is_spline, &sphere)).sum::<usize>() > MOST_VERTICES {
            return Err(element.unsupported("more than 2^24 vertices of curves", "give fewer curves"));
        }
        let mut patch = Patch::default();
        let segments: usize = curves.iter().map(|curve| curve.len() - degree).sum();
        let mut before = 0;
        for curve in &curves {
            if is_spline {
                patch.spline(curve, before, segments);
            } else {
                patch.cones(curve, &sphere, before, segments);
            }
            before += curve.len() - degree;
        }
        patch.into_mesh().map_err(|error| failure((At::Whole, MeshProblem::Geometry(error))))
    }
}

/// A control point a line, x y z and a radius, and an empty line between curves.
fn parse(bytes: &[u8], fewest: usize) -> Result<Vec<Vec<Knot>>, (At, MeshProblem)> {
    let expected = |number: usize, expected: &'static str, found: &str| {
        (At::Line(number), MeshProblem::Expected { expected, found: excerpt(found) })
    };
    let text = String::from_utf8_lossy(bytes);
    let (mut curves, mut curve) = (vec![], vec![]);
    // The end of the file ends a curve, too.
    for (number, line) in text.lines().chain([""]).enumerate() {
        let number = number + 1;
        if line.trim().is_empty() {
            if (1..fewest).contains(&curve.len()) {
                let least =
                    if fewest == 4 { "four control points a curve" } else { "two control points a curve" };
                return Err(expected(number, least, &curve.len().to_string()));
            }
            if !curve.is_empty() {
                curves.push(std::mem::take(&mut curve));
            }
            continue;
        }
        let numbers: Result<Vec<f64>, _> = line.split_whitespace().map(str::parse).collect();
        match numbers.as_deref() {
            Ok(&[x, y, z, radius, ..])
                if DVec3::new(x, y, z).is_finite() && radius >= 0.0 && radius.is_finite() =>
            {
                curve.push(Knot { position: DVec3::new(x, y, z), radius });
            }
            _ => return Err(expected(number, "three coordinates and a radius of at least 0", line)),
        }
    }
    if curves.is_empty() {
        return Err((At::Whole, MeshProblem::Missing { what: "control points" }));
    }
    Ok(curves)
}

/// How many vertices the mesh of a curve has, or a few more.
fn vertices(curve: &[Knot], is_spline: bool, sphere: &Mesh) -> usize {
    if is_spline {
        let rings = |window: &[Knot]| Spline(std::array::from_fn(|i| window[i])).rings() as usize + 1;
        AROUND as usize * curve.windows(4).map(rings).sum::<usize>()
    } else {
        curve.len() * (2 * AROUND as usize + sphere.positions().len())
    }
}

/// A segment of a uniform cubic B-spline.
struct Spline([Knot; 4]);

impl Spline {
    /// The sum of the control points, with these weights.
    fn sum(&self, weights: [f64; 4]) -> Knot {
        let mut sum = Knot { position: DVec3::ZERO, radius: 0.0 };
        for (knot, weight) in self.0.iter().zip(weights) {
            sum.position += weight * knot.position;
            sum.radius += weight * knot.radius;
        }
        sum
    }

    /// The point at v in [0, 1], and its first and second derivative.
    fn at(&self, v: f64) -> [Knot; 3] {
        let (v2, v3) = (v * v, v * v * v);
        let value = [
            1.0 - 3.0 * v + 3.0 * v2 - v3,
            4.0 - 6.0 * v2 + 3.0 * v3,
            1.0 + 3.0 * v + 3.0 * v2 - 3.0 * v3,
            v3,
        ];
        let slope = [-3.0 + 6.0 * v - 3.0 * v2, -12.0 * v + 9.0 * v2, 3.0 + 6.0 * v - 9.0 * v2, 3.0 * v2];
        let bend = [1.0 - v, 3.0 * v - 2.0, 1.0 - 3.0 * v, v];
        [self.sum(value.map(|w| w / 6.0)), self.sum(slope.map(|w| w / 6.0)), self.sum(bend)]
    }

    /// How many rings keep the polygon within the tolerance of the curve: a chord of h is |c″| h²/8 away.
    fn rings(&self) -> u32 {
        let bend = [0.0, 1.0].map(|v| self.at(v)[2]);
        let bend = bend.iter().map(|b| b.position.length() + b.radius.abs()).fold(0.0, f64::max);
        let radius = self.0.iter().map(|knot| knot.radius).fold(0.0, f64::max);
        if bend == 0.0 || radius == 0.0 {
            return 1;
        }
        (bend / (8.0 * TOLERANCE * radius)).sqrt().ceil().clamp(1.0, MOST_RINGS) as u32
    }
}

/// Where u = 0 and u = ¼ are around a curve of a direction, as Mitsuba has it.
fn frame(direction: DVec3) -> [DVec3; 2] {
    let across = DVec3::Z - direction * direction.z;
    let quarter = across.try_normalize().unwrap_or(DVec3::Y);
    [quarter.cross(direction), quarter]
}

/// A circle of vertices: the first of them, where each is around the curve, and how far along it all are.
struct Ring {
    first: u32,
    turns: Vec<f64>,
    along: f64,
}

/// Vertices with normals, and texture coordinates of corners.
#[derive(Default)]
struct Patch {
    positions: Vec<DVec3>,
    normals: Vec<DVec3>,
    triangles: Vec<[u32; 3]>,
    uvs: Vec<DVec2>,
}

impl Patch {
    /// A tube along a curve, open at its ends. Its texture coordinate v goes on from other curves.
    fn spline(&mut self, curve: &[Knot], before: usize, segments: usize) {
        // Each ring is the one before, tilted: rings are not twisted against each other.
        let mut side: Option<DVec3> = None;
        let mut last: Option<Ring> = None;
        for (index, window) in curve.windows(4).enumerate() {
            let spline = Spline(std::array::from_fn(|i| window[i]));
            let rings = spline.rings();
            for k in u32::from(last.is_some())..=rings {
                let v = f64::from(k) / f64::from(rings);
                let [center, slope, bend] = spline.at(v);
                let Some(direction) = slope.position.try_normalize() else { continue };
                let zero = frame(direction)[0];
                let start =
                    side.map_or(zero, |side| (side - direction * side.dot(direction)).normalize_or(zero));
                side = Some(start);
                let normal = |radial: DVec3| {
                    let arm = center.radius * radial;
                    (slope.position.length_squared() - arm.dot(bend.position)) * radial
                        - slope.radius * slope.position
                };
                let along = ((before + index) as f64 + v) / segments as f64;
                let ring = self.ring(center, direction, start, normal, along);
                if let Some(last) = &last {
                    self.band(last, &ring);
                }
                last = Some(ring);
            }
        }
    }

    /// Cones that touch the spheres around their ends, and those spheres.
    fn cones(&mut self, curve: &[Knot], sphere: &Mesh, before: usize, segments: usize) {
        let along = |index: usize| (before + index) as f64 / segments as f64;
        for (index, (a, b)) in curve.iter().zip(&curve[1..]).enumerate() {
            let line = b.position - a.position;
            let sine = (a.radius - b.radius) / line.length();
            let Some(direction) = line.try_normalize().filter(|_| sine.abs() < 1.0) else { continue };
            let cosine = (1.0 - sine * sine).sqrt();
            let normal = |radial: DVec3| cosine * radial + sine * direction;
            let [first, second] = [(a, along(index)), (b, along(index + 1))].map(|(knot, along)| {
                let position = knot.position + knot.radius * sine * direction;
                let circle = Knot { position, radius: knot.radius * cosine };
                self.ring(circle, direction, frame(direction)[0], normal, along)
            });
            self.band(&first, &second);
        }
        for (index, knot) in curve.iter().enumerate() {
            let [from, to] = if index == 0 { [0, 1] } else { [index - 1, index] };
            let direction = (curve[to].position - curve[from].position).normalize_or(DVec3::X);
            let [zero, quarter] = frame(direction);
            let first = self.positions.len() as u32;
            self.positions.extend(sphere.positions().iter().map(|&p| knot.position + knot.radius * p));
            self.normals.extend(sphere.positions());
            for triangle in sphere.triangles() {
                let turns = triangle.map(|i| turn(sphere.positions()[i as usize], zero, quarter));
                self.triangle(triangle.map(|i| first + i), turns, [along(index); 3]);
            }
        }
    }

    fn ring(
        &mut self,
        center: Knot,
        direction: DVec3,
        start: DVec3,
        normal: impl Fn(DVec3) -> DVec3,
        along: f64,
    ) -> Ring {
        let ([zero, quarter], other) = (frame(direction), direction.cross(start));
        let first = self.positions.len() as u32;
        let mut turns = vec![];
        for j in 0..AROUND {
            let (sin, cos) = (TAU * f64::from(j) / f64::from(AROUND)).sin_cos();
            let radial = cos * start + sin * other;
            self.positions.push(center.position + center.radius * radial);
            self.normals.push(normal(radial).normalize_or(radial));
            turns.push(turn(radial, zero, quarter));
        }
        Ring { first, turns, along }
    }

    /// What is between two rings.
    fn band(&mut self, a: &Ring, b: &Ring) {
        for j in 0..AROUND {
            let next = (j + 1) % AROUND;
            for corners in [[(a, j), (a, next), (b, next)], [(a, j), (b, next), (b, j)]] {
                let turns = corners.map(|(ring, j)| ring.turns[j as usize]);
                self.triangle(
                    corners.map(|(ring, j)| ring.first + j),
                    turns,
                    corners.map(|(ring, _)| ring.along),
                );
            }
        }
    }

    /// A triangle whose corners are less than half a turn apart.
    fn triangle(&mut self, corners: [u32; 3], turns: [f64; 3], along: [f64; 3]) {
        self.triangles.push(corners);
        let near = |turn: f64| turn - (turn - turns[0]).round();
        self.uvs.extend((0..3).map(|k| DVec2::new(near(turns[k]), along[k])));
    }

    fn into_mesh(self) -> Result<Mesh, MeshError> {
        let Self { positions, normals, triangles, uvs } = self;
        let corners = (0..triangles.len() as u32).map(|k| [3 * k, 3 * k + 1, 3 * k + 2]).collect();
        let normals = Attribute { values: normals, triangles: triangles.clone() };
        Mesh::new(positions, triangles)?
            .with_normals(Normals::Given(normals))?
            .with_uvs(Attribute { values: uvs, triangles: corners })
    }
}

/// The part of a turn from one direction towards another, in [0, 1).
fn turn(radial: DVec3, zero: DVec3, quarter: DVec3) -> f64 {
    (radial.dot(quarter).atan2(radial.dot(zero)) / TAU).rem_euclid(1.0)
}

#[cfg(test)]
mod tests {
    use super::*;

    fn knots(text: &str, fewest: usize) -> Vec<Vec<Knot>> {
        parse(text.as_bytes(), fewest).unwrap()
    }

    /// Control points on a line with one radius make a cylinder, from the second to the last but one.
    #[test]
    fn a_straight_spline_is_a_cylinder() {
        let curve = &knots("0 0 0 .5\n1 0 0 .5\n2 0 0 .5\n3 0 0 .5\n4 0 0 .5\n", 4)[0];
        let mut patch = Patch::default();
        patch.spline(curve, 0, 2);
        let mesh = patch.into_mesh().unwrap();
        let axial: Vec<f64> = mesh.positions().iter().map(|p| p.x).collect();
        let (low, high) = axial.iter().fold((f64::MAX, f64::MIN), |(l, h), &x| (l.min(x), h.max(x)));
        assert!((low - 1.0).abs() < 1e-12 && (high - 3.0).abs() < 1e-12, "{low} {high}");
        let Normals::Given(normals) = mesh.normals() else { panic!() };
        for (p, n) in mesh.positions().iter().zip(&normals.values) {
            assert!((DVec2::new(p.y, p.z).length() - 0.5).abs() < 1e-12);
            assert!((*n - DVec3::new(0.0, p.y, p.z) / 0.5).length() < 1e-12, "{n} {p}");
        }
        // It faces outwards, and u = ¼ is towards z.
        let [a, b, c] = mesh.triangles()[0].map(|i| mesh.positions()[i as usize]);
        let middle = (a + b + c) / 3.0;
        assert!((b - a).cross(c - a).dot(DVec3::new(0.0, middle.y, middle.z)) > 0.0);
        let uvs = mesh.uvs().unwrap();
        for (corners, places) in mesh.triangles().iter().zip(&uvs.triangles) {
            for (&i, &k) in corners.iter().zip(places) {
                let (p, uv) = (mesh.positions()[i as usize], uvs.values[k as usize]);
                assert!((uv.y - (p.x - 1.0) / 2.0).abs() < 1e-12);
                let up = (TAU * uv.x).sin();
                assert!((up - p.z / 0.5).abs() < 1e-9, "{uv} {p}");
            }
        }
    }

    /// Normals are those of the surface: across its edges, however it bends and swells.
    #[test]
    fn normals_are_across_the_surface() {
        let curve = &knots("0 0 0 .1\n1 .2 0 .3\n1.5 1 .4 .2\n1 2 1 .4\n0 2.5 2 .1\n", 4)[0];
        let mut patch = Patch::default();
        patch.spline(curve, 0, 2);
        let rings = patch.positions.len() as u32 / AROUND;
        assert!(rings > 8, "{rings}");
        for ring in 1..rings - 1 {
            for j in 0..AROUND {
                let at = |ring: u32| patch.positions[(ring * AROUND + j) as usize];
                let along = (at(ring + 1) - at(ring - 1)).normalize();
                let normal = patch.normals[(ring * AROUND + j) as usize];
                assert!(along.dot(normal).abs() < 0.03, "{ring} {j}: {}", along.dot(normal));
            }
        }
    }

    /// Two knots of radius ½ are a cylinder with half spheres, and all of it faces outwards.
    #[test]
    fn a_line_is_a_capsule() {
        let curve = &knots("0 0 0 .5\n2 0 0 .5", 2)[0];
        let mut patch = Patch::default();
        patch.cones(curve, &Mesh::sphere(), 0, 1);
        let distance = |p: DVec3| (p - DVec3::new(p.x.clamp(0.0, 2.0), 0.0, 0.0)).length();
        let outermost = patch.positions.iter().map(|&p| distance(p)).fold(0.0, f64::max);
        assert!((outermost - 0.5).abs() < 1e-12, "{outermost}");
        let ends = patch.positions.iter().fold((f64::MAX, f64::MIN), |(l, h), p| (l.min(p.x), h.max(p.x)));
        assert!((ends.0 + 0.5).abs() < 1e-3 && (ends.1 - 2.5).abs() < 1e-3, "{ends:?}");
    }

    /// What is counted before a mesh is made is no less than what it has.
    #[test]
    fn vertices_are_counted_before() {
        let text = "0 0 0 .1\n1 .2 0 .3\n1.5 1 .4 .2\n1 2 1 .4\n0 2.5 2 .1\n";
        let (mut tube, mut cones) = (Patch::default(), Patch::default());
        tube.spline(&knots(text, 4)[0], 0, 2);
        cones.cones(&knots(text, 2)[0], &Mesh::sphere(), 0, 4);
        let found = [tube.positions.len(), cones.positions.len()];
        let most = [true, false].map(|is_spline| vertices(&knots(text, 2)[0], is_spline, &Mesh::sphere()));
        assert!(found[0] <= most[0] && found[1] <= most[1], "{found:?} {most:?}");
        assert!(most[0] < found[0] + 200 && most[1] < found[1] + 200, "{found:?} {most:?}");
    }

    #[test]
    fn files_of_curves() {
        let two = knots("\n0 0 0 1\n1 0 0 1\n\n \n0 0 0 2\n0 1 0 2\n0 1 1 0\n", 2);
        assert_eq!(two.iter().map(Vec::len).collect::<Vec<_>>(), [2, 3]);
        let refused = |text: &str, fewest| parse(text.as_bytes(), fewest).unwrap_err();
        assert!(matches!(refused("", 2), (At::Whole, MeshProblem::Missing { .. })));
        assert!(matches!(refused("0 0 0 1\n0 0 1 1\n", 4), (At::Line(3), MeshProblem::Expected { .. })));
        for bad in ["0 0 0", "0 0 0 -1", "0 0 x 1", "0 0 nan 1", "0 0 0 inf"] {
            assert!(matches!(refused(bad, 2), (At::Line(1), MeshProblem::Expected { .. })), "{bad}");
        }
    }
}
