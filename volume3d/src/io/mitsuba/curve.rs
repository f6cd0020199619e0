//! Curves with radii: the shapes `bsplinecurve` and `linearcurve`, as meshes.

use std::f64::consts::TAU;

use glam::{DAffine3, DVec2, DVec3};

use super::knots::{Knot, Spline, parse};
use super::object::Object;
use super::reader::Reader;
use super::transform;
use crate::geometry::{Attribute, Mesh, MeshError, Normals};
use crate::io::{At, Error, MeshProblem, Place};

/// Segments of a circle, so that the mesh is within [`TOLERANCE`](crate::geometry::TOLERANCE) times the
/// radius of the curve.
const AROUND: u32 = 72;
/// Maximum number of vertices of all curves of a scene.
const MOST_VERTICES: usize = 1 << 21;
/// Overlap of spheres and cones, in radii, so that the two meshes leave no gap.
const MARGIN: f64 = 0.1;

/// A mesh exceeds the maximum number of vertices.
#[derive(Debug, PartialEq, Eq)]
struct TooMany;

impl<'a> Reader<'a> {
    /// The mesh of the curves in a file, in world space: `to_world` transforms control points and keeps
    /// radii.
    pub(super) fn curves(&mut self, object: &Object<'a>) -> Result<Mesh, Error> {
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
        let mut patch = Patch { most: MOST_VERTICES - self.curve_vertices, ..Patch::default() };
        let segments: usize = curves.iter().map(|curve| curve.len() - degree).sum();
        let mut before = 0;
        for curve in &curves {
            let made = if is_spline {
                patch.spline(curve, before, segments)
            } else {
                patch.cones(curve, &sphere, before, segments)
            };
            made.map_err(|TooMany| {
                let what = "more than 2^21 vertices of all curves of a scene";
                element.unsupported(what, "give fewer curves, or fewer control points a curve")
            })?;
            before += curve.len() - degree;
        }
        self.curve_vertices += patch.positions.len();
        patch.into_mesh().map_err(|error| failure((At::Whole, MeshProblem::Geometry(error))))
    }
}

/// The directions u = 0 and u = ¼ around a curve, as in Mitsuba.
fn frame(direction: DVec3) -> [DVec3; 2] {
    let across = DVec3::Z - direction * direction.z;
    let quarter = across.try_normalize().unwrap_or(DVec3::Y);
    [quarter.cross(direction), quarter]
}

/// A circle of vertices: the index of the first, the position of each around the curve, and their common
/// position along it.
struct Ring {
    first: u32,
    turns: Vec<f64>,
    along: f64,
}

/// The cone tangent to the spheres around two knots: its direction, and the sine of the angle between that
/// and its side. `None` if one sphere is within the other.
fn cone(a: &Knot, b: &Knot) -> Option<(DVec3, f64)> {
    let line = b.position - a.position;
    let sine = (a.radius - b.radius) / line.length();
    line.try_normalize().filter(|_| sine.abs() < 1.0).map(|direction| (direction, sine))
}

/// Vertices with normals, and texture coordinates of corners.
struct Patch {
    /// Maximum number of vertices.
    most: usize,
    positions: Vec<DVec3>,
    normals: Vec<DVec3>,
    triangles: Vec<[u32; 3]>,
    uvs: Vec<DVec2>,
}

impl Default for Patch {
    fn default() -> Self {
        let (positions, normals, triangles, uvs) = (vec![], vec![], vec![], vec![]);
        Self { most: MOST_VERTICES, positions, normals, triangles, uvs }
    }
}

impl Patch {
    fn check(&self) -> Result<(), TooMany> {
        if self.positions.len() > self.most { Err(TooMany) } else { Ok(()) }
    }

    /// Adds a tube along a curve, open at its ends. Its texture coordinate v continues that of other curves.
    fn spline(&mut self, curve: &[Knot], before: usize, segments: usize) -> Result<(), TooMany> {
        // Each ring is the previous one, tilted: rings are not twisted relative to each other.
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
                self.check()?;
            }
        }
        Ok(())
    }

    /// Adds cones tangent to the spheres around their ends, and the parts of those spheres that the cones do
    /// not hide.
    fn cones(
        &mut self,
        curve: &[Knot],
        sphere: &Mesh,
        before: usize,
        segments: usize,
    ) -> Result<(), TooMany> {
        let along = |index: usize| (before + index) as f64 / segments as f64;
        for (index, (a, b)) in curve.iter().zip(&curve[1..]).enumerate() {
            let Some((direction, sine)) = cone(a, b) else { continue };
            let cosine = (1.0 - sine * sine).sqrt();
            let normal = |radial: DVec3| cosine * radial + sine * direction;
            let [first, second] = [(a, along(index)), (b, along(index + 1))].map(|(knot, along)| {
                let position = knot.position + knot.radius * sine * direction;
                let circle = Knot { position, radius: knot.radius * cosine };
                self.ring(circle, direction, frame(direction)[0], normal, along)
            });
            self.band(&first, &second);
            self.check()?;
        }
        for (index, knot) in curve.iter().enumerate().filter(|(_, knot)| knot.radius > 0.0) {
            let [from, to] = if index == 0 { [0, 1] } else { [index - 1, index] };
            let direction = (curve[to].position - curve[from].position).normalize_or(DVec3::X);
            let [zero, quarter] = frame(direction);
            let next = curve.get(index + 1).and_then(|next| cone(knot, next));
            let last = index.checked_sub(1).and_then(|last| cone(&curve[last], knot));
            let cones = [next, last.map(|(direction, sine)| (-direction, -sine))];
            let mut places: Vec<Option<u32>> = vec![None; sphere.positions().len()];
            for triangle in sphere.triangles() {
                let corners = triangle.map(|i| sphere.positions()[i as usize]);
                let hides = |&(direction, sine): &(DVec3, f64)| {
                    corners.iter().all(|corner| corner.dot(direction) > sine + MARGIN)
                };
                if cones.iter().flatten().any(hides) {
                    continue;
                }
                let vertices = [0, 1, 2].map(|k| {
                    *places[triangle[k] as usize].get_or_insert_with(|| {
                        self.positions.push(knot.position + knot.radius * corners[k]);
                        self.normals.push(corners[k]);
                        self.positions.len() as u32 - 1
                    })
                });
                self.triangle(vertices, corners.map(|corner| turn(corner, zero, quarter)), [along(index); 3]);
            }
            self.check()?;
        }
        Ok(())
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

    /// Triangulates the band between two rings.
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
        let Self { positions, normals, triangles, uvs, .. } = self;
        let corners = (0..triangles.len() as u32).map(|k| [3 * k, 3 * k + 1, 3 * k + 2]).collect();
        let normals = Attribute { values: normals, triangles: triangles.clone() };
        Mesh::new(positions, triangles)?
            .with_normals(Normals::Given(normals))?
            .with_uvs(Attribute { values: uvs, triangles: corners })
    }
}

