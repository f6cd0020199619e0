//! Unique edges and crossings of a scene, with their adjacent triangles.

use std::collections::HashSet;
use std::sync::Arc;

use glam::DVec3;
use rayon::prelude::*;

use super::faces;
use super::morton::Curve;
use crate::geometry::{Edges, HalfEdge};
use crate::scene::FLAT as COPLANAR;
use crate::scene::{Hit, Scene, Span, Surface};

/// Angle between two faces up to which they count as coplanar, for rounding.
const FLAT: f64 = 1e-12;

/// Largest tilt that rounding of the input positions can cause for well-shaped faces; a larger angle is a
/// fold.
const MOST_TILT: f64 = COPLANAR;

/// A triangle adjacent to an edge.
#[derive(Clone, Copy, Debug)]
pub(in crate::gradient) struct Face {
    pub(in crate::gradient) triangle: u32,
    /// The corner not on the edge; for a crossing, any corner.
    opposite: u32,
}

/// An edge or crossing, with the range of its triangles in the list.
#[derive(Clone, Copy, Debug)]
pub(in crate::gradient) struct Edge {
    pub(in crate::gradient) span: Span,
    /// Shapes of its triangles; for an edge, the same one twice.
    pub(in crate::gradient) shapes: [u32; 2],
    /// Whether the edge is a discontinuity from every viewpoint; otherwise only as a silhouette.
    pub(in crate::gradient) is_discontinuity: bool,
    /// Whether it has two triangles, and one continues the surface of the other.
    pub(in crate::gradient) is_continued: bool,
    /// Whether it represents a crossing along it: another surface passes through the fold.
    pub(in crate::gradient) crossed: bool,
    first: u32,
    count: u32,
    /// Range of the triangles of all coincident edges, those of other shapes included.
    first_there: u32,
    count_there: u32,
    /// See [`EdgeList::find_limits`].
    pub(in crate::gradient) limits: Option<[DVec3; 2]>,
}

/// All edges at which visible radiance may be discontinuous.
#[derive(Clone, Debug, Default)]
pub(in crate::gradient) struct EdgeList {
    pub(in crate::gradient) edges: Vec<Edge>,
    faces: Vec<Face>,
    /// First triangle of each triangle's face.
    first: Arc<[u32]>,
}

