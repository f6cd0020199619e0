//! Up to sixteen rays with one origin, one longest axis and similar slopes, through the hierarchy at once.
//!
//! With depth ζ from the common origin along the longest axis, ray r is at the slopes S_r = S + δ_r times ζ,
//! where S is the fan's middle. Boxes are met by the interval of slopes. For triangles, vertices are sheared by
//! S; for ray r the sheared coordinates are x − δ_r ζ, and each edge function becomes linear in δ_r:
//!
//! c_x b_y − c_y b_x − δ_x (ζ_c b_y − ζ_b c_y) − δ_y (ζ_b c_x − ζ_c b_x).
//!
//! So eight triangles are first tried against the whole fan, and each that remains against eight rays at a time.

use super::bundle::Limits;
use super::frame::{Depth, Fan, FanAxis};
use super::lanes::{Lanes, Row, Task, WIDTH, next};
use super::traverse::{PENDING, Pending, Stack, edge, size};
use super::tree::{Leaf, Link, Node, Tree, Triangle};
use super::watertight::{Crossing, Shear};
use super::{Accelerator, Hit};

/// Rays of a packet: two rows of lanes.
pub(super) const PACKET: usize = ROWS * WIDTH;
const ROWS: usize = 2;

/// Error of an edge function of ray r, over e times the sum of |x| + |y| over the vertices and of 6 F, where F ≤ 1
/// bounds |δ ζ|. The ray's coordinates x − δ ζ are below x + F and off by e + 4 u F (roundings of δ and ζ), at most
/// 1.25 e. Roundings: products of the first difference and the sum, of coordinates at most 5, 20 u; those
/// of the terms in δ, 6 u F. Together at most 1.25 e + 26 u < 2.6 e, as e ≥ 20 u.
const EDGE_SHARE: f32 = 3.0;

/// The terms of second order, over e²: 2 · 1.25², and 3 for each of 6 coordinates computed too small by e.
const EDGE_FLOOR: f32 = 24.0;

/// The best of every ray so far.
pub(super) struct Packet {
    /// Slopes against the fan's middle, and the interval of depths, in which nothing lies for lanes without a ray.
    delta: [[Row; 2]; ROWS],
    near: [Row; ROWS],
    limit: [Row; ROWS],
    depths: [Depth; PACKET],
    distance: [f64; PACKET],
    triangle: [u32; PACKET],
    crossing: [Option<Crossing>; PACKET],
}

impl Packet {
    #[inline(always)]
    pub(super) fn new(fan: &Fan, shears: &[Shear; PACKET], members: u32, limits: &Limits) -> Self {
        let mut packet = Self {
            delta: [[[0.0; WIDTH]; 2]; ROWS],
            near: [[f32::INFINITY; WIDTH]; ROWS],
            limit: [[f32::NEG_INFINITY; WIDTH]; ROWS],
            depths: [fan.depth(&shears[0]); PACKET],
            distance: [limits.far; PACKET],
            triangle: [0; PACKET],
            crossing: [None; PACKET],
        };
        let mut rest = members;
        while rest != 0 {
            let ray = next(&mut rest);
            let (row, lane) = (ray / WIDTH, ray % WIDTH);
            let depth = fan.depth(&shears[ray]);
            for axis in 0..2 {
                packet.delta[row][axis][lane] = (shears[ray].slopes[axis] - fan.axes[axis].slope) as f32;
            }
            packet.near[row][lane] = depth.below(limits.near);
            packet.limit[row][lane] = depth.above(limits.far);
            packet.depths[ray] = depth;
        }
        packet
    }

    pub(super) fn write(&self, members: u32, hits: &mut [Option<Hit>]) {
        let mut rest = members;
        while rest != 0 {
            let ray = next(&mut rest);
            hits[ray] = self.crossing[ray].map(|crossing| Hit {
                triangle: self.triangle[ray],
                distance: crossing.distance,
                barycentric: crossing.barycentric(),
            });
        }
    }

    /// The greatest depth at which any ray still looks for a hit.
    #[inline(always)]
    fn greatest_limit(&self) -> f32 {
        let mut greatest = f32::NEG_INFINITY;
        for row in &self.limit {
            for &limit in row {
                greatest = if limit > greatest { limit } else { greatest };
            }
        }
        greatest
    }

    /// Takes a crossing if it is ray `ray`'s best so far.
    #[inline(always)]
    fn take(&mut self, ray: usize, triangle: u32, crossing: Crossing, near: f64) -> bool {
        let distance = crossing.distance;
        let tie =
            self.crossing[ray].is_some() && distance == self.distance[ray] && triangle < self.triangle[ray];
        let better = (distance < self.distance[ray] || tie) && distance > near;
        if better {
            self.distance[ray] = distance;
            self.triangle[ray] = triangle;
            self.crossing[ray] = Some(crossing);
            self.limit[ray / WIDTH][ray % WIDTH] = self.depths[ray].above(distance);
        }
        better
    }
}