/// The fraction of a turn from one direction towards another, in [0, 1).
fn turn(radial: DVec3, zero: DVec3, quarter: DVec3) -> f64 {
    (radial.dot(quarter).atan2(radial.dot(zero)) / TAU).rem_euclid(1.0)
}

#[cfg(test)]
mod tests {
    use super::*;

    fn knots(text: &str, fewest: usize) -> Vec<Vec<Knot>> {
        parse(text.as_bytes(), fewest).unwrap()
    }

    /// Control points on a line with one radius give a cylinder, from the second point to the last but one.
    #[test]
    fn a_straight_spline_is_a_cylinder() {
        let curve = &knots("0 0 0 .5\n1 0 0 .5\n2 0 0 .5\n3 0 0 .5\n4 0 0 .5\n", 4)[0];
        let mut patch = Patch::default();
        patch.spline(curve, 0, 2).unwrap();
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

    /// Normals are those of the surface: perpendicular to its tangents, for curves that bend and vary in
    /// radius.
    #[test]
    fn normals_are_across_the_surface() {
        let curve = &knots("0 0 0 .1\n1 .2 0 .3\n1.5 1 .4 .2\n1 2 1 .4\n0 2.5 2 .1\n", 4)[0];
        let mut patch = Patch::default();
        patch.spline(curve, 0, 2).unwrap();
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

    /// Two knots of radius ½ give a cylinder with half spheres, all facing outwards.
    #[test]
    fn a_line_is_a_capsule() {
        let curve = &knots("0 0 0 .5\n2 0 0 .5", 2)[0];
        let mut patch = Patch::default();
        patch.cones(curve, &Mesh::sphere(), 0, 1).unwrap();
        let distance = |p: DVec3| (p - DVec3::new(p.x.clamp(0.0, 2.0), 0.0, 0.0)).length();
        let outermost = patch.positions.iter().map(|&p| distance(p)).fold(0.0, f64::max);
        assert!((outermost - 0.5).abs() < 1e-12, "{outermost}");
        let ends = patch.positions.iter().fold((f64::MAX, f64::MIN), |(l, h), p| (l.min(p.x), h.max(p.x)));
        assert!((ends.0 + 0.5).abs() < 1e-3 && (ends.1 - 2.5).abs() < 1e-3, "{ends:?}");
    }

    /// The parts of spheres hidden by cones are omitted: a sphere between two cones in line leaves a strip
    /// about their common circle.
    #[test]
    fn hidden_parts_of_spheres_are_left_out() {
        let count = |text: &str| {
            let mut patch = Patch::default();
            patch.cones(&knots(text, 2)[0], &Mesh::sphere(), 0, 4).unwrap();
            let (vertices, triangles) = (patch.positions.len(), patch.triangles.len());
            assert!(patch.triangles.iter().flatten().all(|&i| (i as usize) < vertices));
            (vertices, triangles)
        };
        let sphere = Mesh::sphere();
        let (two, three) = (count("0 0 0 .5\n2 0 0 .5"), count("0 0 0 .5\n2 0 0 .5\n4 0 0 .5"));
        assert!(two.1 < 288 + 5 * sphere.triangles().len() / 4, "{two:?}");
        assert!(three.0 - two.0 < 144 + 3 * sphere.positions().len() / 10, "{two:?} {three:?}");
        // A point has no sphere.
        assert_eq!(count("0 0 0 0\n2 0 0 0"), (144, 144));
        // A sphere within another is kept whole, as there is no cone between them.
        let sizes = (2 * sphere.positions().len(), 2 * sphere.triangles().len());
        assert_eq!(count("0 0 0 1\n.5 0 0 .1"), sizes);
    }

    /// Meshes stop at the maximum number of vertices, exceeded by at most one knot's.
    #[test]
    fn meshes_end_where_they_may() {
        let text = "0 0 0 .1\n1 .2 0 .3\n1.5 1 .4 .2\n1 2 1 .4\n0 2.5 2 .1\n";
        let [mut tube, mut cones] = [500, 6000].map(|most| Patch { most, ..Patch::default() });
        assert_eq!(tube.spline(&knots(text, 4)[0], 0, 2), Err(TooMany));
        assert_eq!(cones.cones(&knots(text, 2)[0], &Mesh::sphere(), 0, 4), Err(TooMany));
        assert!(tube.positions.len() < 600 && cones.positions.len() < 12000);
    }
}
