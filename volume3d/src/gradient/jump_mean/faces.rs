//! Faces: coplanar triangles that continue one another without a jump.
//!
//! The edges between the triangles of a face are no jumps, and a warp field must not know of them: it would turn where a
//! silhouette lies exactly before one. So what counts around a direction is the border of the face that is seen, not that
//! of the triangle. A face grows from its first triangle, whose plane stands for it, over edges without a jump, as long
//! as triangles stay within rounding of that plane: so that a finely divided curved surface is not taken for one face,
//! step by step. What rounding is, `FLAT` and [`THICK`] say.

use std::collections::VecDeque;
use std::sync::Arc;

use glam::DVec3;

use super::edge::{Cone, Edge};
use super::tree::Tree;
use crate::scene::{FLAT, NONE, Scene};

/// Corners no farther from a face's plane than this part of the scene, and what rounding does to positions as
/// they were given, are in it: half of what is taken for before a plane, so that nothing is lost which bounds
/// some other triangle of the face than the first.
const THICK: f64 = 5e-7;

/// Borders of more edges are looked up in a tree of their own.
const MANY: usize = 24;

/// The faces of a scene.
#[derive(Clone, Debug, Default)]
pub(crate) struct Faces {
    /// The first triangle of each triangle's face.
    first: Vec<u32>,
    /// For each triangle that is the first of its face, where its border begins among `border`, and the end.
    begin: Vec<u32>,
    /// Edges between two faces, or of one face on both sides, by their places in the tree's list.
    border: Vec<u32>,
    /// Faces with many of them, in order.
    large: Vec<(u32, Tree)>,
}

/// For each triangle the first of its face, as fields and lists of edges share it.
#[derive(Debug)]
struct Grown(Arc<[u32]>);

impl Faces {
    /// For each triangle the first of its face.
    pub(crate) fn grown(scene: &Scene) -> Arc<[u32]> {
        Arc::clone(&scene.derived(|scene| Grown(Self::grow(scene).into())).0)
    }

    /// The same, found anew.
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

    /// The borders of faces, whose edges have been put in order.
    pub(super) fn new(first: Vec<u32>, edges: &[Edge]) -> Self {
        let sides = |edge: &Edge| {
            let [f, g] = edge.faces;
            // A slit has one face on both sides, and is one of its edges once.
            [f, if g == f { NONE } else { g }].into_iter().filter(|f| *f != NONE)
        };
        let mut begin = vec![0_u32; first.len() + 1];
        edges.iter().flat_map(sides).for_each(|f| begin[f as usize + 1] += 1);
        for f in 0..first.len() {
            begin[f + 1] += begin[f];
        }
        let mut border = vec![0; begin[first.len()] as usize];
        let mut filled = begin.clone();
        for (i, edge) in edges.iter().enumerate() {
            for f in sides(edge) {
                border[filled[f as usize] as usize] = i as u32;
                filled[f as usize] += 1;
            }
        }
        let many = |f: &u32| (begin[*f as usize + 1] - begin[*f as usize]) as usize > MANY;
        let large = (0..first.len() as u32).filter(many).map(|f| {
            let range = begin[f as usize] as usize..begin[f as usize + 1] as usize;
            (f, Tree::of_border(border[range].iter().map(|&i| edges[i as usize]).collect()))
        });
        let large = large.collect();
        Self { first, begin, border, large }
    }

    /// The triangle whose plane is that of a triangle's face.
    pub(super) fn plane(&self, triangle: u32) -> u32 {
        self.first[triangle as usize]
    }

    /// Calls with every edge of the border of a triangle's face that is no silhouette, of those that may be within a
    /// cone.
    pub(super) fn for_each(&self, edges: &[Edge], triangle: u32, cone: &Cone<'_>, mut f: impl FnMut(&Edge)) {
        let face = self.first[triangle as usize];
        if let Ok(place) = self.large.binary_search_by_key(&face, |(f, _)| *f) {
            self.large[place].1.visit(cone, false, f);
            return;
        }
        let range = self.begin[face as usize] as usize..self.begin[face as usize + 1] as usize;
        let border = self.border[range].iter().map(|&i| &edges[i as usize]);
        border.filter(|edge| !edge.is_silhouette(cone)).for_each(&mut f);
    }
}
