//! Adjacency of triangles: the neighbour beyond each edge, and whether radiance is discontinuous there.

use std::sync::OnceLock;

use glam::{DVec2, DVec3};
use rayon::prelude::*;

use super::material::Material;
use super::triangle::{Tables, Triangle};
use crate::geometry::{Edges, HalfEdge};

/// Neighbour beyond an edge of a triangle.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) enum Beyond {
    /// Nothing that continues the surface: a border, or an edge of three or more triangles. Radiance is
    /// discontinuous from every viewpoint.
    Border,
    /// A triangle that continues the surface, but not its shading: a crease of flat shading, or a seam of
    /// normals or texture. Radiance is discontinuous there; visibility is not.
    Crease(u32),
    /// A triangle that continues surface and shading.
    Smooth(u32),
}

impl Beyond {
    /// The triangle that continues the surface.
    fn continued(self) -> Option<u32> {
        match self {
            Self::Border => None,
            Self::Crease(other) | Self::Smooth(other) => Some(other),
        }
    }
}

/// Shading data of triangles.
#[derive(Clone, Copy, Debug)]
pub(super) struct Shading<'s> {
    pub(super) normals: &'s [DVec3],
    pub(super) uvs: &'s [DVec2],
    /// Use of texture coordinates by each shape.
    pub(super) coordinates: &'s [Coordinates],
}

/// Use of texture coordinates by a shape; each variant includes those before it.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub(super) enum Coordinates {
    Nothing,
    /// Texture lookups.
    Places,
    /// Texture lookups and the axes of anisotropic facets. Each triangle has its own axes, so that radiance
    /// is discontinuous where they differ.
    Axes,
}

impl Coordinates {
    /// Use of texture coordinates by a material.
    pub(super) fn of(material: &Material) -> Self {
        if material.is_anisotropic() {
            Self::Axes
        } else if material.textures().next().is_some() {
            Self::Places
        } else {
            Self::Nothing
        }
    }
}

