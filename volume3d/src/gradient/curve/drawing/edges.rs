//! Unique edges and crossings of a scene, with their adjacent triangles.

use std::collections::HashSet;
use std::sync::Arc;

use glam::DVec3;
use rayon::prelude::*;

use crate::geometry::Edges;
use crate::gradient::jump_mean::Faces;
use crate::scene::FLAT as COPLANAR;
use crate::scene::{Hit, Reflectance, Scene, Span, Surface, parts};

/// Angle between two faces up to which they count as coplanar, for rounding.
const FLAT: f64 = 1e-12;

/// Largest tilt that rounding of the input positions can cause for well-shaped faces; a larger angle is a
/// fold.
const MOST_TILT: f64 = COPLANAR;

/// A triangle adjacent to an edge.
#[derive(Clone, Copy, Debug)]
pub(in crate::gradient::curve) struct Face {
    pub(in crate::gradient::curve) triangle: u32,
    /// The corner not on the edge; for a crossing, any corner.
    opposite: u32,
}

/// An edge or crossing, with the range of its triangles in the list.
#[derive(Clone, Copy, Debug)]
pub(in crate::gradient::curve) struct Edge {
    pub(in crate::gradient::curve) span: Span,
    /// Shapes of its triangles; for an edge, the same one twice.
    pub(in crate::gradient::curve) shapes: [u32; 2],
    /// Whether the edge is a discontinuity from every viewpoint; otherwise only as a silhouette.
    pub(in crate::gradient::curve) is_discontinuity: bool,
    /// Whether it represents a crossing along it: another surface passes through the fold.
    pub(in crate::gradient::curve) crossed: bool,
    first: u32,
    count: u32,
    /// Range of the triangles of all coincident edges, those of other shapes included.
    first_there: u32,
    count_there: u32,
    /// See [`EdgeList::find_limits`].
    pub(in crate::gradient::curve) limits: Option<[DVec3; 2]>,
}

/// All edges at which visible radiance may be discontinuous.
#[derive(Clone, Debug, Default)]
pub(in crate::gradient::curve) struct EdgeList {
    pub(in crate::gradient::curve) edges: Vec<Edge>,
    faces: Vec<Face>,
    /// For each triangle, the first of those that continue it in its plane.
    plane: Arc<[u32]>,
}

impl EdgeList {
    pub(in crate::gradient::curve) fn new(scene: &Scene) -> Self {
        let places = places(scene);
        let mut list = Self { plane: Faces::grown(scene), ..Self::default() };
        let place = Curve::new(scene);
        list.edges.reserve(3 * scene.triangles.len() / 2);
        list.faces.reserve(3 * scene.triangles.len());
        let at_places = scene.triangles.iter().map(|t| t.positions.map(|i| places[i as usize]));
        for there in Edges::of(at_places).iter() {
            let (first_there, count_there) = (list.faces.len() as u32, there.len() as u32);
            // Each shape has one edge at a place, and its triangles are contiguous.
            let shape = |triangle: u32| scene.triangles[triangle as usize].shape;
            for group in there.chunk_by(|a, b| shape(a.triangle) == shape(b.triangle)) {
                let (triangle, k) = (group[0].triangle, group[0].corner as usize);
                let corners = scene.triangles[triangle as usize].positions;
                let [a, b] = [corners[k], corners[(k + 1) % 3]];
                list.edges.push(Edge {
                    span: Span::Edge([a.min(b), a.max(b)]),
                    shapes: [shape(triangle); 2],
                    is_discontinuity: scene.adjacency.jumps(triangle, k),
                    crossed: false,
                    first: list.faces.len() as u32,
                    count: group.len() as u32,
                    first_there,
                    count_there,
                    limits: None,
                });
                list.faces.extend(group.iter().map(|side| Face {
                    triangle: side.triangle,
                    opposite: scene.triangles[side.triangle as usize].positions
                        [(side.corner as usize + 2) % 3],
                }));
            }
        }
        list.add_crossings(scene);
        // Samples are stratified along the list: neighbours in the list should be neighbours in space.
        list.edges.par_sort_by_cached_key(|edge| {
            let [a, b] = edge.span(scene);
            place.at(a.midpoint(b))
        });
        let mut edges = std::mem::take(&mut list.edges);
        edges.par_iter_mut().for_each(|edge| edge.limits = list.find_limits(scene, edge));
        list.edges = edges;
        list
    }

