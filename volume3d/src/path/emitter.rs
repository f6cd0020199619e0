//! Area lights: sampling of their surface and border.

use glam::DVec3;

use crate::geometry::{Edges, HalfEdge};
use crate::scene::{Scene, Surface};

/// The triangles of an emitting shape, and a bounding sphere.
#[derive(Clone, Debug)]
pub(super) struct Area {
    pub(super) shape: u32,
    first_triangle: u32,
    /// Cumulative areas.
    cumulative: Vec<f64>,
    faces: Vec<Face>,
    pub(super) centre: DVec3,
    pub(super) radius: f64,
    /// The border, if the shape is flat.
    pub(super) border: Option<Border>,
}

/// A triangle of an emitting shape: a corner, the two sides from there, and the unit normal of its front.
#[derive(Clone, Copy, Debug)]
struct Face {
    corner: DVec3,
    sides: [DVec3; 2],
    normal: DVec3,
}

/// The border of a flat emitter.
#[derive(Clone, Debug)]
pub(super) struct Border {
    /// The emitter's plane {y: normal·y = offset}.
    pub(super) normal: DVec3,
    pub(super) offset: f64,
    /// Triangle sides that form the border.
    edges: Vec<HalfEdge>,
    /// Cumulative lengths.
    cumulative: Vec<f64>,
}

/// A point on the border of a flat emitter.
#[derive(Clone, Copy, Debug)]
pub(crate) struct BorderPoint {
    /// Position along the edge, from 0 to 1.
    pub(crate) along: f64,
    /// Position of the point, and vector along the edge.
    pub(crate) place: DVec3,
    pub(crate) edge: DVec3,
    pub(crate) inside: DVec3,
    /// The triangle whose side it is on, and its barycentric coordinates.
    pub(crate) triangle: u32,
    pub(crate) weights: [f64; 3],
    /// Length of the whole border: 1/density.
    pub(crate) whole: f64,
}

/// A point on the front of a surface.
pub(super) struct Spot {
    pub(super) surface: Surface,
    pub(super) point: DVec3,
    pub(super) normal: DVec3,
}

impl Area {
    pub(super) fn new(scene: &Scene, shape: usize) -> Self {
        let [first, end] = [scene.first_triangle[shape], scene.first_triangle[shape + 1]];
        let mut sum = 0.0;
        let (mut cumulative, mut faces) = (vec![], vec![]);
        let (mut low, mut high) = (DVec3::INFINITY, DVec3::NEG_INFINITY);
        for triangle in first..end {
            let [a, b, c] = scene.corners(triangle);
            sum += 0.5 * (b - a).cross(c - a).length();
            cumulative.push(sum);
            faces.push(Face { corner: a, sides: [b - a, c - a], normal: scene.face_normal(triangle) });
            for p in [a, b, c] {
                (low, high) = (low.min(p), high.max(p));
            }
        }
        Self {
            shape: shape as u32,
            first_triangle: first,
            cumulative,
            faces,
            centre: 0.5 * (low + high),
            radius: 0.5 * (high - low).length(),
            border: Border::new(scene, first as usize..end as usize),
        }
    }

    /// Total area of the triangles.
    #[inline]
    pub(super) fn whole(&self) -> f64 {
        self.cumulative.last().copied().unwrap_or(0.0)
    }

    /// Samples a point uniformly by area.
    #[inline]
    pub(super) fn sample(&self, [choice, a, b]: [f64; 3]) -> Spot {
        let target = choice * self.whole();
        let i = self.cumulative.partition_point(|&c| c <= target).min(self.cumulative.len() - 1);
        let Face { corner, sides: [first, second], normal } = self.faces[i];
        let root = a.sqrt();
        Spot {
            surface: Surface::Triangle(self.first_triangle + i as u32),
            point: corner + first * (root * (1.0 - b)) + second * (root * b),
            normal,
        }
    }
}

