//! What lies beyond the edges of triangles, and whether what is seen jumps there.

use glam::{DVec2, DVec3};

use super::triangle::{NONE, Tables, Triangle};
use crate::geometry::{Edges, HalfEdge};

/// What lies beyond an edge of a triangle.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) enum Beyond {
    /// Nothing that continues the surface: from wherever the edge is seen, what is seen jumps there. A border, or an
    /// edge of three triangles or more.
    Border,
    /// Another triangle that continues the surface, but not its shading: a crease of flat shading, a seam of
    /// normals or of a texture. The radiance jumps there; what the surface covers does not.
    Crease(u32),
    /// Another triangle that continues surface and shading.
    Smooth(u32),
}

/// What triangles are shaded by.
#[derive(Clone, Copy, Debug)]
pub(super) struct Shading<'s> {
    pub(super) normals: &'s [DVec3],
    pub(super) uvs: &'s [DVec2],
    /// Whether each shape has a texture.
    pub(super) textured: &'s [bool],
}

/// What lies beyond every edge of all triangles of a tables.
#[derive(Clone, Debug, Default)]
pub(crate) struct Adjacency {
    /// For edge k of a triangle, from corner k to corner k + 1.
    beyond: Vec<[Beyond; 3]>,
    /// The smallest radius of curvature around each triangle, from the angles to the faces that continue its
    /// surface; infinite where it is flat or alone.
    radius: Vec<f64>,
}

impl Adjacency {
    pub(super) fn build(tables: Tables<'_>, shading: Shading<'_>) -> Self {
        let mut beyond = vec![[Beyond::Border; 3]; tables.triangles.len()];
        let mut radius = vec![f64::INFINITY; tables.triangles.len()];
        for sides in Edges::of(tables.triangles.iter().map(|t| t.positions)).iter() {
            let [first, second] = sides else { continue };
            let [s, t] = [first.triangle, second.triangle];
            if !surface_continues(tables, first, second) {
                continue;
            }
            let kind = if shading_continues(tables, shading, first, second) {
                Beyond::Smooth
            } else {
                Beyond::Crease
            };
            beyond[s as usize][first.corner as usize] = kind(t);
            beyond[t as usize][second.corner as usize] = kind(s);
            let r = radius_across(tables, s, t);
            for face in [s, t] {
                radius[face as usize] = radius[face as usize].min(r);
            }
        }
        Self { beyond, radius }
    }

    /// What lies beyond the edges of a triangle.
    pub(crate) fn beyond(&self, triangle: u32) -> [Beyond; 3] {
        self.beyond[triangle as usize]
    }

    /// The smallest radius of curvature around a triangle.
    pub(crate) fn radius(&self, triangle: u32) -> f64 {
        self.radius[triangle as usize]
    }

    /// The triangle that continues the surface beyond edge k.
    pub(crate) fn continued(&self, triangle: u32, k: usize) -> Option<u32> {
        match self.beyond[triangle as usize][k] {
            Beyond::Border => None,
            Beyond::Crease(other) | Beyond::Smooth(other) => Some(other),
        }
    }

    /// The triangle that continues surface and shading beyond edge k.
    pub(crate) fn smooth(&self, triangle: u32, k: usize) -> Option<u32> {
        match self.beyond[triangle as usize][k] {
            Beyond::Smooth(other) => Some(other),
            Beyond::Border | Beyond::Crease(_) => None,
        }
    }

    /// Whether what is seen jumps at edge k of a triangle from wherever it is seen, and not at silhouettes only.
    pub(crate) fn jumps(&self, triangle: u32, k: usize) -> bool {
        !matches!(self.beyond[triangle as usize][k], Beyond::Smooth(_))
    }
}

/// Whether the surface goes on across an edge: the two must run along it in opposite senses, or front and back
/// meet in it.
fn surface_continues(tables: Tables<'_>, first: &HalfEdge, second: &HalfEdge) -> bool {
    let [s, t] = [first, second].map(|side| tables.triangles[side.triangle as usize].shape);
    first.ascending != second.ascending && s == t
}

/// Whether normals and texture go on across an edge.
fn shading_continues(tables: Tables<'_>, shading: Shading<'_>, first: &HalfEdge, second: &HalfEdge) -> bool {
    let triangle = |side: &HalfEdge| &tables.triangles[side.triangle as usize];
    // Of a table of the triangle's corners, what is at the ends of the edge, in the edge's order.
    let ends = |side: &HalfEdge, table: fn(&Triangle) -> [u32; 3]| {
        let (table, k) = (table(triangle(side)), side.corner as usize);
        let [a, b] = [table[k], table[(k + 1) % 3]];
        if side.ascending { [a, b] } else { [b, a] }
    };
    let same_uv = !shading.textured[triangle(first).shape as usize] || {
        let at = |side| ends(side, |t| t.uvs).map(|n| shading.uvs[n as usize]);
        at(first) == at(second)
    };
    let same_normals = if triangle(first).normals[0] == NONE {
        coplanar(tables.corners(first.triangle), tables.corners(second.triangle))
    } else {
        let at = |side| ends(side, |t| t.normals);
        let value = |n: [u32; 2]| n.map(|n| shading.normals[n as usize]);
        at(first) == at(second) || value(at(first)) == value(at(second))
    };
    same_uv && same_normals
}

/// Unit normals that differ by no more than this are those of one plane. It is what rounding to single precision, in
/// which most meshes are stored, does to triangles a hundredth as large as their coordinates. A jump of the radiance that
/// is left out where flat-shaded triangles meet is as small, relatively.
pub(crate) const FLAT: f64 = 1e-5;

/// Whether two flat-shaded triangles shade alike, to rounding. Vertices that move may bend the edge between
/// them; but as long as nothing jumps there, nothing that moves there counts.
fn coplanar(s: [DVec3; 3], t: [DVec3; 3]) -> bool {
    (normal(s) - normal(t)).length() <= FLAT
}

fn normal([a, b, c]: [DVec3; 3]) -> DVec3 {
    (b - a).cross(c - a).normalize_or_zero()
}

/// The distance of the centroids of two triangles over the angle between their normals.
fn radius_across(tables: Tables<'_>, s: u32, t: u32) -> f64 {
    let centre = |p: [DVec3; 3]| (p[0] + p[1] + p[2]) / 3.0;
    let (s, t) = (tables.corners(s), tables.corners(t));
    let (m, n) = (normal(s), normal(t));
    let angle = m.cross(n).length().atan2(m.dot(n));
    (centre(s) - centre(t)).length() / angle
}