    fn add_crossings(&mut self, scene: &Scene) {
        let mut along = HashSet::new();
        for (index, crossing) in (0..).zip(scene.crossings().all()) {
            let [own, _] = crossing.triangles;
            if let Some(other) = crossing.continued.filter(|&other| are_folded(scene, own, other)) {
                // It is already in the list as an edge, which covers the same discontinuity.
                along.insert(in_order(own, other));
                continue;
            }
            let first = self.faces.len() as u32;
            let face =
                |triangle: u32| Face { triangle, opposite: scene.triangles[triangle as usize].positions[0] };
            // Along an edge within a plane, both of its triangles meet the other surface.
            self.faces.extend(crossing.triangles.into_iter().chain(crossing.continued).map(face));
            let count = self.faces.len() as u32 - first;
            self.edges.push(Edge {
                span: Span::Crossing(index),
                shapes: crossing.shapes(&scene.triangles),
                is_discontinuity: true,
                crossed: true,
                first,
                count,
                first_there: first,
                count_there: count,
                limits: None,
            });
        }
        let crossed = |edge: &Edge| match self.faces(edge) {
            [f, g] => along.contains(&in_order(f.triangle, g.triangle)),
            _ => false,
        };
        let crossed: Vec<bool> = self.edges.iter().map(|edge| edge.crossed || crossed(edge)).collect();
        self.edges.iter_mut().zip(crossed).for_each(|(edge, crossed)| edge.crossed = crossed);
    }

    /// Triangles adjacent to an edge.
    pub(in crate::gradient::curve) fn faces(&self, edge: &Edge) -> &[Face] {
        &self.faces[edge.first as usize..(edge.first + edge.count) as usize]
    }

    /// Indices of the triangles adjacent to an edge.
    pub(in crate::gradient::curve) fn triangles(&self, edge: &Edge) -> impl Iterator<Item = u32> {
        self.faces(edge).iter().map(|face| face.triangle)
    }

    /// Whether an edge bounds faces, rather than separating two triangles of one face.
    pub(in crate::gradient::curve) fn bounds_faces(&self, edge: &Edge) -> bool {
        let mut planes = self.triangles(edge).map(|t| self.plane[t as usize]);
        let first = planes.next();
        edge.is_discontinuity || planes.any(|plane| Some(plane) != first)
    }

    /// Whether radiance may be discontinuous at an edge: not between coplanar triangles that continue one
    /// another.
    ///
    /// A fold with smooth shading is a discontinuity as well: a light may be above the horizon of one face
    /// and below that of the other, while the shading normals of both reflect it.
    pub(in crate::gradient::curve) fn may_be_discontinuous(&self, scene: &Scene, edge: &Edge) -> bool {
        edge.is_discontinuity || !self.is_flat(scene, edge)
    }

    /// Whether an edge separates two coplanar triangles that continue one another.
    pub(in crate::gradient::curve) fn is_flat(&self, scene: &Scene, edge: &Edge) -> bool {
        let tilt = || self.triangles(edge).map(|t| scene.tilt(t)).sum::<f64>();
        edge.limits.is_some_and(|[u, v]| {
            let angle = u.distance(v);
            // `tilt` is evaluated only where it may matter: it exceeds the bound only for slivers.
            angle <= FLAT || angle <= MOST_TILT && angle <= tilt()
        })
    }

    /// Whether triangles lie before and behind the plane with this normal through an edge.
    pub(in crate::gradient::curve) fn occupied(
        &self,
        scene: &Scene,
        edge: &Edge,
        normal: DVec3,
    ) -> [bool; 2] {
        if edge.is_crossing() {
            return [true; 2];
        }
        let [start, _] = edge.span(scene);
        let mut sides = [false; 2];
        for face in self.faces(edge) {
            let height = (scene.positions[face.opposite as usize] - start).dot(normal);
            sides[usize::from(height > 0.0)] = true;
        }
        sides
    }

    /// For an edge of two triangles: unit vectors orthogonal to it, one into the first triangle and one away
    /// from the second. The edge is a silhouette in directions between the two, and in their opposites.
    fn find_limits(&self, scene: &Scene, edge: &Edge) -> Option<[DVec3; 2]> {
        let [f, g] = self.faces(edge) else { return None };
        if edge.is_crossing() {
            return None;
        }
        let [a, b] = edge.span(scene);
        let e = (b - a).normalize_or_zero();
        let away = |face: &Face| {
            let way = scene.positions[face.opposite as usize] - a;
            (way - way.dot(e) * e).normalize_or_zero()
        };
        Some([away(f), -away(g)])
    }

    /// Whether an edge belongs to the surface hit next to it and has at most two triangles: there a softened
    /// field follows it exactly.
    pub(in crate::gradient::curve) fn owns(&self, edge: &Edge, hit: Option<Hit>) -> bool {
        let of_few = !edge.is_crossing() && self.faces(edge).len() <= 2;
        of_few && hit.is_some_and(|hit| self.has(edge, hit.surface))
    }

    /// Whether a surface is one of those adjacent to an edge.
    pub(in crate::gradient::curve) fn has(&self, edge: &Edge, surface: Surface) -> bool {
        self.continues(self.faces(edge), surface)
    }

