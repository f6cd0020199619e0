//! Traversal by single rays: eight boxes, then eight triangles at a time.

use super::frame::{Depth, FrameRay};
use super::ray_filter::{BoxTest, TriangleTest};
use super::tree::{Link, Node, Tree};
use super::watertight::{Crossing, Shear};
use super::{Accelerator, Ray};
use crate::lanes::{Lanes, Row, Task, next};

/// Links on the stack: enough for trees of up to 9 levels. Deeper ones allocate on the heap.
pub(super) const PENDING: usize = 64;

/// Links on the stack for trees of two levels: the memory is cleared for every ray.
const FEW_PENDING: usize = 16;

/// A pending link and the depth at which the ray enters its box, as one number that sorts by depth: the bits
/// of nonnegative floats sort like the floats.
#[derive(Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
pub(super) struct Pending(u64);

impl Pending {
    pub(super) const ROOT: Self = Self::new(Link::ROOT, 0.0);

    #[inline(always)]
    const fn new(link: Link, depth: f32) -> Self {
        Self((depth.to_bits() as u64) << 32 | link.bits() as u64)
    }

    #[inline(always)]
    pub(super) fn link(self) -> Link {
        Link::from_bits(self.0 as u32)
    }

    #[inline(always)]
    fn depth(self) -> f32 {
        f32::from_bits((self.0 >> 32) as u32)
    }
}

/// Pending links, nearest on top among those of one node.
pub(super) struct Stack<'a> {
    entries: &'a mut [Pending],
    height: usize,
}

impl<'a> Stack<'a> {
    #[inline(always)]
    pub(super) fn new(entries: &'a mut [Pending]) -> Self {
        Self { entries, height: 0 }
    }

    /// The top link that is entered no deeper than `limit`; those above it are dropped.
    #[inline(always)]
    pub(super) fn pop(&mut self, limit: f32) -> Option<Link> {
        while self.height > 0 {
            self.height -= 1;
            let pending = self.entries[self.height];
            if pending.depth() <= limit {
                return Some(pending.link());
            }
        }
        None
    }

    /// Pushes the children of a mask except the nearest, which is returned; for one or two children there is
    /// no branch that depends on their order.
    #[inline(always)]
    pub(super) fn descend<L: Lanes>(
        &mut self,
        lanes: L,
        tree: &Tree,
        node: &Node,
        mut mask: u32,
        depths: &Row,
    ) -> Link {
        let lane = next(&mut mask);
        let mut nearest = Pending::new(node.children[lane], depths[lane]);
        tree.prefetch(lanes, nearest.link());
        let bottom = self.height;
        while mask != 0 {
            let lane = next(&mut mask);
            let pending = Pending::new(node.children[lane], depths[lane]);
            tree.prefetch(lanes, pending.link());
            let farther = nearest.max(pending);
            nearest = nearest.min(pending);
            let mut place = self.height;
            while place > bottom && self.entries[place - 1] < farther {
                self.entries[place] = self.entries[place - 1];
                place -= 1;
            }
            self.entries[place] = farther;
            self.height += 1;
        }
        nearest.link()
    }
}

/// Collector of hits.
pub(super) trait Collect {
    /// Whether any hit is enough.
    const ANY: bool;
    /// Sets the map from distances to depths.
    fn prepare(&mut self, depth: Depth);
    /// Whether a triangle may be hit.
    fn counts(&self, triangle: u32) -> bool;
    /// Records a hit of any triangle, if [`Collect::ANY`].
    fn take_any(&mut self);
    /// Takes a crossing of a triangle. Returns a new limit of depth, if there is one.
    fn take(&mut self, triangle: u32, crossing: Crossing) -> Option<f32>;
}

/// Traversal of the whole tree by one ray.
pub(super) struct Traversal<'a, C> {
    pub(super) accelerator: &'a Accelerator,
    pub(super) ray: &'a Ray,
    pub(super) collect: &'a mut C,
}

impl<C: Collect> Task for Traversal<'_, C> {
    type Output = ();

    #[inline(always)]
    fn run<L: Lanes>(self, lanes: L) {
        let Some(shear) = Shear::new(self.ray.origin, self.ray.direction) else { return };
        let Some((ray, depth)) = self.accelerator.frame.ray(self.ray, &shear) else { return };
        self.collect.prepare(depth);
        let pending = self.accelerator.tree.pending;
        let (mut few, mut some, mut many);
        let entries: &mut [Pending] = if pending <= FEW_PENDING {
            few = [Pending::ROOT; FEW_PENDING];
            &mut few
        } else if pending <= PENDING {
            some = [Pending::ROOT; PENDING];
            &mut some
        } else {
            many = vec![Pending::ROOT; pending];
            &mut many
        };
        self.descend(lanes, &shear, &ray, entries);
    }
}

impl<C: Collect> Traversal<'_, C> {
    #[inline(always)]
    fn descend<L: Lanes>(self, lanes: L, shear: &Shear, ray: &FrameRay, entries: &mut [Pending]) {
        let tree = &self.accelerator.tree;
        let boxes = BoxTest::new(lanes, ray);
        let triangles = TriangleTest::new(lanes, ray);
        let mut limit = ray.far;
        let mut stack = Stack::new(entries);
        let mut link = Link::ROOT;
        loop {
            if !link.is_leaf() {
                let node = &tree.nodes[link.index()];
                let (mask, depths) = boxes.entered(node, limit);
                if mask != 0 {
                    link = stack.descend(lanes, tree, node, mask, &depths);
                    if !C::ANY {
                        tree.prefetch_exact(lanes, link);
                    }
                } else if let Some(pending) = stack.pop(limit) {
                    link = pending;
                } else {
                    return;
                }
                continue;
            }
            let leaf = &tree.leaves[link.index()];
            let filtered = triangles.filtered(leaf, limit);
            let mut candidates = filtered.candidates & link.mask();
            if C::ANY && candidates != 0 {
                let mut certain = triangles.certain(&filtered) & candidates;
                while certain != 0 {
                    if self.collect.counts(tree.triangles(link)[next(&mut certain)]) {
                        self.collect.take_any();
                        return;
                    }
                }
            }
            while candidates != 0 {
                let lane = next(&mut candidates);
                let triangle = tree.triangles(link)[lane];
                // A ray that leaves a surface meets its own triangle first: no exact test of it.
                if self.collect.counts(triangle)
                    && let Some(crossing) = shear.intersect(tree.corners(link, lane))
                    && let Some(closer) = self.collect.take(triangle, crossing)
                {
                    limit = closer;
                }
            }
            let Some(pending) = stack.pop(limit) else { return };
            link = pending;
            if !C::ANY {
                tree.prefetch_exact(lanes, link);
            }
        }
    }
}