impl Border {
    /// The border of triangles that are coplanar, face the same way, and overlap only in edges; `None`
    /// otherwise. Their emission must be continuous between them, unlike a texture at a seam of texture
    /// coordinates, for the border to contain all its discontinuities.
    fn new(scene: &Scene, triangles: std::ops::Range<usize>) -> Option<Self> {
        if triangles.is_empty() {
            return None;
        }
        let shape = scene.triangles[triangles.start].shape as usize;
        let is_textured = scene.description.shapes[shape].radiance_texture.is_some();
        let first = triangles.start as u32;
        let face_normal = |t: u32| scene.face_normal(t);
        let normal = face_normal(first);
        let [corner, ..] = scene.corners(first);
        let (mut offset, own) = (normal.dot(corner), scene.tilt(first));
        let plane = offset;
        for t in triangles.clone() {
            let corners = scene.triangles[t].positions.map(|i| scene.positions[i as usize]);
            let is_off = |p: &DVec3| {
                let (height, way) = (normal.dot(*p) - plane, (p - corner).length());
                height.abs() > FLAT * way.max(corner.length()) + scene.grain(*p) + own * way
            };
            let tilt = FLAT + own + scene.tilt(t as u32);
            if corners.iter().any(is_off) || (face_normal(t as u32) - normal).length() > tilt {
                return None;
            }
            // The plane is moved so that no part is in front of it.
            offset = corners.iter().map(|p| normal.dot(*p)).fold(offset, f64::max);
        }
        let (mut edges, mut cumulative, mut sum) = (vec![], vec![], 0.0);
        let corners = scene.triangles[triangles].iter().map(|t| t.positions);
        for sides in Edges::of(corners).iter() {
            match sides {
                [side] => {
                    let side = HalfEdge { triangle: side.triangle + first, ..*side };
                    let [a, b, _] = corners_from(scene, side);
                    sum += scene.positions[a as usize].distance(scene.positions[b as usize]);
                    edges.push(side);
                    cumulative.push(sum);
                }
                [side, _] => {
                    if is_textured && scene.adjacency.jumps(side.triangle + first, side.corner as usize) {
                        return None;
                    }
                }
                _ => return None,
            }
        }
        Some(Self { normal, offset, edges, cumulative })
    }

    /// Total length, position of a point along it, and index of its edge.
    fn place(&self, xi: f64) -> Option<(f64, f64, usize)> {
        let whole = *self.cumulative.last()?;
        let target = xi * whole;
        let i = self.cumulative.partition_point(|&c| c <= target).min(self.edges.len() - 1);
        Some((whole, target, i))
    }

    /// Ends of the edge that contains a point.
    pub(super) fn ends(&self, scene: &Scene, xi: f64) -> Option<[u32; 2]> {
        let (.., i) = self.place(xi)?;
        let [a, b, _] = corners_from(scene, self.edges[i]);
        Some([a, b])
    }

    /// A point, uniform by length.
    pub(super) fn point(&self, scene: &Scene, xi: f64) -> Option<BorderPoint> {
        let (whole, target, i) = self.place(xi)?;
        let side = self.edges[i];
        let [a, b, c] = corners_from(scene, side);
        let [p, q, inside] = [a, b, c].map(|k| scene.positions[k as usize]);
        let along = 1.0 - (self.cumulative[i] - target) / p.distance(q);
        let edge = (q - p).try_normalize()?;
        let mut weights = [1.0 - along, along, 0.0];
        weights.rotate_right(side.corner as usize);
        let (place, triangle) = (p + along * (q - p), side.triangle);
        Some(BorderPoint { along, place, edge, inside, triangle, weights, whole })
    }
}

/// Ends of a triangle's side, counter-clockwise, and the opposite corner.
fn corners_from(scene: &Scene, side: HalfEdge) -> [u32; 3] {
    let mut corners = scene.triangles[side.triangle as usize].positions;
    corners.rotate_left(side.corner as usize);
    corners
}

/// Relative distance of a flat emitter's corners from its plane, beyond the rounding of the input positions.
const FLAT: f64 = 1e-12;