/// Neighbours beyond every edge of all triangles.
#[derive(Clone, Debug, Default)]
pub(crate) struct Adjacency {
    /// For edge k of a triangle, from corner k to corner k + 1.
    beyond: Vec<[Beyond; 3]>,
    /// Whether edges of a triangle may become or cease to be creases as positions, normals or textures
    /// change.
    may_change: Vec<bool>,
    /// Whether any shape has anisotropic facets, in which case all edges may change.
    has_axes: bool,
    /// Smallest radius of curvature around each triangle, computed on demand: only auxiliary rays need it,
    /// and it costs as much as all other updates when vertices move.
    radii: OnceLock<Vec<f64>>,
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
        let change = |(s, beyond): (usize, &[Beyond; 3])| {
            let others = beyond.iter().map(|beyond| beyond.continued());
            others.enumerate().any(|(k, t)| t.is_some_and(|t| !indices_continue(tables, [s, t as usize], k)))
        };
        let may_change = beyond.par_iter().enumerate().map(change).collect();
        let mut adjacency = Self { beyond, may_change, has_axes: false, radii: OnceLock::new() };
        adjacency.fit(tables, shading);
        adjacency
    }

    /// Reclassifies creases after a change of positions, normals or textures of the same triangles.
    pub(super) fn fit(&mut self, tables: Tables<'_>, shading: Shading<'_>) {
        self.radii = OnceLock::new();
        // Face normals matter to flat shading only.
        let flat = tables.triangles.par_iter().any(Triangle::is_flat);
        let had_axes = self.has_axes;
        self.has_axes = shading.coordinates.contains(&Coordinates::Axes);
        let all = had_axes || self.has_axes;
        let normals = if flat || self.has_axes { normals(tables) } else { vec![] };
        let planes = Planes { tables, normals: &normals };
        let changing = self.beyond.par_iter_mut().zip(&self.may_change).enumerate();
        changing.filter(|(_, (_, may_change))| all || **may_change).for_each(|(s, (beyond, _))| {
            for (k, beyond) in beyond.iter_mut().enumerate() {
                if let Beyond::Crease(t) | Beyond::Smooth(t) = *beyond {
                    let smooth = planes.shading_continues(shading, [s, t as usize], k);
                    *beyond = if smooth { Beyond::Smooth(t) } else { Beyond::Crease(t) };
                }
            }
        });
    }

    /// Neighbours beyond the edges of a triangle.
    pub(crate) fn beyond(&self, triangle: u32) -> [Beyond; 3] {
        self.beyond[triangle as usize]
    }

    /// Smallest radius of curvature around a triangle, from the angles to the faces that continue its
    /// surface; infinite if it is flat or isolated.
    pub(super) fn radius(&self, tables: Tables<'_>, triangle: u32) -> f64 {
        self.radii.get_or_init(|| self.find_radii(tables))[triangle as usize]
    }

    /// Computed on one thread, as others may be waiting for it.
    fn find_radii(&self, tables: Tables<'_>) -> Vec<f64> {
        let normals: Vec<DVec3> =
            (0..tables.triangles.len()).map(|t| normal(tables.corners(t as u32))).collect();
        let planes = Planes { tables, normals: &normals };
        let radius = |(s, beyond): (usize, &[Beyond; 3])| {
            let others = beyond.iter().filter_map(|beyond| beyond.continued());
            others.fold(f64::INFINITY, |radius, t| radius.min(planes.radius_across([s, t as usize])))
        };
        self.beyond.iter().enumerate().map(radius).collect()
    }

    /// The triangle that continues the surface beyond edge k.
    pub(crate) fn continued(&self, triangle: u32, k: usize) -> Option<u32> {
        self.beyond[triangle as usize][k].continued()
    }

    /// The triangle that continues surface and shading beyond edge k.
    pub(crate) fn smooth(&self, triangle: u32, k: usize) -> Option<u32> {
        match self.beyond[triangle as usize][k] {
            Beyond::Smooth(other) => Some(other),
            Beyond::Border | Beyond::Crease(_) => None,
        }
    }

    /// Whether radiance is discontinuous at edge k of a triangle from every viewpoint, and not only at
    /// silhouettes.
    pub(crate) fn jumps(&self, triangle: u32, k: usize) -> bool {
        !matches!(self.beyond[triangle as usize][k], Beyond::Smooth(_))
    }
}

/// Whether the surface continues across an edge: the two triangles must traverse it in opposite directions;
/// otherwise front and back meet there.
fn surface_continues(tables: Tables<'_>, first: &HalfEdge, second: &HalfEdge) -> bool {
    let [s, t] = [first, second].map(|side| tables.triangles[side.triangle as usize].shape);
    first.ascending != second.ascending && s == t
}

/// The edge of a second triangle that traverses edge k of a first in the opposite direction.
fn facing(s: &Triangle, t: &Triangle, k: usize) -> Option<usize> {
    let [a, b] = [s.positions[k], s.positions[(k + 1) % 3]];
    (0..3).find(|&l| t.positions[l] == b && t.positions[(l + 1) % 3] == a)
}

/// Entries of a corner table at both ends of the shared edge of two triangles, in a common order.
fn ends([s, t]: [&Triangle; 2], [k, l]: [usize; 2], table: fn(&Triangle) -> [u32; 3]) -> [[u32; 2]; 2] {
    let (s, t) = (table(s), table(t));
    [[s[k], s[(k + 1) % 3]], [t[(l + 1) % 3], t[l]]]
}

/// Whether normals and texture coordinates continue across edge k of the first triangle for any values.
fn indices_continue(tables: Tables<'_>, pair: [usize; 2], k: usize) -> bool {
    let [s, t] = pair.map(|i| &tables.triangles[i]);
    let Some(l) = facing(s, t, k) else { return false };
    let same = |table| {
        let [a, b] = ends([s, t], [k, l], table);
        a == b
    };
    !s.is_flat() && same(|t| t.normals) && same(|t| t.uvs)
}