    /// Whether a surface is one of the triangles or continues one in its plane: the surface seen next to an
    /// edge may be the next triangle of a narrow face, or of one seen almost edge-on.
    fn continues(&self, faces: &[Face], surface: Surface) -> bool {
        let Surface::Triangle(triangle) = surface else { return false };
        faces.iter().any(|f| self.plane[f.triangle as usize] == self.plane[triangle as usize])
    }
}

impl EdgeList {
    /// Whether a surface is adjacent to an edge with the same ends, possibly of another shape.
    pub(in crate::gradient::curve) fn has_there(&self, edge: &Edge, surface: Surface) -> bool {
        let range = edge.first_there as usize..(edge.first_there + edge.count_there) as usize;
        self.continues(&self.faces[range], surface)
    }
}

/// Whether triangles that continue one another are not coplanar.
pub(in crate::gradient::curve) fn are_folded(scene: &Scene, s: u32, t: u32) -> bool {
    let normal = |t: u32| {
        let [a, b, c] = scene.corners(t);
        (b - a).cross(c - a).normalize_or_zero()
    };
    normal(s).distance(normal(t)) > COPLANAR
}

/// A pair of triangles in ascending order.
fn in_order(a: u32, b: u32) -> [u32; 2] {
    [a.min(b), a.max(b)]
}

/// Positions along a space-filling curve in the scene's bounding box (Morton 1966).
struct Curve {
    low: DVec3,
    scale: DVec3,
}

/// Bits per coordinate.
const BITS: u32 = 20;

impl Curve {
    fn new(scene: &Scene) -> Self {
        let (low, high) = scene.bounds().unwrap_or_default();
        let cells = f64::from((1_u32 << BITS) - 1);
        Self { low, scale: cells / (high - low).max(DVec3::splat(f64::MIN_POSITIVE)) }
    }

    fn at(&self, p: DVec3) -> u64 {
        let [x, y, z] = ((p - self.low) * self.scale).to_array().map(|x| apart(x as u64));
        x | y << 1 | z << 2
    }
}

/// Spreads the lowest 20 bits, with two zero bits between neighbours.
fn apart(mut bits: u64) -> u64 {
    bits &= (1 << BITS) - 1;
    for (shift, kept) in [
        (32, 0x001f_0000_0000_ffff),
        (16, 0x001f_0000_ff00_00ff),
        (8, 0x100f_00f0_0f00_f00f),
        (4, 0x10c3_0c30_c30c_30c3),
        (2, 0x1249_2492_4924_9249),
    ] {
        bits = (bits | bits << shift) & kept;
    }
    bits
}

/// For each position, the first one at the same place.
fn places(scene: &Scene) -> Vec<u32> {
    // Adding 0 maps −0 to 0.
    let bits = |i: u32| scene.positions[i as usize].to_array().map(|x| (x + 0.0).to_bits());
    let mut order: Vec<u32> = (0..scene.positions.len() as u32).collect();
    order.par_sort_unstable_by_key(|&i| (bits(i), i));
    let mut places = vec![0; order.len()];
    for there in order.chunk_by(|&a, &b| bits(a) == bits(b)) {
        there.iter().for_each(|&i| places[i as usize] = there[0]);
    }
    places
}

impl Edge {
    /// Both ends.
    pub(in crate::gradient::curve) fn span(&self, scene: &Scene) -> [DVec3; 2] {
        self.span.ends(scene)
    }

    /// Whether it is a crossing of two triangles. It does not change visibility: only the radiance of these
    /// two is discontinuous.
    pub(in crate::gradient::curve) fn is_crossing(&self) -> bool {
        matches!(self.span, Span::Crossing(_))
    }

    /// Whether it is a crossing along an edge within a plane, which it may leave as it moves: the whole
    /// discontinuity is assigned to it.
    pub(in crate::gradient::curve) fn runs_along_an_edge(&self, scene: &Scene) -> bool {
        matches!(self.span, Span::Crossing(index) if scene.crossings().get(index).continued.is_some())
    }
}

/// Whether a triangle reflects light.
pub(in crate::gradient::curve) fn reflects(scene: &Scene, triangle: u32) -> bool {
    let material = scene.material_of(Surface::Triangle(triangle));
    parts(&scene.description.materials, material).into_iter().any(|part| {
        let bsdf = &scene.description.materials[part].bsdf;
        !bsdf.is_scaled() || *bsdf.reflectance() != Reflectance::Constant(DVec3::ZERO)
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn bits_are_put_apart_one_by_one() {
        for bits in [0, 1, 0b1011, 0xf_ffff, 0x9_3a7c] {
            let expected: u64 = (0..BITS).map(|k| (bits >> k & 1) << (3 * k)).sum();
            assert_eq!(apart(bits), expected, "{bits:x}");
        }
    }
}
