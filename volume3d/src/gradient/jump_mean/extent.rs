//! How wide faces are as a viewer sees them.
//!
//! A field that follows both borders of a face exactly turns between them: ∇·V ~ Δv/w where they are w apart and move by Δv against one
//! another. Of a rigid face that is no more than its turning over the angle at which it is seen, and as large as one likes where that is
//! almost edge-on. So a softened field does not follow the borders of a face that is seen as less than a part of its softness.

use glam::DVec3;

use crate::scene::{NONE, Scene};

/// A face is narrow if it is seen less wide than this part of the softness.
///
/// Of 20 thin prisms with smooth shading that turn, at 80 samples a pixel, the kurtosis of the errors of pixels was 606, 96, 50, 48 and 48 with
/// 0, 0.003, 0.01, 0.03 and 0.125, and the variance of silhouettes on the film times 1, 1, 1, 1.3 and 4.7: what is followed least has the most left.
const NARROW: f64 = 0.005;

/// The size of a face.
#[derive(Clone, Copy, Debug, Default)]
struct Extent {
    normal: DVec3,
    centre: DVec3,
    /// Its area over its length.
    breadth: f64,
}

/// The sizes of a scene's faces, by their first triangles.
#[derive(Clone, Debug, Default)]
pub(super) struct Extents(Vec<Extent>);

impl Extents {
    /// Of faces that are told by the first triangle of each triangle's face.
    pub(super) fn new(scene: &Scene, first: &[u32]) -> Self {
        let mut low = vec![DVec3::INFINITY; first.len()];
        let mut high = vec![DVec3::NEG_INFINITY; first.len()];
        let mut area = vec![0.0; first.len()];
        for (t, &face) in (0..).zip(first).filter(|(_, face)| **face != NONE) {
            let [a, b, c] = scene.corners(t);
            let face = face as usize;
            area[face] += 0.5 * (b - a).cross(c - a).length();
            low[face] = low[face].min(a.min(b).min(c));
            high[face] = high[face].max(a.max(b).max(c));
        }
        let extent = |face: usize| {
            let (low, high) = (low[face], high[face]);
            Extent {
                normal: scene.face_normal(face as u32),
                centre: low.midpoint(high),
                breadth: area[face] / low.distance(high),
            }
        };
        let is_first = |face: usize| first[face] == face as u32;
        Self(
            (0..first.len())
                .map(|face| if is_first(face) { extent(face) } else { Extent::default() })
                .collect(),
        )
    }

    /// Whether a face is narrow as it is seen from a place, for a softness in radians: w = (A/l) sin α / d for a face of area A and length l,
    /// of which the middle is seen at the angle α and the distance d.
    pub(super) fn is_narrow(&self, face: u32, origin: DVec3, softness: f64) -> bool {
        let Extent { normal, centre, breadth } = self.0[face as usize];
        let way = centre - origin;
        breadth * normal.dot(way).abs() < NARROW * softness * way.length_squared()
    }
}
