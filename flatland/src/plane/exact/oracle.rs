//! Oracle field: exact boundary velocities, interpolated linearly on the arrangement.

use glam::{DMat2, DVec2, DVec3};

use super::arrangement::{Arrangement, Boundary};
use crate::plane::twice_area;
use crate::warp::Field;

/// A field that is linear in each triangle of the arrangement and takes the exact boundary velocity, along
/// its normal, on every visible silhouette.
///
/// Where boundaries of different motions meet in a node, V is the velocity of their crossing, which belongs
/// to both. Where more meet than one vector can satisfy (a moving vertex exactly on another edge), V takes
/// several values around that one node while its normal component stays continuous across every triangle
/// edge, which suffices for the divergence theorem.
#[derive(Clone, Debug)]
pub struct OracleField<'a> {
    pub(super) arrangement: &'a Arrangement<'a>,
    /// V at the corners of every triangle.
    pub(super) corners: Vec<[DVec2; 3]>,
    /// ∇·V in every triangle.
    pub(super) divergence: Vec<f64>,
}

/// Relative error up to which a nodal velocity counts as satisfying a boundary's: rounding in a 2 × 2 solve.
const CONSISTENT: f64 = 1e-12;

/// V·normal = flux at one end of a boundary.
#[derive(Clone, Copy, Debug)]
struct Condition {
    normal: DVec2,
    velocity: DVec2,
    flux: f64,
}

impl<'a> Arrangement<'a> {
    /// The velocity of the material edge `owner` at a point on it.
    pub(super) fn edge_velocity(&self, owner: u32, at: DVec2, velocities: &[DVec2]) -> DVec2 {
        let [a, b] = self.edges[owner as usize].1;
        let (p, q) = (self.scene.vertices()[a], self.scene.vertices()[b]);
        let d = q - p;
        let t = (at - p).dot(d) / d.length_squared();
        velocities[a] + t * (velocities[b] - velocities[a])
    }

    /// The unit normal from minus to plus. It is the normal of the whole edge, as rounding may have rotated a
    /// short piece arbitrarily.
    pub(super) fn boundary_normal(&self, b: &Boundary) -> DVec2 {
        let [p, q] = b.nodes.map(|n| self.nodes[n as usize]);
        let edge = self.edges[b.owners[0] as usize].1.map(|v| self.scene.vertices()[v]);
        let along = (edge[1] - edge[0]).normalize();
        -along.perp() * (q - p).dot(along).signum()
    }

    /// The boundary's velocity at its two nodes, and its unit normal from minus to plus.
    pub(super) fn boundary_velocity(&self, b: &Boundary, velocities: &[DVec2]) -> ([DVec2; 2], DVec2) {
        let ends = b.nodes.map(|n| self.nodes[n as usize]);
        let normal = self.boundary_normal(b);
        (ends.map(|p| self.edge_velocity(b.owners[0], p, velocities)), normal)
    }

