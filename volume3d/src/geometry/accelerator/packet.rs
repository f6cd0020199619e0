//! Up to sixteen rays with one origin, one longest axis and similar slopes, through the hierarchy at once.
//!
//! With depth ζ from the common origin along the longest axis, ray r is at the slopes S_r = S + δ_r times ζ,
//! where S is the fan's middle. Boxes are met by the interval of slopes. For triangles, vertices are sheared by
//! S; for ray r the sheared coordinates are x − δ_r ζ, and each edge function becomes linear in δ_r:
//!
//! c_x b_y − c_y b_x − δ_x (ζ_c b_y − ζ_b c_y) − δ_y (ζ_b c_x − ζ_c b_x).
//!
//! So eight triangles are first tried against the whole fan, and each that remains against eight rays at a time.

use super::frame::{Fan, FanAxis};
use super::traverse::{Grid, PENDING, Pending, Stack, edge, size};
use super::tree::{Leaf, Link, Node};
use super::watertight::{Crossing, Crossings, ROWS, ShearRow, Shears, relative};
use super::{Accelerator, Hit};
use crate::lanes::{Lanes, Row, Steps, Task, WIDTH, next};

/// Rays of a packet: two rows of lanes.
pub(super) const PACKET: usize = ROWS * WIDTH;

/// Error of an edge function of ray r, over e times the sum of |x| + |y| over the vertices and of 6 F, where F ≤ 1
/// bounds |δ ζ|. The ray's coordinates x − δ ζ are below x + F and off by e + 4 u F (roundings of δ and ζ), at most
/// 1.25 e. Roundings: products of the first difference and the sum, of coordinates at most 5, 20 u; those
/// of the terms in δ, 6 u F. Together at most 1.25 e + 26 u < 2.6 e, as e ≥ 20 u. The share of e that is the grid's
/// holds for every ray: these are the edge functions of a triangle on the grid, at slopes of at most 1.
const EDGE_SHARE: f32 = 3.0;

/// The terms of second order, over e²: 2 · 1.25², and 3 for each of 6 coordinates computed too small by e.
const EDGE_FLOOR: f32 = 24.0;

/// What the rays of a bundle share besides their origin.
#[derive(Clone, Copy)]
pub(super) struct Limits {
    pub(super) near: f64,
    pub(super) far: f64,
    pub(super) from: Option<u32>,
}

/// The best of every ray so far.
pub(super) struct Packet {
    rows: [PacketRow; ROWS],
}

/// The same of a row of lanes.
#[derive(Clone, Copy)]
struct PacketRow {
    /// Slopes against the fan's middle, and the interval of depths, in which nothing lies for lanes without a ray.
    delta: [Row; 2],
    near: Row,
    limit: Row,
    /// Depth over distance.
    scale: [f64; WIDTH],
    distance: [f64; WIDTH],
    /// Of lanes with a hit, which `found` has as bits.
    triangle: [u32; WIDTH],
    edges: [[f64; WIDTH]; 3],
    found: u32,
}

impl PacketRow {
    #[inline(always)]
    fn new(fan: &Fan, shears: &ShearRow, members: u32, limits: &Limits) -> Self {
        let mut row = Self {
            delta: [[0.0; WIDTH]; 2],
            near: [f32::INFINITY; WIDTH],
            limit: [f32::NEG_INFINITY; WIDTH],
            scale: [0.0; WIDTH],
            distance: [limits.far; WIDTH],
            triangle: [0; WIDTH],
            edges: [[0.0; WIDTH]; 3],
            found: 0,
        };
        for lane in 0..WIDTH {
            row.delta[0][lane] = (shears.x[lane] - fan.axes[0].slope) as f32;
            row.delta[1][lane] = (shears.y[lane] - fan.axes[1].slope) as f32;
            let depth = fan.depth(shears.inverse[lane]);
            row.scale[lane] = depth.scale();
            let (near, limit) = (depth.below(limits.near), depth.above(limits.far));
            let member = members >> lane & 1 == 1;
            row.near[lane] = if member { near } else { f32::INFINITY };
            row.limit[lane] = if member { limit } else { f32::NEG_INFINITY };
        }
        row
    }

