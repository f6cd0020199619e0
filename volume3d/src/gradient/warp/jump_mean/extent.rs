//! Apparent width of faces.
//!
//! A field that follows both borders of a face exactly varies between them: ∇·V ~ Δv/w if they are w apart
//! and move by Δv relative to one another. For a rigid face that is at most its angular velocity divided by
//! the angle at which it is seen, which is unbounded for a face seen edge-on. A softened field therefore
//! softens the borders of narrow faces as well, though less than other discontinuities.

use glam::DVec3;

use crate::scene::{NONE, Scene};

/// Apparent width, relative to the softness, below which a face is narrow.
const NARROW: f64 = 0.01;

/// Softness of a narrow face's border relative to the general softness: so small that the residual left to
/// boundary samples is small.
const BORDER: f64 = 0.025;

/// The size of a face.
#[derive(Clone, Copy, Debug, Default)]
struct Extent {
    normal: DVec3,
    centre: DVec3,
    /// Area divided by length.
    breadth: f64,
}

/// Sizes of a scene's faces, indexed by their first triangles.
#[derive(Clone, Debug, Default)]
pub(super) struct Extents(Vec<Extent>);

impl Extents {
    /// Sizes of faces, given the first triangle of each triangle's face.
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

    /// Softness, in radians, with which the border of a face is followed when seen from `origin`, given that
    /// of other discontinuities: 0 unless it is narrow. A face of area A and length l, whose centre is seen
    /// at the angle α and the distance d, has the apparent width w = (A/l) sin α / d.
    pub(super) fn border_softness(&self, face: u32, origin: DVec3, softness: f64) -> f64 {
        let Extent { normal, centre, breadth } = self.0[face as usize];
        let way = centre - origin;
        let narrow = breadth * normal.dot(way).abs() < NARROW * softness * way.length_squared();
        if narrow { BORDER * softness } else { 0.0 }
    }
}
