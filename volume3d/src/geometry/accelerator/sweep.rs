//! Traversal of the hierarchy by a fan of rays that leave surfaces.
//!
//! Rays that end at one point are traced backwards from there; those of one direction from a plane behind
//! their origins. The fan rejects and, for occlusion queries, accepts hits that are certain. The remainder is
//! decided by the exact test of each ray from its own origin.

use super::fan::{Fan, beside};
use super::fan_filter::{BoxTest, FanRow, TriangleTest};
use super::frame::{Depth, Frame};
use super::sheaf::{Goal, Sheaf};
use super::traverse::{PENDING, Pending, Stack};
use super::tree::Link;
use super::watertight::{Crossing, PACKET, ROWS, Shear, Shears};
use super::{Accelerator, Hit};
use crate::lanes::{Lanes, Row, WIDTH, next};

/// Results of every ray so far.
pub(super) struct Found {
    rows: [FanRow; ROWS],
    /// By row, the depths within which hits are certain.
    within: [[Row; 2]; ROWS],
    /// Map from distances to depths, by ray.
    depths: [Depth; PACKET],
    /// Bit masks of occluded rays, and of those that may have another hit.
    pub(super) occluded: u32,
    open: u32,
    /// First hits of rays that have one.
    distance: [f64; PACKET],
    triangle: [u32; PACKET],
    edges: [[f64; 3]; PACKET],
}

impl Found {
    #[inline(always)]
    pub(super) fn new(
        frame: &Frame,
        sheaf: &Sheaf,
        end: Option<&Goal<'_>>,
        fan: &Fan,
        (shears, members): (&Shears, u32),
    ) -> Self {
        let offsets = if end.is_none() { beside(fan, frame, &sheaf.origins) } else { [[0.0; PACKET]; 2] };
        let mut found = Self {
            rows: [FanRow::new(fan, &shears.rows[0]), FanRow::new(fan, &shears.rows[1])],
            within: [[[f32::INFINITY; WIDTH], [f32::NEG_INFINITY; WIDTH]]; ROWS],
            depths: [Depth { scale: 0.0, start: 0.0, slack: 0.0 }; PACKET],
            occluded: 0,
            open: members,
            distance: sheaf.far,
            triangle: [0; PACKET],
            edges: [[0.0; 3]; PACKET],
        };
        for (index, row) in shears.rows.iter().enumerate() {
            let own = &mut found.rows[index];
            if end.is_none() {
                own.set_offsets(&offsets, index * WIDTH);
            }
            for lane in 0..WIDTH {
                let at = index * WIDTH + lane;
                let depth = fan.depth_of(row.inverse[lane], sheaf.origins[fan.along][at]);
                found.depths[at] = depth;
                // Seen from the end, objects nearer to the origin are farther away.
                let (first, last) = match end {
                    Some(end) => (end.distances[at] - sheaf.far[at], end.distances[at] - sheaf.near),
                    None => (sheaf.near, sheaf.far[at]),
                };
                let member = members >> at & 1 == 1;
                own.near[lane] = if member { depth.below(first) } else { f32::INFINITY };
                own.limit[lane] = if member { depth.above(last) } else { f32::NEG_INFINITY };
                let certain = member & fan.is_moderate;
                found.within[index][0][lane] = if certain { depth.above(first) } else { f32::INFINITY };
                found.within[index][1][lane] = if certain { depth.below(last) } else { f32::NEG_INFINITY };
            }
        }
        found
    }

    /// Writes the first hits of rays that have one.
    #[inline(always)]
    pub(super) fn write(&self, hits: &mut [Option<Hit>]) {
        let mut lanes = self.occluded;
        while lanes != 0 {
            let at = next(&mut lanes) % PACKET;
            let crossing = Crossing { distance: self.distance[at], edges: self.edges[at] };
            let barycentric = crossing.barycentric();
            hits[at] = Some(Hit { triangle: self.triangle[at], distance: crossing.distance, barycentric });
        }
    }

    #[inline(always)]
    fn greatest_limit(&self) -> f32 {
        let [low, high] = &self.rows;
        low.greatest_limit().max(high.greatest_limit())
    }

    /// Marks rays as occluded; they need no further tests.
    #[inline(always)]
    fn close(&mut self, mut rays: u32) {
        self.occluded |= rays;
        self.open &= !rays;
        while rays != 0 {
            let ray = next(&mut rays) % PACKET;
            let (row, lane) = (&mut self.rows[ray / WIDTH], ray % WIDTH);
            (row.near[lane], row.limit[lane]) = (f32::INFINITY, f32::NEG_INFINITY);
        }
    }