    /// Takes the crossings of a mask that are the best of their rays so far; whether there are any.
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
                self.limit[lane] = fan.depth_of_scale(self.scale[lane]).above(distance);
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

    /// The greatest depth at which any ray still looks for a hit.
    #[inline(always)]
    fn greatest_limit(&self) -> f32 {
        let mut greatest = f32::NEG_INFINITY;
        for row in &self.rows {
            for &limit in &row.limit {
                greatest = if limit > greatest { limit } else { greatest };
            }
        }
        greatest
    }
}

/// A packet through the whole tree.
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
                let rays = functions.rays(lanes, lane, self.packet);
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

    /// The exact test of a triangle with the rays of a mask; whether any of them came closer.
    #[inline(always)]
    fn decide<L: Lanes>(&mut self, lanes: L, leaf: Link, lane: usize, rays: u32) -> bool {
        let tree = &self.accelerator.tree;
        let triangle = tree.triangles(leaf)[lane];
        if self.limits.from == Some(triangle) {
            return false;
        }
        // The origin and the axes are those of all rays.
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

/// A fan against eight boxes.
struct BoxTest<L: Lanes> {
    lanes: L,
    /// The two axes across, and the one along.
    across: [FanAxis; 2],
    along: usize,
    backward: bool,
    /// By axis: origin for lower planes and for upper planes.
    origins: [[L::Float; 2]; 3],
    inverse: [[L::Float; 2]; 2],
    forward: L::Float,
}

impl<L: Lanes> BoxTest<L> {
    #[inline(always)]
    fn new(lanes: L, fan: &Fan) -> Self {
        let [high_x, high_y, high_z] = fan.origin_high;
        let [low_x, low_y, low_z] = fan.origin_low;
        let origins = [
            [lanes.splat(high_x), lanes.splat(low_x)],
            [lanes.splat(high_y), lanes.splat(low_y)],
            [lanes.splat(high_z), lanes.splat(low_z)],
        ];
        let [x, y] = fan.axes;
        Self {
            lanes,
            across: fan.axes,
            along: fan.along,
            backward: fan.backward,
            origins,
            inverse: [
                [lanes.splat(x.inverse[0]), lanes.splat(x.inverse[1])],
                [lanes.splat(y.inverse[0]), lanes.splat(y.inverse[1])],
            ],
            forward: lanes.splat(if fan.backward { -1.0 } else { 1.0 }),
        }
    }

    /// The boxes that some ray may enter no deeper than `limit`, and depths above which none does.
    #[inline(always)]
    fn entered(&self, node: &Node, limit: f32) -> (u32, Row) {
        let lanes = self.lanes;
        let [near, far] = self.planes(node, self.along, self.backward);
        let mut enter = lanes.max(lanes.mul(near, self.forward), lanes.splat(0.0));
        let mut leave = lanes.min(lanes.mul(far, self.forward), lanes.splat(limit));
        for across in 0..2 {
            let FanAxis { axis, negative, straddles, .. } = self.across[across];
            let [a, b] = self.inverse[across];
            let [near, far] = self.planes(node, axis, negative);
            let (near_a, near_b) = (lanes.mul(near, a), lanes.mul(near, b));
            let (far_a, far_b) = (lanes.mul(far, a), lanes.mul(far, b));
            if straddles {
                // Only lower planes bound rays of positive slope, and upper planes those of negative slope.
                enter = lanes.max(enter, lanes.max(near_b, far_a));
            } else {
                enter = lanes.max(enter, lanes.min(near_a, near_b));
                leave = lanes.min(leave, lanes.max(far_a, far_b));
            }
        }
        (lanes.less_equal(enter, leave), lanes.store(enter))
    }

    /// Near and far planes of an axis, relative to the origin.
    #[inline(always)]
    fn planes(&self, node: &Node, axis: usize, negative: bool) -> [L::Float; 2] {
        let lanes = self.lanes;
        // By index, not by a branch: signs change from bundle to bundle.
        let (near, far) = (usize::from(negative), usize::from(!negative));
        let plane = &node.planes[axis];
        [
            lanes.sub(lanes.load(&plane[near]), self.origins[axis][near]),
            lanes.sub(lanes.load(&plane[far]), self.origins[axis][far]),
        ]
    }
}

/// A fan against eight triangles.
struct TriangleTest<L: Lanes> {
    lanes: L,
    axes: [usize; 3],
    /// 1 or −1, from the longest axis to depth.
    forward: L::Float,
    origin: [L::Float; 3],
    slopes: [L::Float; 2],
    /// Half the widths of the fan.
    spread: [L::Float; 2],
    start: L::Float,
    footprint: f32,
    error: f32,
}

/// Edge functions of eight triangles, as functions of the slopes.
struct Functions<L: Lanes> {
    /// By edge: constant, and the factors of δ_x and δ_y.
    edges: [[L::Float; 3]; 3],
    slack: L::Float,
    rows: FunctionRows,
}

/// The same in memory, for one triangle to be spread over lanes of rays.
struct FunctionRows {
    edges: [[Row; 3]; 3],
    slack: Row,
    first: Row,
    last: Row,
}

impl<L: Lanes> TriangleTest<L> {
    #[inline(always)]
    fn new(lanes: L, fan: &Fan) -> Self {
        let [x, y, z] = fan.vertex_origin;
        let [across_x, across_y] = fan.axes;
        Self {
            lanes,
            axes: [across_x.axis, across_y.axis, fan.along],
            forward: lanes.splat(if fan.backward { -1.0 } else { 1.0 }),
            origin: [lanes.splat(x), lanes.splat(y), lanes.splat(z)],
            slopes: [lanes.splat(across_x.slope as f32), lanes.splat(across_y.slope as f32)],
            spread: [lanes.splat(across_x.spread), lanes.splat(across_y.spread)],
            start: lanes.splat(fan.start as f32),
            footprint: fan.footprint,
            error: fan.vertex_error,
        }
    }

    /// x, y, ζ along the ray's sign, and the depth from the place where the fan enters the scene.
    #[inline(always)]
    fn sheared(&self, grid: &Grid<L>, vertex: &[Steps; 3]) -> [L::Float; 4] {
        let lanes = self.lanes;
        let [x, y, z] = grid.relative(lanes, vertex);
        let x = lanes.mul_sub_from(self.slopes[0], z, x);
        let y = lanes.mul_sub_from(self.slopes[1], z, y);
        [x, y, lanes.add(z, self.start), z]
    }

    #[inline(always)]
    fn functions(&self, leaf: &Leaf) -> Functions<L> {
        let lanes = self.lanes;
        let [a, b, c] = &leaf.vertices;
        let grid = Grid::new(lanes, leaf, self.axes, self.origin);
        let (a, b, c) = (self.sheared(&grid, a), self.sheared(&grid, b), self.sheared(&grid, c));
        let sizes = lanes.add(lanes.add(planar_size(lanes, a), planar_size(lanes, b)), planar_size(lanes, c));
        let error = self.error + leaf.step;
        let slack = lanes.mul_add(
            lanes.splat(EDGE_SHARE * error),
            lanes.add(sizes, lanes.splat(6.0 * self.footprint)),
            lanes.splat(EDGE_FLOOR * error * error),
        );
        let depths =
            [lanes.mul(a[3], self.forward), lanes.mul(b[3], self.forward), lanes.mul(c[3], self.forward)];
        let first = lanes.sub(lanes.min(lanes.min(depths[0], depths[1]), depths[2]), lanes.splat(error));
        let last = lanes.add(lanes.max(lanes.max(depths[0], depths[1]), depths[2]), lanes.splat(error));
        let edges = [coefficients(lanes, c, b), coefficients(lanes, a, c), coefficients(lanes, b, a)];
        Functions { edges, slack, rows: rows(lanes, &edges, slack, first, last) }
    }

    /// The triangles some ray of the fan may cross.
    #[inline(always)]
    fn candidates(&self, functions: &Functions<L>) -> u32 {
        let lanes = self.lanes;
        let zero = lanes.splat(0.0);
        let mut positive = u32::MAX;
        let mut negative = u32::MAX;
        for [constant, x, y] in functions.edges {
            let reach = lanes.mul_add(
                self.spread[0],
                lanes.abs(x),
                lanes.mul_add(self.spread[1], lanes.abs(y), functions.slack),
            );
            positive &= lanes.less_equal(zero, lanes.add(constant, reach));
            negative &= lanes.less_equal(constant, reach);
        }
        positive | negative
    }
}

#[inline(always)]
fn planar_size<L: Lanes>(lanes: L, p: [L::Float; 4]) -> L::Float {
    size(lanes, [p[0], p[1], p[2]])
}

/// An edge function's constant and factors.
#[inline(always)]
fn coefficients<L: Lanes>(lanes: L, c: [L::Float; 4], b: [L::Float; 4]) -> [L::Float; 3] {
    let constant = edge(lanes, [c[0], c[1], c[2]], [b[0], b[1], b[2]]);
    let x = lanes.mul_sub_from(c[2], b[1], lanes.mul(b[2], c[1]));
    let y = lanes.mul_sub_from(b[2], c[0], lanes.mul(c[2], b[0]));
    [constant, x, y]
}

#[inline(always)]
fn rows<L: Lanes>(
    lanes: L,
    edges: &[[L::Float; 3]; 3],
    slack: L::Float,
    first: L::Float,
    last: L::Float,
) -> FunctionRows {
    let mut rows = [[[0.0; WIDTH]; 3]; 3];
    for edge in 0..3 {
        for term in 0..3 {
            rows[edge][term] = lanes.store(edges[edge][term]);
        }
    }
    FunctionRows {
        edges: rows,
        slack: lanes.store(slack),
        first: lanes.store(first),
        last: lanes.store(last),
    }
}

impl<L: Lanes> Functions<L> {
    /// The rays that may cross the triangle of a lane, as bits.
    #[inline(always)]
    fn rays(&self, lanes: L, lane: usize, packet: &Packet) -> u32 {
        let rows = &self.rows;
        let slack = lanes.splat(rows.slack[lane]);
        let (first, last) = (lanes.splat(rows.first[lane]), lanes.splat(rows.last[lane]));
        let mut rays = 0;
        for row in 0..ROWS {
            let (x, y) = (lanes.load(&packet.rows[row].delta[0]), lanes.load(&packet.rows[row].delta[1]));
            let u = at(lanes, &rows.edges[0], lane, x, y);
            let v = at(lanes, &rows.edges[1], lane, x, y);
            let w = at(lanes, &rows.edges[2], lane, x, y);
            let least = lanes.min(lanes.min(u, v), w);
            let greatest = lanes.max(lanes.max(u, v), w);
            let inside = lanes.less_equal(lanes.splat(0.0), lanes.add(least, slack))
                | lanes.less_equal(greatest, slack);
            let mask = inside
                & lanes.less_equal(first, lanes.load(&packet.rows[row].limit))
                & lanes.less_equal(lanes.load(&packet.rows[row].near), last);
            rays |= mask << (row * WIDTH);
        }
        rays
    }
}

/// One edge function of one triangle at the slopes of eight rays: constant plus x and y terms.
#[inline(always)]
fn at<L: Lanes>(lanes: L, terms: &[Row; 3], lane: usize, x: L::Float, y: L::Float) -> L::Float {
    let [constant, by_x, by_y] = terms;
    let sum = lanes.mul_add(lanes.splat(by_x[lane]), x, lanes.splat(constant[lane]));
    lanes.mul_add(lanes.splat(by_y[lane]), y, sum)
}