impl EdgeList {
    pub(in crate::gradient) fn new(scene: &Scene) -> Self {
        let places = places(scene);
        let mut list = Self { first: faces::grow(scene).into(), ..Self::default() };
        let place = Curve::new(scene);
        list.edges.reserve(3 * scene.triangles.len() / 2);
        list.faces.reserve(3 * scene.triangles.len());
        let at_places = scene.triangles.iter().map(|t| t.positions.map(|i| places[i as usize]));
        let ends = |side: &HalfEdge| {
            let corners = scene.triangles[side.triangle as usize].positions;
            let [a, b] = [side.corner, (side.corner + 1) % 3].map(|k| corners[k as usize]);
            [a.min(b), a.max(b)]
        };
        let mut there = vec![];
        for sides in Edges::of(at_places).iter() {
            there.clear();
            there.extend_from_slice(sides);
            // One shape after the other, as each has its range of positions.
            there.sort_by_key(ends);
            let (first_there, count_there) = (list.faces.len() as u32, there.len() as u32);
            for group in there.chunk_by(|a, b| ends(a) == ends(b)) {
                let (triangle, k) = (group[0].triangle, group[0].corner as usize);
                list.edges.push(Edge {
                    span: Span::Edge(ends(&group[0])),
                    shapes: [scene.triangles[triangle as usize].shape; 2],
                    is_discontinuity: scene.adjacency.jumps(triangle, k),
                    is_continued: scene.adjacency.continued(triangle, k).is_some(),
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
                is_continued: false,
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

    /// First triangle of each triangle's face.
    pub(in crate::gradient) fn first(&self) -> &Arc<[u32]> {
        &self.first
    }

    /// Every edge, without crossings, in the order of its ends.
    pub(in crate::gradient) fn by_ends(&self) -> Vec<&Edge> {
        let mut edges: Vec<&Edge> = self.edges.iter().filter(|edge| !edge.is_crossing()).collect();
        edges.par_sort_unstable_by_key(|edge| edge.span);
        edges
    }

    /// Triangles adjacent to an edge.
    pub(in crate::gradient) fn faces(&self, edge: &Edge) -> &[Face] {
        &self.faces[edge.first as usize..(edge.first + edge.count) as usize]
    }

    /// Indices of the triangles adjacent to an edge.
    pub(in crate::gradient) fn triangles(&self, edge: &Edge) -> impl Iterator<Item = u32> {
        self.faces(edge).iter().map(|face| face.triangle)
    }

    /// Whether an edge bounds faces, rather than separating two triangles of one face.
    pub(in crate::gradient) fn bounds_faces(&self, edge: &Edge) -> bool {
        let mut faces = self.triangles(edge).map(|t| self.first[t as usize]);
        let first = faces.next();
        edge.is_discontinuity || faces.any(|face| Some(face) != first)
    }

    /// Whether radiance may be discontinuous at an edge: not between coplanar triangles that continue one
    /// another.
    ///
    /// A fold with smooth shading is a discontinuity as well: a light may be above the horizon of one face
    /// and below that of the other, while the shading normals of both reflect it.
    pub(in crate::gradient) fn may_be_discontinuous(&self, scene: &Scene, edge: &Edge) -> bool {
        edge.is_discontinuity || !self.is_flat(scene, edge)
    }

    /// Whether an edge separates two coplanar triangles that continue one another.
    pub(in crate::gradient) fn is_flat(&self, scene: &Scene, edge: &Edge) -> bool {
        let tilt = || self.triangles(edge).map(|t| scene.tilt(t)).sum::<f64>();
        edge.limits.is_some_and(|[u, v]| {
            let angle = u.distance(v);
            // `tilt` is evaluated only where it may matter: it exceeds the bound only for slivers.
            angle <= FLAT || angle <= MOST_TILT && angle <= tilt()
        })
    }

    /// Whether triangles lie before and behind the plane with this normal through an edge.
    pub(in crate::gradient) fn occupied(&self, scene: &Scene, edge: &Edge, normal: DVec3) -> [bool; 2] {
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
    pub(in crate::gradient) fn owns(&self, edge: &Edge, hit: Option<Hit>) -> bool {
        let of_few = !edge.is_crossing() && self.faces(edge).len() <= 2;
        of_few && hit.is_some_and(|hit| self.has(edge, hit.surface))
    }

    /// Whether a surface is one of those adjacent to an edge.
    pub(in crate::gradient) fn has(&self, edge: &Edge, surface: Surface) -> bool {
        self.continues(self.faces(edge), surface)
    }

    /// Whether a surface is one of the triangles or continues one in its plane: the surface seen next to an
    /// edge may be the next triangle of a narrow face, or of one seen almost edge-on.
    fn continues(&self, faces: &[Face], surface: Surface) -> bool {
        let Surface::Triangle(triangle) = surface else { return false };
        faces.iter().any(|f| self.first[f.triangle as usize] == self.first[triangle as usize])
    }
}

impl EdgeList {
    /// Whether a surface is adjacent to an edge with the same ends, possibly of another shape.
    pub(in crate::gradient) fn has_there(&self, edge: &Edge, surface: Surface) -> bool {
        let range = edge.first_there as usize..(edge.first_there + edge.count_there) as usize;
        self.continues(&self.faces[range], surface)
    }
}

/// Whether triangles that continue one another are not coplanar.
pub(in crate::gradient) fn are_folded(scene: &Scene, s: u32, t: u32) -> bool {
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
    pub(in crate::gradient) fn span(&self, scene: &Scene) -> [DVec3; 2] {
        self.span.ends(scene)
    }

    /// Whether it is a crossing of two triangles. It does not change visibility: only the radiance of these
    /// two is discontinuous.
    pub(in crate::gradient) fn is_crossing(&self) -> bool {
        matches!(self.span, Span::Crossing(_))
    }

    /// Whether it is a crossing along an edge within a plane, which it may leave as it moves: the whole
    /// discontinuity is assigned to it.
    pub(in crate::gradient) fn runs_along_an_edge(&self, scene: &Scene) -> bool {
        matches!(self.span, Span::Crossing(index) if scene.crossings().get(index).continued.is_some())
    }
}
