//! Edges that lie upon one another along a stretch. While they move as one, what is seen jumps there at one curve. As they
//! part there are two, and which of them comes first on a line of sight is another on one side of that motion than on the
//! other: so are the derivatives.

use glam::DVec3;

use super::adjacency::{Adjacency, FLAT};
use super::triangle::Tables;
use crate::geometry::{Stretch, common_stretches};

/// Velocities that differ by no more than this part of themselves are the same: they are of the size of
/// rates, wherever the scene is, and their rounding is 10⁻⁶ of it.
pub(super) const SAME: f64 = 1e-9;

/// Edges of two triangles with a stretch in common.
#[derive(Clone, Copy, Debug)]
pub(super) struct EdgeContact {
    pub(super) triangles: [u32; 2],
    stretch: Stretch,
}

impl EdgeContact {
    /// All those of a pair of triangles without a common vertex, each edge once; not those over which a surface goes on
    /// flat.
    pub(super) fn of(tables: Tables<'_>, adjacency: &Adjacency, triangles: [u32; 2]) -> Vec<Self> {
        let [s, t] = triangles.map(|t| tables.triangles[t as usize].positions);
        if s.iter().any(|i| t.contains(i)) {
            return vec![];
        }
        let corners = triangles.map(|t| tables.corners(t));
        let count = |i: usize, edge: usize| is_edge(tables, adjacency, triangles[i], edge);
        let stretches =
            common_stretches(&corners, tables.origin).filter(|s| (0..2).all(|i| count(i, s.edges[i])));
        stretches.map(|stretch| Self { triangles, stretch }).collect()
    }

    /// Whether the edges part, at some rates of all positions: whether the difference of their velocities has a part across
    /// them.
    pub(super) fn is_parted(&self, tables: Tables<'_>, velocities: &[DVec3]) -> bool {
        let ends = |i: usize, table: &[DVec3]| {
            let corners = tables.triangles[self.triangles[i] as usize].positions;
            let edge = self.stretch.edges[i];
            [corners[edge], corners[(edge + 1) % 3]].map(|p| table[p as usize])
        };
        let [p, q] = ends(0, tables.positions);
        let along = (q - p).normalize_or_zero();
        (0..2).any(|end| {
            let [v, w] = [0, 1].map(|i| {
                let [first, last] = ends(i, velocities);
                first.lerp(last, self.stretch.along[i][end])
            });
            (v - w).reject_from_normalized(along).length() > SAME * (v.length() + w.length())
        })
    }
}

/// Whether edge k of a triangle may be seen as an edge, and is not told of by the triangle beyond it.
pub(super) fn is_edge(tables: Tables<'_>, adjacency: &Adjacency, triangle: u32, k: usize) -> bool {
    let Some(other) = adjacency.continued(triangle, k) else { return true };
    let [m, n] = [triangle, other].map(|t| {
        let [a, b, c] = tables.corners(t);
        (b - a).cross(c - a).normalize_or_zero()
    });
    triangle < other && (adjacency.jumps(triangle, k) || m.distance(n) > FLAT)
}
