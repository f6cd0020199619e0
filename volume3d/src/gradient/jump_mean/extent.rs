//! How wide faces are as a viewer sees them.
//!
//! A field that follows both borders of a face exactly turns between them: ∇·V ~ Δv/w where they are w apart and move by Δv against one
//! another. Of a rigid face that is no more than its turning over the angle at which it is seen, and as large as one likes where that is
//! almost edge-on. So a softened field follows the borders of a narrow face softened as well, though less than others.

use glam::DVec3;

use crate::scene::{NONE, Scene};

/// A face is narrow if it is seen less wide than this part of the softness.
const NARROW: f64 = 0.01;

/// The softness of its border, as a part of that of others: V misses so little of what it follows that little is left to curves.
const BORDER: f64 = 0.025;

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

    /// The softness with which the border of a face is followed as it is seen from a place, for that of other jumps, in radians: 0 unless it is narrow.
    /// Of a face of area A and length l, of which the middle is seen at the angle α and the distance d, the width is w = (A/l) sin α / d.
    pub(super) fn border_softness(&self, face: u32, origin: DVec3, softness: f64) -> f64 {
        let Extent { normal, centre, breadth } = self.0[face as usize];
        let way = centre - origin;
        let narrow = breadth * normal.dot(way).abs() < NARROW * softness * way.length_squared();
        if narrow { BORDER * softness } else { 0.0 }
    }
}