    /// Accepts a crossing if it is the first one of a ray so far; returns whether it is.
    #[inline(always)]
    fn take(&mut self, at: usize, triangle: u32, near: f64, crossing: Crossing) -> bool {
        let distance = crossing.distance;
        let tie =
            self.occluded >> at & 1 == 1 && distance == self.distance[at] && triangle < self.triangle[at];
        if !((distance < self.distance[at] || tie) && distance > near) {
            return false;
        }
        (self.distance[at], self.triangle[at], self.edges[at]) = (distance, triangle, crossing.edges);
        self.occluded |= 1 << at;
        self.rows[at / WIDTH].limit[at % WIDTH] = self.depths[at].above(distance);
        true
    }
}

/// Traversal of the whole tree by a fan.
pub(super) struct Sweep<'a, const ANY: bool> {
    pub(super) accelerator: &'a Accelerator,
    pub(super) sheaf: &'a Sheaf,
    pub(super) fan: &'a Fan,
    pub(super) found: Found,
}

impl<const ANY: bool> Sweep<'_, ANY> {
    #[inline(always)]
    pub(super) fn run<L: Lanes>(mut self, lanes: L) -> Found {
        let pending = self.accelerator.tree.pending;
        if pending <= PENDING {
            self.descend(lanes, &mut [Pending::ROOT; PENDING]);
        } else {
            self.descend(lanes, &mut vec![Pending::ROOT; pending]);
        }
        self.found
    }

    #[inline(always)]
    fn descend<L: Lanes>(&mut self, lanes: L, entries: &mut [Pending]) {
        let tree = &self.accelerator.tree;
        let boxes = BoxTest::new(lanes, self.fan);
        let triangles = TriangleTest::new(lanes, self.fan);
        let mut limit = self.fan.whole_depth(self.found.greatest_limit());
        let mut stack = Stack::new(entries);
        let mut link = Link::ROOT;
        loop {
            if !link.is_leaf() {
                let node = &tree.nodes[link.index()];
                let (mask, depths) = boxes.entered(node, limit);
                if mask != 0 {
                    link = stack.descend(lanes, tree, node, mask, &depths);
                } else if let Some(pending) = stack.pop(limit) {
                    link = pending;
                } else {
                    return;
                }
                continue;
            }
            let functions = triangles.functions(&tree.leaves[link.index()]);
            let mut candidates = triangles.candidates(&functions) & link.mask();
            let mut closer = false;
            while candidates != 0 {
                let lane = next(&mut candidates);
                let [low, high] = &self.found.rows;
                let [low, high] = [functions.met(lanes, lane, low), functions.met(lanes, lane, high)];
                let rays = low.rays | high.rays << WIDTH;
                if rays == 0 {
                    continue;
                }
                let triangle = tree.triangles(link)[lane];
                let rays = rays & !self.leaving(triangle);
                let mut certain = 0;
                if ANY {
                    let [[low_first, low_last], [high_first, high_last]] = &self.found.within;
                    certain = low.certain(lanes, [low_first, low_last])
                        | high.certain(lanes, [high_first, high_last]) << WIDTH;
                    certain &= rays;
                }
                closer |= self.decide(link, lane, rays & !certain, certain);
            }
            if closer {
                if ANY && self.found.open == 0 {
                    return;
                }
                limit = self.fan.whole_depth(self.found.greatest_limit());
            }
            let Some(pending) = stack.pop(limit) else { return };
            link = pending;
        }
    }

    /// Bit mask of rays that never hit a triangle, as they leave it or end on it.
    #[inline(always)]
    fn leaving(&self, triangle: u32) -> u32 {
        let Sheaf { from, target, .. } = self.sheaf;
        let mut rays = 0;
        for at in 0..PACKET {
            rays |= u32::from((from[at] == triangle) | (ANY & (target[at] == triangle))) << at;
        }
        rays
    }

    /// Exact test of a triangle against the rays of a mask, some others of which hit it with certainty;
    /// returns whether any result changed.
    #[inline(always)]
    fn decide(&mut self, leaf: Link, lane: usize, mut rays: u32, certain: u32) -> bool {
        let tree = &self.accelerator.tree;
        let (sheaf, triangle) = (self.sheaf, tree.triangles(leaf)[lane]);
        let (mut hit, mut closer) = (certain, false);
        while rays != 0 {
            let at = next(&mut rays) % PACKET;
            let Some(shear) = Shear::new(sheaf.origin(at), sheaf.direction(at)) else { continue };
            let Some(crossing) = shear.intersect(tree.corners(leaf, lane)) else { continue };
            if !ANY {
                closer |= self.found.take(at, triangle, sheaf.near, crossing);
            } else if sheaf.near < crossing.distance && crossing.distance < sheaf.far[at] {
                hit |= 1 << at;
            }
        }
        if ANY {
            self.found.close(hit);
        }
        closer | (hit != 0)
    }
}