/// Distance between unit normals up to which faces count as coplanar. It is the rounding of single precision,
/// in which most meshes are stored, for triangles of 1/100 the size of their coordinates. The neglected
/// discontinuity of radiance between flat-shaded triangles is of the same relative size. Meshes that rounding
/// in double precision rotates by more are reported by [`Scene::coarse_meshes`](super::Scene::coarse_meshes).
pub(crate) const FLAT: f64 = 1e-5;

/// Triangles with their unit normals.
#[derive(Clone, Copy)]
struct Planes<'s> {
    tables: Tables<'s>,
    normals: &'s [DVec3],
}

impl Planes<'_> {
    /// Whether normals and texture coordinates continue from one triangle to another across edge k of the
    /// first, which the other traverses in the opposite direction.
    fn shading_continues(self, shading: Shading<'_>, pair: [usize; 2], k: usize) -> bool {
        let [s, t] = pair.map(|i| &self.tables.triangles[i]);
        let Some(l) = facing(s, t, k) else { return false };
        let ends = |table| ends([s, t], [k, l], table);
        let coordinates = shading.coordinates[s.shape as usize];
        let same_places = coordinates == Coordinates::Nothing || {
            let [a, b] = ends(|t| t.uvs).map(|ends| ends.map(|n| shading.uvs.get(n as usize)));
            a == b
        };
        let same_axes = coordinates != Coordinates::Axes || {
            let [a, b] = pair.map(|i| self.axis(shading.uvs, i));
            match (a, b) {
                (None, None) => true,
                (Some(a), Some(b)) => self.coplanar(pair) && (a - b).length() <= FLAT,
                _ => false,
            }
        };
        let same_normals = if s.is_flat() {
            self.coplanar(pair)
        } else {
            let [a, b] = ends(|t| t.normals);
            let value = |ends: [u32; 2]| ends.map(|n| shading.normals[n as usize]);
            a == b || value(a) == value(b)
        };
        same_places && same_axes && same_normals
    }

    /// Direction of increasing first texture coordinate along a triangle, if there is one.
    fn axis(self, uvs: &[DVec2], triangle: usize) -> Option<DVec3> {
        let of = |i: u32| uvs.get(i as usize).copied();
        let [a, b, c] = self.tables.triangles[triangle].uvs.map(of);
        let (first, second) = (b? - a?, c? - a?);
        let [p, q, r] = self.tables.corners(triangle as u32);
        let span = first.perp_dot(second);
        let side = (q - p) * (second.y / span) - (r - p) * (first.y / span);
        side.try_normalize()
    }

    /// Whether two flat-shaded triangles shade alike, up to rounding. Moving vertices may bend the edge
    /// between them; but as long as radiance is continuous there, that motion does not matter.
    fn coplanar(self, pair: [usize; 2]) -> bool {
        let [m, n] = pair.map(|i| self.normals[i]);
        (m - n).length() <= FLAT
    }

    /// Distance between the centroids of two triangles divided by the angle between their normals.
    fn radius_across(self, pair: [usize; 2]) -> f64 {
        let [a, b] = pair.map(|i| self.tables.corners(i as u32).into_iter().sum::<DVec3>() / 3.0);
        let [m, n] = pair.map(|i| self.normals[i]);
        (a - b).length() / m.cross(n).length().atan2(m.dot(n))
    }
}

fn normals(tables: Tables<'_>) -> Vec<DVec3> {
    (0..tables.triangles.len()).into_par_iter().map(|t| normal(tables.corners(t as u32))).collect()
}

fn normal([a, b, c]: [DVec3; 3]) -> DVec3 {
    (b - a).cross(c - a).normalize_or_zero()
}
