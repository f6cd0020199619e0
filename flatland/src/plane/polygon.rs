//! Simple polygons with holes.

use std::collections::HashMap;

use glam::DVec2;

use super::box_tree::{Aabb, BoxTree};
use super::orient;
use super::segments::Meeting;
use super::triangulate::{TriangulateError, Triangulation, undirected};

/// Reason why rings do not bound a simple polygon.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum PolygonError {
    /// There is no ring.
    #[error("polygon has no ring")]
    Empty,
    /// A ring with fewer than three vertices.
    #[error("ring {ring} has {count} vertices; 3 is the least")]
    TooFewVertices {
        /// Index of the ring.
        ring: usize,
        /// Number of its vertices.
        count: usize,
    },
    /// A coordinate that is NaN, infinite, above 2²⁰¹, or not 0 and below 2⁻¹⁴² in magnitude.
    #[error("vertex {vertex} of ring {ring} is ({}, {}); coordinates must be 0 or of magnitude 2⁻¹⁴² to 2²⁰¹", position.x, position.y)]
    Coordinate {
        /// Index of the ring.
        ring: usize,
        /// Index of the vertex in the ring.
        vertex: usize,
        /// Its position.
        position: DVec2,
    },
    /// A vertex equal to the previous one.
    #[error("vertex {vertex} of ring {ring} repeats the one before it")]
    RepeatedVertex {
        /// Index of the ring.
        ring: usize,
        /// Index of the vertex in the ring.
        vertex: usize,
    },
    /// Two edges cross, overlap, or one ends inside the other. A ring of zero area is such a case: its edges
    /// overlap.
    #[error("edge {} of ring {} meets edge {} of ring {} in more than a shared vertex", first.1, first.0, second.1, second.0)]
    EdgesMeet {
        /// Ring and edge, the edge by the index of its first vertex.
        first: (usize, usize),
        /// Ring and edge of the other.
        second: (usize, usize),
    },
    /// A displacement inverts a triangle or reduces its area to 0.
    #[error("the displaced vertices turn triangle {triangle} over")]
    TriangleInverted {
        /// Index of the triangle.
        triangle: usize,
    },
    /// The number of displaced vertices differs from the polygon's.
    #[error("{found} displaced vertices for a polygon of {expected}")]
    VertexCount {
        /// Number of vertices of the polygon.
        expected: usize,
        /// Number of vertices given.
        found: usize,
    },
}

/// A simple polygon with holes, triangulated.
///
/// # Guarantees
/// Every ring has at least 3 vertices and positive area; no two edges, of the same ring or of different ones,
/// share more than end points. The interior consists of the points surrounded by an odd number of rings, so
/// rings inside rings are holes whatever their orientation.
#[derive(Clone, Debug)]
pub struct Polygon {
    vertices: Vec<DVec2>,
    /// Start of each ring in `vertices`, and their number at the end.
    rings: Vec<usize>,
    triangles: Vec<[u32; 3]>,
}

impl Polygon {
    /// A polygon without holes.
    ///
    /// # Errors
    /// Any [`PolygonError`] that names a ring.
    pub fn simple(vertices: impl Into<Vec<DVec2>>) -> Result<Self, PolygonError> {
        Self::new(vec![vertices.into()])
    }

    /// A polygon of one or more rings.
    ///
    /// # Errors
    /// Any [`PolygonError`] that names a ring.
    pub fn new(rings: Vec<Vec<DVec2>>) -> Result<Self, PolygonError> {
        if rings.is_empty() {
            return Err(PolygonError::Empty);
        }
        for (ring, vertices) in rings.iter().enumerate() {
            let count = vertices.len();
            if count < 3 {
                return Err(PolygonError::TooFewVertices { ring, count });
            }
            for (vertex, &position) in vertices.iter().enumerate() {
                if !position.to_array().into_iter().all(is_representable) {
                    return Err(PolygonError::Coordinate { ring, vertex, position });
                }
                if position == vertices[(vertex + count - 1) % count] {
                    return Err(PolygonError::RepeatedVertex { ring, vertex });
                }
            }
        }
        let mut starts = vec![0];
        let mut vertices = vec![];
        for ring in rings {
            // −0 and 0 are equal.
            vertices.extend(ring.into_iter().map(|p| p + DVec2::ZERO));
            starts.push(vertices.len());
        }
        let mut polygon = Self { vertices, rings: starts, triangles: vec![] };
        polygon.check_edges()?;
        polygon.triangles = polygon.triangulate();
        Ok(polygon)
    }