    /// The oracle field of a motion.
    ///
    /// # Panics
    /// If there is not one velocity per vertex.
    #[must_use]
    pub fn oracle(&'a self, velocities: &[DVec2]) -> OracleField<'a> {
        let mut at_node: Vec<Vec<Condition>> = vec![vec![]; self.nodes.len()];
        let mut flux_at = std::collections::HashMap::new();
        for b in self.boundaries.iter().filter(|b| b.minus != b.plus) {
            let (ends, normal) = self.boundary_velocity(b, velocities);
            for k in 0..2 {
                let condition = Condition { normal, velocity: ends[k], flux: ends[k].dot(normal) };
                at_node[b.nodes[k] as usize].push(condition);
                flux_at.insert((b.nodes[k], b.nodes[1 - k]), condition);
            }
        }
        let nodal: Vec<_> = at_node.iter().map(|conditions| nodal_velocity(conditions)).collect();
        let mut corners = Vec::with_capacity(self.visible.len());
        let mut divergence = Vec::with_capacity(self.visible.len());
        for (t, nodes) in self.mesh.triangles.iter().enumerate() {
            let [a, b, c] = self.corners(t);
            let values = [0, 1, 2].map(|k| {
                let node = nodes[k] as usize;
                let value = nodal[node];
                if value.consistent {
                    return value.velocity;
                }
                // The two edges that meet in this corner determine V by their fluxes; an edge that is not a
                // boundary has the flux of the nodal value, equal from both sides.
                let rows = [(k + 1) % 3, (k + 2) % 3].map(|j| {
                    flux_at.get(&(nodes[k], nodes[j])).map_or_else(
                        || {
                            let normal =
                                (self.nodes[nodes[j] as usize] - self.nodes[node]).perp().normalize();
                            (normal, value.velocity.dot(normal))
                        },
                        |c| (c.normal, c.flux),
                    )
                });
                // A corner between two pieces of one line has no angle, and no area.
                let velocity = solve(rows);
                if velocity.is_finite() { velocity } else { value.velocity }
            });
            // ∇·V = Σ V_k·∇b_k, with the velocities relative to one of them, as a common one has no
            // divergence.
            let sides = [c - b, a - c, b - a].map(DVec2::perp);
            let sum: f64 = (1..3).map(|k| (values[k] - values[0]).dot(sides[k])).sum();
            corners.push(values);
            divergence.push(sum / twice_area(a, b, c));
        }
        OracleField { arrangement: self, corners, divergence }
    }
}

impl OracleField<'_> {
    /// (V, ∇·V) at u; zero outside the arrangement's frame.
    #[must_use]
    pub fn at(&self, u: DVec2) -> Field<DVec2> {
        self.arrangement.locate(u).map_or(Field::ZERO, |(t, barycentric)| Field {
            value: self.in_triangle(t, DVec3::from(barycentric)),
            divergence: self.divergence[t],
        })
    }

    /// V at a point of a triangle.
    pub(super) fn in_triangle(&self, triangle: usize, barycentric: DVec3) -> DVec2 {
        let [a, b, c] = self.corners[triangle];
        a + barycentric.y * (b - a) + barycentric.z * (c - a)
    }
}

#[derive(Clone, Copy, Debug)]
struct Nodal {
    velocity: DVec2,
    consistent: bool,
}

/// One V for a node: the velocity of a boundary there if it satisfies all conditions, else the velocity of
/// the crossing of two, else the least-squares solution, marked as inconsistent.
fn nodal_velocity(conditions: &[Condition]) -> Nodal {
    if conditions.is_empty() {
        return Nodal { velocity: DVec2::ZERO, consistent: true };
    }
    let size = conditions.iter().map(|c| c.velocity.length()).fold(0.0, f64::max);
    let satisfies =
        |v: DVec2| conditions.iter().all(|c| (v.dot(c.normal) - c.flux).abs() <= CONSISTENT * size);
    let own = conditions.iter().map(|c| c.velocity);
    let crossings = conditions
        .iter()
        .enumerate()
        .flat_map(|(i, c)| conditions[..i].iter().map(|d| solve([(c.normal, c.flux), (d.normal, d.flux)])));
    if let Some(velocity) = own.chain(crossings).find(|&v| v.is_finite() && satisfies(v)) {
        return Nodal { velocity, consistent: true };
    }
    let (mut matrix, mut right) = (DMat2::ZERO, DVec2::ZERO);
    for c in conditions {
        matrix += DMat2::from_cols(c.normal.x * c.normal, c.normal.y * c.normal);
        right += c.flux * c.normal;
    }
    // All normals parallel: any of the velocities is equivalent.
    let least = matrix.inverse() * right;
    Nodal { velocity: if least.is_finite() { least } else { conditions[0].velocity }, consistent: false }
}

/// V with V·normal = flux for both rows.
fn solve([(n0, q0), (n1, q1)]: [(DVec2, f64); 2]) -> DVec2 {
    // Cramer's rule on the rows n₀, n₁.
    let determinant = n0.perp_dot(n1);
    DVec2::new(q0 * n1.y - q1 * n0.y, n0.x * q1 - n1.x * q0) / determinant
}
