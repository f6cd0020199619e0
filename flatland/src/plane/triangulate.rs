//! Constrained Delaunay triangulation by `spade`, reduced to index lists.

use glam::DVec2;
use spade::{ConstrainedDelaunayTriangulation, HasPosition, Point2, Triangulation as _};

/// Reason why points and edges cannot be triangulated.
#[derive(Clone, Copy, Debug, PartialEq, Eq, thiserror::Error)]
pub(crate) enum TriangulateError {
    /// A coordinate is not finite, above 2²⁰¹, or not 0 and below 2⁻¹⁴².
    #[error("a coordinate is not 0 and not of magnitude 2⁻¹⁴² to 2²⁰¹")]
    Coordinate,
    /// Two constraints cross.
    #[error("edges cross")]
    Crossing,
}

/// Index for no triangle: beyond the convex hull.
pub(crate) const OUTSIDE: u32 = u32::MAX;

/// Triangles over distinct points. Corner k of a triangle starts the edge to corner k + 1.
#[derive(Clone, Debug, Default)]
pub(crate) struct Triangulation {
    /// Corners, positively oriented.
    pub(crate) triangles: Vec<[u32; 3]>,
    /// The triangle across each edge, or [`OUTSIDE`].
    pub(crate) neighbours: Vec<[u32; 3]>,
}

struct Vertex(DVec2);

impl HasPosition for Vertex {
    type Scalar = f64;
    fn position(&self) -> Point2<f64> {
        Point2::new(self.0.x, self.0.y)
    }
}

impl Triangulation {
    /// Triangulates the convex hull of `points`, which must be distinct, keeping all `edges`.
    pub(crate) fn new(points: &[DVec2], edges: &[[u32; 2]]) -> Result<Self, TriangulateError> {
        let vertices = points.iter().map(|&p| Vertex(p)).collect();
        let edges = edges.iter().map(|e| e.map(|i| i as usize)).collect();
        let mut crossing = false;
        let mesh: ConstrainedDelaunayTriangulation<Vertex> =
            ConstrainedDelaunayTriangulation::try_bulk_load_cdt(vertices, edges, |_| crossing = true)
                .map_err(|_| TriangulateError::Coordinate)?;
        if crossing {
            return Err(TriangulateError::Crossing);
        }
        debug_assert_eq!(mesh.num_vertices(), points.len(), "points are distinct");
        let index = |i: usize| u32::try_from(i).expect("fewer than 2³² faces");
        let mut this = Self::default();
        // Inner faces are numbered from 1 in spade, 0 being the outside.
        for face in mesh.inner_faces() {
            let edges = face.adjacent_edges();
            this.triangles.push(edges.map(|e| index(e.from().fix().index())));
            this.neighbours.push(
                edges.map(|e| e.rev().face().as_inner().map_or(OUTSIDE, |f| index(f.fix().index()) - 1)),
            );
        }
        Ok(this)
    }

    /// Calls `cross(triangle, edge, neighbour)` once for every triangle reached from the outside, each before
    /// the triangles behind it. At the hull `triangle` is [`OUTSIDE`] and `edge` is an edge of the neighbour.
    pub(crate) fn flood(&self, mut cross: impl FnMut(u32, [u32; 2], u32)) {
        let mut seen = vec![false; self.triangles.len()];
        let mut todo = vec![];
        for (t, neighbours) in self.neighbours.iter().enumerate() {
            for (k, &neighbour) in neighbours.iter().enumerate() {
                if neighbour == OUTSIDE && !seen[t] {
                    seen[t] = true;
                    cross(OUTSIDE, self.edge(t, k), t as u32);
                    todo.push(t);
                }
            }
        }
        while let Some(t) = todo.pop() {
            for k in 0..3 {
                let n = self.neighbours[t][k];
                if n != OUTSIDE && !seen[n as usize] {
                    seen[n as usize] = true;
                    cross(t as u32, self.edge(t, k), n);
                    todo.push(n as usize);
                }
            }
        }
    }

    /// Edge k of triangle t, from its start to its end.
    pub(crate) fn edge(&self, t: usize, k: usize) -> [u32; 2] {
        [self.triangles[t][k], self.triangles[t][(k + 1) % 3]]
    }
}

/// An edge regardless of its direction, as a key.
pub(crate) fn undirected([a, b]: [u32; 2]) -> [u32; 2] {
    [a.min(b), a.max(b)]
}
