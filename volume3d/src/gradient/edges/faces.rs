//! Faces: sets of coplanar triangles that continue one another without a discontinuity.
//!
//! Edges between the triangles of a face are not discontinuities, and a warp field must ignore them:
//! otherwise it would change where a silhouette lies exactly in front of one. The relevant border around a
//! direction is therefore that of the visible face, not of the triangle. A face grows from its first
//! triangle, whose plane represents it, across edges without a discontinuity, as long as triangles stay
//! within rounding of that plane: a finely tessellated curved surface is thus not absorbed step by step into
//! one face. Tolerances are `FLAT` and [`THICK`].

use std::collections::VecDeque;

use glam::DVec3;

use crate::scene::{FLAT, NONE, Scene};

/// Distance from a face's plane, relative to the scene, within which corners (displaced by the rounding of
/// the input) belong to it. It is half of the tolerance for being in front of a plane, so that no edge is
/// lost that bounds a triangle of the face other than the first.
const THICK: f64 = 5e-7;

/// First triangle of each triangle's face.
pub(super) fn grow(scene: &Scene) -> Vec<u32> {
    let mut first = vec![NONE; scene.triangles.len()];
    let size = scene.positions.iter().fold(0.0_f64, |size, p| size.max(p.abs().max_element()));
    let normal = |[a, b, c]: [DVec3; 3]| (b - a).cross(c - a).normalize_or_zero();
    let mut open = VecDeque::new();
    for seed in 0..scene.triangles.len() as u32 {
        if first[seed as usize] != NONE {
            continue;
        }
        let plane = scene.corners(seed);
        let up = normal(plane);
        let thick = THICK * size + scene.grain(plane[0]);
        first[seed as usize] = seed;
        open.push_back(seed);
        while let Some(t) = open.pop_front() {
            for other in (0..3).filter_map(|k| scene.adjacency.smooth(t, k)) {
                let p = scene.corners(other);
                let in_plane = p.iter().all(|p| up.dot(*p - plane[0]).abs() <= thick);
                if first[other as usize] == NONE && in_plane && normal(p).distance(up) <= FLAT {
                    first[other as usize] = seed;
                    open.push_back(other);
                }
            }
        }
    }
    first
}