    /// Replaces the positions of the vertices, keeping the triangles.
    ///
    /// # Errors
    /// [`PolygonError::TriangleInverted`] if a triangle would turn over, [`PolygonError::EdgesMeet`] if the
    /// polygon would overlap itself, [`PolygonError::VertexCount`] if their number differs,
    /// [`PolygonError::Coordinate`] if one cannot be represented.
    pub fn displaced(&self, vertices: Vec<DVec2>) -> Result<Self, PolygonError> {
        if vertices.len() != self.vertices.len() {
            let (expected, found) = (self.vertices.len(), vertices.len());
            return Err(PolygonError::VertexCount { expected, found });
        }
        let vertices: Vec<_> = vertices.into_iter().map(|p| p + DVec2::ZERO).collect();
        let bad = |p: &DVec2| !p.to_array().into_iter().all(is_representable);
        if let Some(i) = vertices.iter().position(bad) {
            let (ring, vertex) = self.ring_of(i);
            return Err(PolygonError::Coordinate { ring, vertex, position: vertices[i] });
        }
        let corner = |i: u32| vertices[i as usize];
        let inverted = |t: &[u32; 3]| orient(corner(t[0]), corner(t[1]), corner(t[2])) <= 0.0;
        if let Some(triangle) = self.triangles.iter().position(inverted) {
            return Err(PolygonError::TriangleInverted { triangle });
        }
        let displaced = Self { vertices, ..self.clone() };
        displaced.check_edges().map(|()| displaced)
    }

    /// All vertices, ring by ring.
    #[must_use]
    pub fn vertices(&self) -> &[DVec2] {
        &self.vertices
    }

    /// The vertices of each ring.
    pub fn rings(&self) -> impl Iterator<Item = &[DVec2]> {
        self.rings.windows(2).map(|w| &self.vertices[w[0]..w[1]])
    }

    /// Every edge as the indices of its two vertices.
    pub fn edges(&self) -> impl Iterator<Item = [usize; 2]> {
        self.rings.windows(2).flat_map(|w| {
            let (start, end) = (w[0], w[1]);
            (start..end).map(move |i| [i, if i + 1 == end { start } else { i + 1 }])
        })
    }

    /// The triangles of the interior, positively oriented, as vertex indices.
    #[must_use]
    pub fn triangles(&self) -> &[[u32; 3]] {
        &self.triangles
    }

    fn ring_of(&self, vertex: usize) -> (usize, usize) {
        let ring = self.rings.partition_point(|&start| start <= vertex) - 1;
        (ring, vertex - self.rings[ring])
    }

    /// Refuses edges that share more than end points.
    fn check_edges(&self) -> Result<(), PolygonError> {
        let edges: Vec<_> = self.edges().collect();
        let point = |i: usize| self.vertices[i];
        let boxes: Vec<_> = edges.iter().map(|e| Aabb::of(e.map(point))).collect();
        let tree = BoxTree::build(&boxes);
        for (i, &[a, b]) in edges.iter().enumerate() {
            let mut found = None;
            tree.visit(
                |bounds| bounds.overlaps(&boxes[i]),
                |j| {
                    let [c, d] = edges[j];
                    if j > i && found.is_none() && edges_meet([a, b].map(point), [c, d].map(point)) {
                        found = Some(c);
                    }
                },
            );
            if let Some(c) = found {
                return Err(PolygonError::EdgesMeet { first: self.ring_of(a), second: self.ring_of(c) });
            }
        }
        Ok(())
    }

    /// Triangles of the interior. Where rings touch in a vertex, several vertices share one position; each
    /// corner then takes the vertex of the boundary edges that bound its own wedge, so that the polygon may
    /// separate there.
    fn triangulate(&self) -> Vec<[u32; 3]> {
        let mut ids = HashMap::new();
        let mut points: Vec<DVec2> = vec![];
        let mut owners: Vec<Vec<u32>> = vec![];
        let of_vertex: Vec<u32> = (0_u32..)
            .zip(&self.vertices)
            .map(|(v, &p)| {
                let id = *ids.entry(p.to_array().map(f64::to_bits)).or_insert_with(|| {
                    points.push(p);
                    owners.push(vec![]);
                    points.len() as u32 - 1
                });
                owners[id as usize].push(v);
                id
            })
            .collect();
        let edges: Vec<_> = self.edges().map(|e| e.map(|v| of_vertex[v])).collect();
        let mesh = match Triangulation::new(&points, &edges) {
            Ok(mesh) => mesh,
            Err(TriangulateError::Coordinate | TriangulateError::Crossing) => {
                unreachable!("coordinates and edges were checked")
            }
        };
        let boundary: HashMap<[u32; 2], [usize; 2]> =
            edges.iter().map(|&e| undirected(e)).zip(self.edges()).collect();
        let mut inside = vec![false; mesh.triangles.len()];
        mesh.flood(|from, edge, to| {
            let before = inside.get(from as usize).copied().unwrap_or(false);
            inside[to as usize] = before ^ boundary.contains_key(&undirected(edge));
        });
        let vertex = |t: usize, k: usize| {
            let point = mesh.triangles[t][k];
            if let [only] = owners[point as usize][..] {
                return only;
            }
            // Rotate about the point, across edges that are not boundary, to the boundary edge.
            let (mut t, mut k) = (t, k);
            loop {
                if let Some(e) = boundary.get(&undirected(mesh.edge(t, k))) {
                    let v = e[usize::from(of_vertex[e[0]] != point)];
                    return v as u32;
                }
                t = mesh.neighbours[t][k] as usize;
                k = (0..3).find(|&j| mesh.triangles[t][j] == point).expect("a shared corner");
            }
        };
        (0..mesh.triangles.len()).filter(|&t| inside[t]).map(|t| [0, 1, 2].map(|k| vertex(t, k))).collect()
    }
}

