//! Faces: sets of coplanar triangles that continue one another without a discontinuity.
//!
//! Edges between the triangles of a face are not discontinuities, and a warp field must ignore them:
//! otherwise it would change where a silhouette lies exactly in front of one. The relevant border around a
//! direction is therefore that of the visible face, not of the triangle. A face grows from its first
//! triangle, whose plane represents it, across edges without a discontinuity, as long as triangles stay
//! within rounding of that plane: a finely tessellated curved surface is thus not absorbed step by step into
//! one face. Tolerances are `FLAT` and [`THICK`].

use std::collections::VecDeque;
use std::sync::Arc;

use glam::DVec3;

use super::edge::{Cone, Edge};
use super::tree::{Layout, Tree};
use crate::scene::{FLAT, NONE, Scene};

/// Distance from a face's plane, relative to the scene, within which corners (displaced by the rounding of
/// the input) belong to it. It is half of the tolerance for being in front of a plane, so that no edge is
/// lost that bounds a triangle of the face other than the first.
const THICK: f64 = 5e-7;

/// Number of border edges above which a face has a tree of its own.
const MANY: usize = 24;

/// Faces of a scene.
#[derive(Clone, Debug, Default)]
pub(crate) struct Faces {
    /// First triangle of each triangle's face.
    first: Arc<[u32]>,
    /// For each triangle that is the first of its face, the start of its border in `border`, and the end.
    begin: Vec<u32>,
    /// Edges between two faces, or with one face on both sides, as slots of the tree.
    border: Vec<u32>,
    /// Faces with many border edges, in order.
    large: Vec<(u32, Tree)>,
}

/// First triangle of each triangle's face, shared by fields and edge lists.
#[derive(Debug)]
struct Grown(Arc<[u32]>);

impl Faces {
    /// First triangle of each triangle's face, cached with the scene.
    pub(crate) fn grown(scene: &Scene) -> Arc<[u32]> {
        Arc::clone(&scene.derived(|scene| Grown(Self::grow(scene).into())).0)
    }

    /// First triangle of each triangle's face, computed.
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

    /// Borders of faces, from ordered edges.
    pub(super) fn new(first: Arc<[u32]>, edges: &Layout) -> Self {
        let sides = |edge: &Edge| {
            let [f, g] = edge.faces;
            // A slit has one face on both sides and appears once among its edges.
            [f, if g == f { NONE } else { g }].into_iter().filter(|f| *f != NONE)
        };
        // Before it has the start of each face's border, it has that of the next.
        let mut begin = vec![0_u32; first.len() + 2];
        edges.slots().flat_map(|(_, edge)| sides(edge)).for_each(|f| begin[f as usize + 2] += 1);
        for f in 0..first.len() {
            begin[f + 2] += begin[f + 1];
        }
        let mut border = vec![0; begin[first.len() + 1] as usize];
        for (slot, edge) in edges.slots() {
            for f in sides(edge) {
                let place = &mut begin[f as usize + 1];
                border[*place as usize] = slot;
                *place += 1;
            }
        }
        begin.truncate(first.len() + 1);
        let many = |f: &u32| (begin[*f as usize + 1] - begin[*f as usize]) as usize > MANY;
        let large = (0..first.len() as u32).filter(many).map(|f| {
            let range = begin[f as usize] as usize..begin[f as usize + 1] as usize;
            (f, Tree::of_border(border[range].iter().map(|&slot| *edges.edge(slot)).collect()))
        });
        let large = large.collect();
        Self { first, begin, border, large }
    }

    /// First triangle of each triangle's face.
    pub(super) fn first(&self) -> &[u32] {
        &self.first
    }

    /// The triangle whose plane represents a triangle's face.
    pub(super) fn plane(&self, triangle: u32) -> u32 {
        self.first[triangle as usize]
    }

    /// Calls back with every non-silhouette edge of a triangle's face that may be within a cone.
    pub(super) fn for_each(&self, edges: &Tree, triangle: u32, cone: &Cone<'_>, mut f: impl FnMut(&Edge)) {
        let face = self.first[triangle as usize];
        if let Ok(place) = self.large.binary_search_by_key(&face, |(f, _)| *f) {
            self.large[place].1.visit(cone, false, f);
            return;
        }
        let range = self.begin[face as usize] as usize..self.begin[face as usize + 1] as usize;
        let border = self.border[range].iter().map(|&slot| edges.edge(slot));
        border.filter(|edge| !edge.is_silhouette(cone)).for_each(|edge| f(&edge));
    }
}
