//! Edges that coincide along a stretch. While they move together, they form one discontinuity. As they
//! separate there are two, and their order along a line of sight depends on the sign of the motion: the
//! one-sided derivatives differ.

use glam::DVec3;

use super::adjacency::{Adjacency, FLAT};
use super::triangle::Tables;
use crate::geometry::{Stretch, common_stretches};

/// Relative difference up to which velocities count as equal. Velocities do not scale with the scene's
/// coordinates, and their relative rounding is 10⁻⁶ of this.
pub(super) const SAME: f64 = 1e-9;

/// Edges of two triangles that share a stretch.
#[derive(Clone, Copy, Debug)]
pub(super) struct EdgeContact {
    pub(super) triangles: [u32; 2],
    stretch: Stretch,
}

impl EdgeContact {
    /// All contacts of a pair of triangles without a common vertex, each edge once; without edges across
    /// which a surface continues flat.
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

    /// Whether the edges separate at given velocities of all positions: whether the difference of their
    /// velocities has a component orthogonal to them.
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

/// Whether edge k of a triangle may be visible as an edge, and is not reported by the adjacent triangle.
pub(super) fn is_edge(tables: Tables<'_>, adjacency: &Adjacency, triangle: u32, k: usize) -> bool {
    let Some(other) = adjacency.continued(triangle, k) else { return true };
    let [m, n] = [triangle, other].map(|t| {
        let [a, b, c] = tables.corners(t);
        (b - a).cross(c - a).normalize_or_zero()
    });
    triangle < other && (adjacency.jumps(triangle, k) || m.distance(n) > FLAT)
}
