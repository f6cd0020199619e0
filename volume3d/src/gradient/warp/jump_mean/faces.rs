//! Borders of [faces](crate::gradient::edges): the edges between two of them.

use std::sync::Arc;

use super::edge::{Cone, Edge};
use super::tree::{Layout, Tree};
use crate::scene::NONE;

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

impl Faces {
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
