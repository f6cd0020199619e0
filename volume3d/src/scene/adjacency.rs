//! What lies beyond the edges of triangles, and whether what is seen jumps there.

use glam::{DVec2, DVec3};
use rayon::prelude::*;

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

/// What lies beyond every edge of all triangles.
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
        for sides in Edges::of(tables.triangles.iter().map(|t| t.positions)).iter() {
            let [first, second] = sides else { continue };
            if surface_continues(tables, first, second) {
                for (side, other) in [(first, second), (second, first)] {
                    beyond[side.triangle as usize][side.corner as usize] = Beyond::Smooth(other.triangle);
                }
            }
        }
        let mut adjacency = Self { radius: vec![f64::INFINITY; beyond.len()], beyond };
        adjacency.fit(tables, shading);
        adjacency
    }

    /// Finds again which edges are creases and how the surface is curved, for other positions, normals or textures of the
    /// same triangles.
    pub(super) fn fit(&mut self, tables: Tables<'_>, shading: Shading<'_>) {
        let normals: Vec<DVec3> =
            (0..tables.triangles.len()).into_par_iter().map(|t| normal(tables.corners(t as u32))).collect();
        let planes = Planes { tables, normals: &normals };
        self.beyond.par_iter_mut().zip(&mut self.radius).enumerate().for_each(|(s, (beyond, radius))| {
            *radius = f64::INFINITY;
            for (k, beyond) in beyond.iter_mut().enumerate() {
                if let Beyond::Crease(t) | Beyond::Smooth(t) = *beyond {
                    let smooth = planes.shading_continues(shading, [s, t as usize], k);
                    *beyond = if smooth { Beyond::Smooth(t) } else { Beyond::Crease(t) };
                    *radius = radius.min(planes.radius_across([s, t as usize]));
                }
            }
        });
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

/// Unit normals that differ by no more than this are those of one plane. It is what rounding to single precision, in
/// which most meshes are stored, does to triangles a hundredth as large as their coordinates. A jump of the radiance that
/// is left out where flat-shaded triangles meet is as small, relatively.
pub(crate) const FLAT: f64 = 1e-5;

/// Triangles with their unit normals.
#[derive(Clone, Copy)]
struct Planes<'s> {
    tables: Tables<'s>,
    normals: &'s [DVec3],
}

impl Planes<'_> {
    /// Whether normals and texture go on from a triangle to another across edge k of the first, along which the other runs
    /// in the opposite sense.
    fn shading_continues(self, shading: Shading<'_>, pair: [usize; 2], k: usize) -> bool {
        let [s, t] = pair.map(|i| &self.tables.triangles[i]);
        let l = (0..3).find(|&l| {
            t.positions[l] == s.positions[(k + 1) % 3] && t.positions[(l + 1) % 3] == s.positions[k]
        });
        let Some(l) = l else { return false };
        // Of a table of the triangles' corners, what is at the ends of the edge, in one order.
        let ends = |table: fn(&Triangle) -> [u32; 3]| {
            let (s, t) = (table(s), table(t));
            [[s[k], s[(k + 1) % 3]], [t[(l + 1) % 3], t[l]]]
        };
        let same_uv = !shading.textured[s.shape as usize] || {
            let [a, b] = ends(|t| t.uvs).map(|ends| ends.map(|n| shading.uvs[n as usize]));
            a == b
        };
        let same_normals = if s.normals[0] == NONE {
            self.coplanar(pair)
        } else {
            let [a, b] = ends(|t| t.normals);
            let value = |ends: [u32; 2]| ends.map(|n| shading.normals[n as usize]);
            a == b || value(a) == value(b)
        };
        same_uv && same_normals
    }

    /// Whether two flat-shaded triangles shade alike, to rounding. Vertices that move may bend the edge between them; but
    /// as long as nothing jumps there, nothing that moves there counts.
    fn coplanar(self, pair: [usize; 2]) -> bool {
        let [m, n] = pair.map(|i| self.normals[i]);
        (m - n).length() <= FLAT
    }

    /// The distance of the centroids of two triangles over the angle between their normals.
    fn radius_across(self, pair: [usize; 2]) -> f64 {
        let [a, b] = pair.map(|i| self.tables.corners(i as u32).into_iter().sum::<DVec3>() / 3.0);
        let [m, n] = pair.map(|i| self.normals[i]);
        (a - b).length() / m.cross(n).length().atan2(m.dot(n))
    }
}

fn normal([a, b, c]: [DVec3; 3]) -> DVec3 {
    (b - a).cross(c - a).normalize_or_zero()
}