/// A packet through the whole tree.
pub(super) struct PacketTraversal<'a> {
    pub(super) accelerator: &'a Accelerator,
    pub(super) fan: &'a Fan,
    pub(super) shears: &'a [Shear; PACKET],
    pub(super) limits: &'a Limits,
    pub(super) packet: &'a mut Packet,
}

impl Task for PacketTraversal<'_> {
    type Output = ();

    #[inline(always)]
    fn run<L: Lanes>(self, lanes: L) {
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
    fn descend<L: Lanes>(self, lanes: L, entries: &mut [Pending]) {
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
                    link = stack.descend(node, mask, &depths);
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
                    closer |=
                        decide(tree, self.shears, self.limits, self.packet, &leaf.triangles[lane], rays);
                }
            }
            if closer {
                limit = self.fan.whole_depth(self.packet.greatest_limit());
            }
            let Some(pending) = stack.pop(limit) else { return };
            link = pending;
        }
    }
}

/// The exact test of a triangle with each ray of a mask; whether any of them came closer.
#[inline(always)]
fn decide(
    tree: &Tree,
    shears: &[Shear; PACKET],
    limits: &Limits,
    packet: &mut Packet,
    triangle: &Triangle,
    mut rays: u32,
) -> bool {
    if limits.from == Some(triangle.index) {
        return false;
    }
    // The origin and the axes are those of all rays.
    let relative = shears[rays.trailing_zeros() as usize % PACKET].relative(tree.corners(triangle));
    let mut closer = false;
    while rays != 0 {
        let ray = next(&mut rays) % PACKET;
        if let Some(crossing) = shears[ray].cross(&relative) {
            closer |= packet.take(ray, triangle.index, crossing, limits.near);
        }
    }
    closer
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
        let lower = lanes.sub(lanes.load(&node.planes[axis][0]), self.origins[axis][0]);
        let upper = lanes.sub(lanes.load(&node.planes[axis][1]), self.origins[axis][1]);
        if negative { [upper, lower] } else { [lower, upper] }
    }
}

/// A fan against eight triangles.
struct TriangleTest<L: Lanes> {
    lanes: L,
    axes: [usize; 3],
    backward: bool,
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
            backward: fan.backward,
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
    fn sheared(&self, vertex: &[Row; 3]) -> [L::Float; 4] {
        let lanes = self.lanes;
        let [x, y, z] = self.axes;
        let x = lanes.sub(lanes.load(&vertex[x]), self.origin[0]);
        let y = lanes.sub(lanes.load(&vertex[y]), self.origin[1]);
        let z = lanes.sub(lanes.load(&vertex[z]), self.origin[2]);
        let x = lanes.mul_sub_from(self.slopes[0], z, x);
        let y = lanes.mul_sub_from(self.slopes[1], z, y);
        [x, y, lanes.add(z, self.start), z]
    }

    #[inline(always)]
    fn functions(&self, leaf: &Leaf) -> Functions<L> {
        let lanes = self.lanes;
        let [a, b, c] = &leaf.vertices;
        let (a, b, c) = (self.sheared(a), self.sheared(b), self.sheared(c));
        let sizes = lanes.add(lanes.add(planar_size(lanes, a), planar_size(lanes, b)), planar_size(lanes, c));
        let error = self.error;
        let slack = lanes.mul_add(
            lanes.splat(EDGE_SHARE * error),
            lanes.add(sizes, lanes.splat(6.0 * self.footprint)),
            lanes.splat(EDGE_FLOOR * error * error),
        );
        let (mut first, mut last) =
            (lanes.min(lanes.min(a[3], b[3]), c[3]), lanes.max(lanes.max(a[3], b[3]), c[3]));
        if self.backward {
            (first, last) = (lanes.sub(lanes.splat(0.0), last), lanes.sub(lanes.splat(0.0), first));
        }
        first = lanes.sub(first, lanes.splat(error));
        last = lanes.add(last, lanes.splat(error));
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
            let (x, y) = (lanes.load(&packet.delta[row][0]), lanes.load(&packet.delta[row][1]));
            let u = at(lanes, &rows.edges[0], lane, x, y);
            let v = at(lanes, &rows.edges[1], lane, x, y);
            let w = at(lanes, &rows.edges[2], lane, x, y);
            let least = lanes.min(lanes.min(u, v), w);
            let greatest = lanes.max(lanes.max(u, v), w);
            let inside = lanes.less_equal(lanes.splat(0.0), lanes.add(least, slack))
                | lanes.less_equal(greatest, slack);
            let mask = inside
                & lanes.less_equal(first, lanes.load(&packet.limit[row]))
                & lanes.less_equal(lanes.load(&packet.near[row]), last);
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