/// Whether a coordinate can be triangulated: 0, or of magnitude 2⁻¹⁴² to 2²⁰¹.
fn is_representable(x: f64) -> bool {
    spade::validate_coordinate(x).is_ok()
}

/// Whether two edges share more than end points.
fn edges_meet(ab: [DVec2; 2], cd: [DVec2; 2]) -> bool {
    let same = ab == cd || ab == [cd[1], cd[0]];
    same || !Meeting::of(ab, cd).is_none()
}

#[cfg(test)]
mod tests {
    use super::*;

    fn ring(points: &[(f64, f64)]) -> Vec<DVec2> {
        points.iter().map(|&(x, y)| DVec2::new(x, y)).collect()
    }

    fn area(p: &Polygon) -> f64 {
        let v = |i: u32| p.vertices[i as usize];
        p.triangles.iter().map(|t| 0.5 * orient(v(t[0]), v(t[1]), v(t[2]))).sum()
    }

    #[test]
    fn square_with_a_hole() {
        let outer = ring(&[(0.0, 0.0), (4.0, 0.0), (4.0, 4.0), (0.0, 4.0)]);
        let hole = ring(&[(1.0, 1.0), (3.0, 1.0), (3.0, 3.0), (1.0, 3.0)]);
        let p = Polygon::new(vec![outer, hole]).unwrap();
        assert_eq!(area(&p), 12.0);
        assert_eq!(p.edges().count(), 8);
    }

    #[test]
    fn rings_may_touch_in_a_vertex_and_come_apart() {
        // Two triangles that share the origin, as two rings of one polygon.
        let left = ring(&[(0.0, 0.0), (-1.0, 1.0), (-1.0, -1.0)]);
        let right = ring(&[(0.0, 0.0), (1.0, -1.0), (1.0, 1.0)]);
        let p = Polygon::new(vec![left, right]).unwrap();
        assert_eq!(area(&p), 2.0);
        let mut corners: Vec<_> = p
            .triangles
            .iter()
            .map(|t| {
                let mut t = *t;
                t.sort_unstable();
                t
            })
            .collect();
        corners.sort_unstable();
        assert_eq!(corners, [[0, 1, 2], [3, 4, 5]]);
    }

    #[test]
    fn bad_rings_are_refused_with_their_place() {
        let refuse = |points: &[(f64, f64)]| Polygon::simple(ring(points)).unwrap_err();
        assert_eq!(Polygon::new(vec![]).unwrap_err(), PolygonError::Empty);
        assert_eq!(refuse(&[(0.0, 0.0), (1.0, 0.0)]), PolygonError::TooFewVertices { ring: 0, count: 2 });
        assert_eq!(
            refuse(&[(0.0, 0.0), (1.0, 0.0), (1.0, 0.0), (0.0, 1.0)]),
            PolygonError::RepeatedVertex { ring: 0, vertex: 2 }
        );
        assert!(matches!(
            refuse(&[(0.0, 0.0), (1.0, f64::NAN), (0.0, 1.0)]),
            PolygonError::Coordinate { ring: 0, vertex: 1, .. }
        ));
        assert!(matches!(refuse(&[(0.0, 0.0), (1.0, 1e-60), (0.0, 1.0)]), PolygonError::Coordinate { .. }));
        let meets: [&[(f64, f64)]; 4] = [
            // A bow tie, a collinear ring, a spike, a vertex inside another edge.
            &[(0.0, 0.0), (1.0, 1.0), (1.0, 0.0), (0.0, 1.0)],
            &[(0.0, 0.0), (1.0, 0.0), (2.0, 0.0)],
            &[(0.0, 0.0), (2.0, 0.0), (2.0, 2.0), (2.0, 0.5), (0.0, 2.0)],
            &[(0.0, 0.0), (2.0, 0.0), (2.0, 2.0), (1.0, 0.0), (0.0, 2.0)],
        ];
        for points in meets {
            assert!(matches!(refuse(points), PolygonError::EdgesMeet { .. }), "{points:?}");
        }
    }

    #[test]
    fn displacement_keeps_the_triangles_or_is_refused() {
        let p = Polygon::simple(ring(&[(0.0, 0.0), (1.0, 0.0), (0.0, 1.0)])).unwrap();
        let moved = p.displaced(ring(&[(0.0, 0.0), (3.0, 0.0), (0.0, 1.0)])).unwrap();
        assert_eq!(area(&moved), 1.5);
        let flipped = p.displaced(ring(&[(0.0, 0.0), (-1.0, 0.0), (0.0, 1.0)]));
        assert_eq!(flipped.unwrap_err(), PolygonError::TriangleInverted { triangle: 0 });
    }
}
