//! Packets: up to sixteen rays with one origin, one longest axis and similar slopes, traced together.

use super::fan::Fan;
use super::fan_filter::{BoxTest, FanRow, TriangleTest};
use super::traverse::{PENDING, Pending, Stack};
use super::tree::Link;
use super::watertight::{Crossing, Crossings, ROWS, ShearRow, Shears, relative};
use super::{Accelerator, Hit};
use crate::lanes::{Lanes, Task, WIDTH, next};

/// Limits shared by the rays of a bundle.
#[derive(Clone, Copy)]
pub(super) struct Limits {
    pub(super) near: f64,
    pub(super) far: f64,
    pub(super) from: Option<u32>,
}

/// Nearest hits so far.
pub(super) struct Packet {
    rows: [PacketRow; ROWS],
}

/// Nearest hits of a row of lanes.
#[derive(Clone, Copy)]
struct PacketRow {
    fan: FanRow,
    /// Depth per distance.
    scale: [f64; WIDTH],
    distance: [f64; WIDTH],
    /// Hits of the lanes in the bit mask `found`.
    triangle: [u32; WIDTH],
    edges: [[f64; WIDTH]; 3],
    found: u32,
}

impl PacketRow {
    #[inline(always)]
    fn new(fan: &Fan, shears: &ShearRow, members: u32, limits: &Limits) -> Self {
        let mut row = Self {
            fan: FanRow::new(fan, shears),
            scale: [0.0; WIDTH],
            distance: [limits.far; WIDTH],
            triangle: [0; WIDTH],
            edges: [[0.0; WIDTH]; 3],
            found: 0,
        };
        for lane in 0..WIDTH {
            let depth = fan.depth(shears.inverse[lane]);
            row.scale[lane] = depth.scale;
            if members >> lane & 1 == 1 {
                row.fan.near[lane] = depth.below(limits.near);
                row.fan.limit[lane] = depth.above(limits.far);
            }
        }
        row
    }

    /// Accepts the crossings of a mask that are nearer than previous ones; returns whether there are any.
    #[inline(always)]
    fn take(&mut self, fan: &Fan, triangle: u32, crossings: &Crossings, mut lanes: u32, near: f64) -> bool {
        let mut better = false;
        while lanes != 0 {
            let lane = next(&mut lanes) % WIDTH;
            let distance = crossings.distance[lane];
            let tie = self.found >> lane & 1 == 1
                && distance == self.distance[lane]
                && triangle < self.triangle[lane];
            if (distance < self.distance[lane] || tie) && distance > near {
                self.distance[lane] = distance;
                self.triangle[lane] = triangle;
                for edge in 0..3 {
                    self.edges[edge][lane] = crossings.edges[edge][lane];
                }
                self.found |= 1 << lane;
                self.fan.limit[lane] = fan.depth_of_scale(self.scale[lane]).above(distance);
                better = true;
            }
        }
        better
    }
}

impl Packet {
    #[inline(always)]
    pub(super) fn new(fan: &Fan, shears: &Shears, limits: &Limits) -> Self {
        let [low, high] = &shears.rows;
        let members = shears.members;
        Self {
            rows: [
                PacketRow::new(fan, low, members, limits),
                PacketRow::new(fan, high, members >> WIDTH, limits),
            ],
        }
    }

    #[inline(always)]
    pub(super) fn write<H: From<Hit>>(&self, hits: &mut [Option<H>]) {
        for (row, hits) in self.rows.iter().zip(hits.chunks_mut(WIDTH)) {
            let mut found = row.found;
            while found != 0 {
                let lane = next(&mut found) % WIDTH;
                let crossing = Crossing {
                    distance: row.distance[lane],
                    edges: [0, 1, 2].map(|edge| row.edges[edge][lane]),
                };
                hits[lane] = Some(H::from(Hit {
                    triangle: row.triangle[lane],
                    distance: crossing.distance,
                    barycentric: crossing.barycentric(),
                }));
            }
        }
    }

    /// Greatest depth at which any ray still looks for a hit.
    #[inline(always)]
    fn greatest_limit(&self) -> f32 {
        let [low, high] = &self.rows;
        low.fan.greatest_limit().max(high.fan.greatest_limit())
    }
}

/// Traversal of the whole tree by a packet.
pub(super) struct PacketTraversal<'a> {
    pub(super) accelerator: &'a Accelerator,
    pub(super) fan: &'a Fan,
    pub(super) shears: &'a Shears,
    pub(super) limits: &'a Limits,
    pub(super) packet: &'a mut Packet,
}

impl Task for PacketTraversal<'_> {
    type Output = ();

    #[inline(always)]
    fn run<L: Lanes>(mut self, lanes: L) {
        let pending = self.accelerator.tree.pending;
        if pending <= PENDING {
            self.descend(lanes, &mut [Pending::ROOT; PENDING]);
        } else {
            self.descend(lanes, &mut vec![Pending::ROOT; pending]);
        }
    }
}

impl PacketTraversal<'_> {
    #[inline(always)]
    fn descend<L: Lanes>(&mut self, lanes: L, entries: &mut [Pending]) {
        let tree = &self.accelerator.tree;
        let boxes = BoxTest::new(lanes, self.fan);
        let triangles = TriangleTest::new(lanes, self.fan);
        let mut limit = self.fan.whole_depth(self.packet.greatest_limit());
        let mut stack = Stack::new(entries);
        let mut link = Link::ROOT;
        loop {
            if !link.is_leaf() {
                let node = &tree.nodes[link.index()];
                let (mask, depths) = boxes.entered(node, limit);
                if mask != 0 {
                    link = stack.descend(lanes, tree, node, mask, &depths);
                    tree.prefetch_exact(lanes, link);
                } else if let Some(pending) = stack.pop(limit) {
                    link = pending;
                } else {
                    return;
                }
                continue;
            }
            let leaf = &tree.leaves[link.index()];
            let functions = triangles.functions(leaf);
            let mut candidates = triangles.candidates(&functions) & link.mask();
            let mut closer = false;
            while candidates != 0 {
                let lane = next(&mut candidates);
                let [low, high] = &self.packet.rows;
                let rays = functions.met(lanes, lane, &low.fan).rays
                    | functions.met(lanes, lane, &high.fan).rays << WIDTH;
                if rays != 0 {
                    closer |= self.decide(lanes, link, lane, rays);
                }
            }
            if closer {
                limit = self.fan.whole_depth(self.packet.greatest_limit());
            }
            let Some(pending) = stack.pop(limit) else { return };
            link = pending;
            tree.prefetch_exact(lanes, link);
        }
    }

    /// Exact test of a triangle against the rays of a mask; returns whether any of them found a nearer hit.
    #[inline(always)]
    fn decide<L: Lanes>(&mut self, lanes: L, leaf: Link, lane: usize, rays: u32) -> bool {
        let tree = &self.accelerator.tree;
        let triangle = tree.triangles(leaf)[lane];
        if self.limits.from == Some(triangle) {
            return false;
        }
        // Origin and axes are common to all rays.
        let relative = relative(tree.corners(leaf, lane), self.shears.axes, self.shears.origin);
        let mut closer = false;
        for row in 0..ROWS {
            let rays = rays >> (row * WIDTH) & ((1 << WIDTH) - 1);
            if rays != 0 {
                let crossings = self.shears.rows[row].cross(lanes, &relative);
                let row = &mut self.packet.rows[row];
                closer |= row.take(self.fan, triangle, &crossings, rays & crossings.lanes, self.limits.near);
            }
        }
        closer
    }
}
