//! Edges that lie on faces, as of an object that stands on a floor on one edge. While they slide over the
//! face no gap opens; as they leave it, a gap opens for one sign of the motion, and for the other the
//! surfaces cross: the one-sided derivatives differ.

use glam::DVec3;

use super::adjacency::Adjacency;
use super::edge_contact::is_edge;
use super::triangle::{Tables, barycentric};
use crate::geometry::{in_contact, upon_face};

/// An edge of a triangle that lies in the interior of another.
#[derive(Clone, Copy, Debug)]
pub(super) struct FaceContact {
    /// The triangle with the edge, and the other one.
    pub(super) triangles: [u32; 2],
    /// From corner k to corner k + 1.
    edge: usize,
    /// Ends of the stretch that lies on the other triangle.
    along: [f64; 2],
}

impl FaceContact {
    /// All contacts of a pair of triangles that have no common vertex and are not coplanar, each edge once.
    pub(super) fn of(tables: Tables<'_>, adjacency: &Adjacency, [s, t]: [u32; 2]) -> Vec<Self> {
        let [first, second] = [s, t].map(|t| tables.triangles[t as usize].positions);
        let corners = [s, t].map(|t| tables.corners(t));
        if first.iter().any(|i| second.contains(i)) || in_contact(&corners, tables.origin) {
            return vec![];
        }
        let mut found = vec![];
        for (triangles, [own, other]) in [([s, t], corners), ([t, s], [corners[1], corners[0]])] {
            for edge in 0..3 {
                if let Some(along) = upon_face([own[edge], own[(edge + 1) % 3]], &other, tables.origin)
                    && is_edge(tables, adjacency, triangles[0], edge)
                {
                    found.push(Self { triangles, edge, along });
                }
            }
        }
        found
    }

    /// Whether the edge leaves the face at given velocities of all positions.
    pub(super) fn is_parted(&self, tables: Tables<'_>, velocities: &[DVec3]) -> bool {
        let [own, other] = self.triangles.map(|t| tables.triangles[t as usize].positions);
        let face = other.map(|i| tables.positions[i as usize]);
        let normal = (face[1] - face[0]).cross(face[2] - face[0]).normalize_or_zero();
        let ends = [own[self.edge], own[(self.edge + 1) % 3]];
        self.along.iter().any(|&along| {
            let at = |table: &[DVec3]| table[ends[0] as usize].lerp(table[ends[1] as usize], along);
            let weights = barycentric(&face, at(tables.positions));
            let (over, rates) = (at(velocities), other.map(|i| velocities[i as usize]));
            let under: DVec3 = (0..3).map(|k| weights[k] * rates[k]).sum();
            let size = over.length() + (0..3).map(|k| weights[k].abs() * rates[k].length()).sum::<f64>();
            normal.dot(over - under).abs() > 1e-9 * size
        })
    }
}
