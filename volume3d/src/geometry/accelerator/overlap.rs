//! Pairs of triangles whose boxes meet, up to the rounding of transforms, by a query of the hierarchy against
//! itself.

use glam::{DVec3, Vec3A};
use rayon::prelude::*;

use super::build::Bounds;
use super::tree::{Link, Node, Tree};
use super::{Accelerator, Mesh};
use crate::geometry::meeting::ROUNDING;
use crate::lanes::WIDTH;

/// A leaf and its box.
#[derive(Clone, Copy)]
struct Place {
    leaf: Link,
    bounds: Bounds,
}

impl Accelerator {
    /// Results of `visit` for all pairs of triangles whose boxes meet up to rounding, each pair once with the
    /// lower index first. The order depends only on the hierarchy, not on the number of threads.
    ///
    /// `positions` and `triangles` must be those that the hierarchy was built over; the positions were given,
    /// and rounded, relative to another origin.
    pub(crate) fn each_pair<T: Send>(
        &self,
        positions: &[DVec3],
        triangles: &[[u32; 3]],
        origin: DVec3,
        visit: impl Fn(u32, u32, &mut Vec<T>) + Sync,
    ) -> Vec<T> {
        let mesh = Mesh { positions, triangles };
        let (lower, upper) = self.bounds;
        let rounding = ROUNDING * self.frame.scale * largest(lower - origin, upper - origin);
        let places = self.tree.places(rounding as f32 + f32::EPSILON);
        let found: Vec<Vec<T>> = places
            .par_iter()
            .map_init(Vec::new, |stack, place| {
                let mut found = vec![];
                self.tree.meet(place, stack, |other| {
                    self.pairs((mesh, origin), [place.leaf, other], |s, t| visit(s, t, &mut found));
                });
                found
            })
            .collect();
        found.into_iter().flatten().collect()
    }

    /// Pairs between two leaves, or within one leaf.
    fn pairs(
        &self,
        (mesh, origin): (Mesh<'_>, DVec3),
        [leaf, other]: [Link; 2],
        mut visit: impl FnMut(u32, u32),
    ) {
        let members = |leaf: Link| {
            let triangles = self.tree.triangles(leaf);
            (0..WIDTH).filter(move |lane| leaf.mask() >> lane & 1 == 1).map(move |lane| triangles[lane])
        };
        let bounds = |t: u32| {
            let [a, b, c] = mesh.corners(t);
            let (low, high) = (a.min(b).min(c), a.max(b).max(c));
            let rounding = ROUNDING * largest(low - origin, high - origin);
            // Triangles smaller than their rounding have no well-defined plane or edges for contact tests;
            // whether they cross is decided exactly. Without this case all boxes would meet where coordinates
            // have lost their digits.
            let is_lost = (high - low).length() <= 0.5 * rounding;
            let rounding = if is_lost { 0.0 } else { rounding };
            (low - rounding, high + rounding)
        };
        let mut others = [(0, (DVec3::ZERO, DVec3::ZERO)); WIDTH];
        let mut count = 0;
        for t in members(other) {
            others[count] = (t, bounds(t));
            count += 1;
        }
        for (i, s) in members(leaf).enumerate() {
            let (low, high) = if leaf == other { others[i].1 } else { bounds(s) };
            let first = if leaf == other { i + 1 } else { 0 };
            for &(t, (from, to)) in &others[first..count] {
                if low.cmple(to).all() && from.cmple(high).all() {
                    visit(s.min(t), s.max(t));
                }
            }
        }
    }
}

/// Largest coordinate within a box.
fn largest(low: DVec3, high: DVec3) -> f64 {
    low.abs().max(high.abs()).max_element()
}

impl Tree {
    /// All leaves with their boxes, widened, in the order of the hierarchy.
    fn places(&self, by: f32) -> Vec<Place> {
        let mut places = vec![];
        for node in &self.nodes {
            for (lane, leaf) in node.children.into_iter().enumerate() {
                let bounds = node.bounds(lane);
                if leaf.is_leaf() && bounds.lower.cmple(bounds.upper).all() {
                    let bounds = Bounds { lower: bounds.lower - by, upper: bounds.upper + by };
                    places.push(Place { leaf, bounds });
                }
            }
        }
        places
    }

    /// Calls back with every leaf, from this one on, whose box meets its box.
    fn meet(&self, place: &Place, stack: &mut Vec<Link>, mut visit: impl FnMut(Link)) {
        if self.nodes.is_empty() {
            return;
        }
        stack.push(Link::ROOT);
        while let Some(link) = stack.pop() {
            if link.is_leaf() {
                if link.index() >= place.leaf.index() {
                    visit(link);
                }
                continue;
            }
            let node = &self.nodes[link.index()];
            let mut met = node.met(place.bounds);
            while met != 0 {
                let lane = met.trailing_zeros() as usize;
                met &= met - 1;
                stack.push(node.children[lane]);
            }
        }
    }
}

impl Node {
    fn bounds(&self, lane: usize) -> Bounds {
        let plane = |side: usize| Vec3A::from_array(self.planes.map(|axis| axis[side][lane]));
        Bounds { lower: plane(0), upper: plane(1) }
    }

    /// Bit mask of children whose boxes meet a box; boxes in the frame contain their contents.
    fn met(&self, bounds: Bounds) -> u32 {
        let mut met = [true; WIDTH];
        for (axis, [lower, upper]) in self.planes.iter().enumerate() {
            for lane in 0..WIDTH {
                met[lane] &= lower[lane] <= bounds.upper[axis] && upper[lane] >= bounds.lower[axis];
            }
        }
        met.into_iter().enumerate().fold(0, |bits, (lane, met)| bits | u32::from(met) << lane)
    }
}
