//! Filters of fans: boxes and triangles.
//!
//! With depth ζ from the common origin along the longest axis, ray r has the slopes S_r = S + δ_r times ζ,
//! where S is the fan's middle. Boxes are intersected with the interval of slopes. For triangles, vertices
//! are sheared by S; for ray r the sheared coordinates are x − δ_r ζ, and each edge function becomes linear
//! in δ_r:
//!
//! > c_x b_y − c_y b_x − δ_x (ζ_c b_y − ζ_b c_y) − δ_y (ζ_b c_x − ζ_c b_x).
//!
//! Eight triangles are first tested against the whole fan, and each that remains against eight rays at a
//! time.

use super::fan::{Fan, FanAxis};
use super::frame::UNIT;
use super::ray_filter::{Grid, edge, size};
use super::tree::{Leaf, Node};
use super::watertight::{PACKET, ShearRow};
use crate::lanes::{Lanes, Row, Steps, WIDTH};

/// Error of an edge function of ray r for a triangle that it crosses, divided by e P: with the triangle's
/// vertices at p = x − δ ζ, P is the sum of |p_x| + |p_y| over its sides, at most that of the sheared ones
/// plus 4 times the half width of the fan times the extent in depth. The ray's coordinates p are off by e and
/// the roundings of δ and ζ, at most 1.5 e. If the ray is within the triangle, those of a vertex are at most
/// the longest side, which is half of P: an edge function is off by 1.5 e P plus second-order terms. The
/// converse holds too: if computed edge functions exceed this, the ray is within the triangle of computed
/// vertices, and coordinates are as small.
const EDGE_SHARE: f32 = 2.0;

/// Second-order terms, divided by e²: 2 · 1.5², and 1.5 for each of 8 coordinates computed too small by e,
/// and for an extent in depth that is: 1.44 e at the widths that occur.
const EDGE_FLOOR: f32 = 20.0;

/// Contribution of rounding, divided by (m + F)², with m the greatest |x| + |y| of a vertex and F the
/// greatest |δ ζ|: the constant term is off by 3 u m², the factors of δ by 8 u F m, and their sum by 6 u
/// m² + 12 u F m: at most 10 u (m + F)². The rest is for the roundings of bounds.
const EDGE_ROUNDING: f32 = 16.0 * UNIT as f32;

/// A fan against eight boxes.
pub(super) struct BoxTest<L: Lanes> {
    lanes: L,
    /// The two transverse axes, and the longest one.
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
    pub(super) fn new(lanes: L, fan: &Fan) -> Self {
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

    /// Boxes that some ray may enter no deeper than `limit`, and lower bounds on the entry depths.
    #[inline(always)]
    pub(super) fn entered(&self, node: &Node, limit: f32) -> (u32, Row) {
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
pub(super) struct TriangleTest<L: Lanes> {
    lanes: L,
    axes: [usize; 3],
    /// 1 or −1, from the longest axis to depth.
    forward: L::Float,
    origin: [L::Float; 3],
    slopes: [L::Float; 2],
    /// Half widths of the fan.
    spread: [L::Float; 2],
    /// Map from depth to ζ.
    opening: L::Float,
    farness: L::Float,
    /// The greater half width.
    width: f32,
    error: f32,
}

/// Edge functions of eight triangles, as functions of the slopes.
pub(super) struct Functions<L: Lanes> {
    /// By edge: constant, and the factors of δ_x and δ_y.
    edges: [[L::Float; 3]; 3],
    slack: L::Float,
    rows: FunctionRows,
}

/// [`Functions`] in memory, to broadcast one triangle to lanes of rays.
struct FunctionRows {
    edges: [[Row; 3]; 3],
    slack: Row,
    first: Row,
    last: Row,
}

impl<L: Lanes> TriangleTest<L> {
    #[inline(always)]
    pub(super) fn new(lanes: L, fan: &Fan) -> Self {
        let [x, y, z] = fan.vertex_origin;
        let [across_x, across_y] = fan.axes;
        Self {
            lanes,
            axes: [across_x.axis, across_y.axis, fan.along],
            forward: lanes.splat(if fan.backward { -1.0 } else { 1.0 }),
            origin: [lanes.splat(x), lanes.splat(y), lanes.splat(z)],
            slopes: [lanes.splat(across_x.slope as f32), lanes.splat(across_y.slope as f32)],
            spread: [lanes.splat(across_x.spread), lanes.splat(across_y.spread)],
            opening: lanes.splat(fan.opening),
            farness: lanes.splat(fan.farness),
            width: across_x.spread.max(across_y.spread),
            error: fan.vertex_error,
        }
    }

    /// x, y, ζ along the ray's sign, and the depth from where the fan enters the scene.
    #[inline(always)]
    fn sheared(&self, grid: &Grid<L>, vertex: &[Steps; 3]) -> [L::Float; 4] {
        let lanes = self.lanes;
        let [x, y, z] = grid.relative(lanes, vertex);
        let x = lanes.mul_sub_from(self.slopes[0], z, x);
        let y = lanes.mul_sub_from(self.slopes[1], z, y);
        [x, y, lanes.mul_add(z, self.opening, self.farness), z]
    }

    #[inline(always)]
    pub(super) fn functions(&self, leaf: &Leaf) -> Functions<L> {
        let lanes = self.lanes;
        let [a, b, c] = &leaf.vertices;
        let grid = Grid::new(lanes, leaf, self.axes, self.origin);
        let (a, b, c) = (self.sheared(&grid, a), self.sheared(&grid, b), self.sheared(&grid, c));
        let error = self.error + leaf.step;
        let least = lanes.min(lanes.min(a[3], b[3]), c[3]);
        let greatest = lanes.max(lanes.max(a[3], b[3]), c[3]);
        let sides = lanes.add(lanes.add(side(lanes, a, b), side(lanes, b, c)), side(lanes, c, a));
        let sides = lanes.mul_add(lanes.sub(greatest, least), lanes.splat(4.0 * self.width), sides);
        let farthest = lanes.max(lanes.max(lanes.abs(a[2]), lanes.abs(b[2])), lanes.abs(c[2]));
        let size = lanes.max(lanes.max(planar_size(lanes, a), planar_size(lanes, b)), planar_size(lanes, c));
        let reach = lanes.mul_add(farthest, lanes.splat(self.width), size);
        let slack = lanes.mul_add(
            lanes.splat(EDGE_SHARE * error),
            sides,
            lanes.mul_add(
                lanes.mul(reach, lanes.splat(EDGE_ROUNDING)),
                reach,
                lanes.splat(EDGE_FLOOR * error * error),
            ),
        );
        let depths =
            [lanes.mul(a[3], self.forward), lanes.mul(b[3], self.forward), lanes.mul(c[3], self.forward)];
        let first = lanes.sub(lanes.min(lanes.min(depths[0], depths[1]), depths[2]), lanes.splat(error));
        let last = lanes.add(lanes.max(lanes.max(depths[0], depths[1]), depths[2]), lanes.splat(error));
        let edges = [coefficients(lanes, c, b), coefficients(lanes, a, c), coefficients(lanes, b, a)];
        Functions { edges, slack, rows: rows(lanes, &edges, slack, first, last) }
    }

    /// Triangles that some ray of the fan may cross.
    #[inline(always)]
    pub(super) fn candidates(&self, functions: &Functions<L>) -> u32 {
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

/// |Δx| + |Δy|.
#[inline(always)]
fn side<L: Lanes>(lanes: L, p: [L::Float; 4], q: [L::Float; 4]) -> L::Float {
    lanes.add(lanes.abs(lanes.sub(p[0], q[0])), lanes.abs(lanes.sub(p[1], q[1])))
}

#[inline(always)]
fn planar_size<L: Lanes>(lanes: L, p: [L::Float; 4]) -> L::Float {
    size(lanes, [p[0], p[1], p[2]])
}

/// Constant and factors of an edge function.
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
    /// The triangle of a lane against the rays of a row.
    #[inline(always)]
    pub(super) fn met(&self, lanes: L, lane: usize, row: &FanRow) -> Met<L> {
        let rows = &self.rows;
        let slack = lanes.splat(rows.slack[lane]);
        let (first, last) = (lanes.splat(rows.first[lane]), lanes.splat(rows.last[lane]));
        let (x, y) = (lanes.load(&row.delta[0]), lanes.load(&row.delta[1]));
        let u = at(lanes, &rows.edges[0], lane, x, y);
        let v = at(lanes, &rows.edges[1], lane, x, y);
        let w = at(lanes, &rows.edges[2], lane, x, y);
        let least = lanes.min(lanes.min(u, v), w);
        let greatest = lanes.max(lanes.max(u, v), w);
        let inside =
            lanes.less_equal(lanes.splat(0.0), lanes.add(least, slack)) | lanes.less_equal(greatest, slack);
        let rays = inside
            & lanes.less_equal(first, lanes.load(&row.limit))
            & lanes.less_equal(lanes.load(&row.near), last);
        Met { rays, least, greatest, slack, first, last }
    }
}

/// Test of a triangle against a row of rays.
pub(super) struct Met<L: Lanes> {
    /// Bit mask of rays that may cross it.
    pub(super) rays: u32,
    least: L::Float,
    greatest: L::Float,
    slack: L::Float,
    first: L::Float,
    last: L::Float,
}

impl<L: Lanes> Met<L> {
    /// Rays that certainly cross it within these depths, as for [single rays](super::traverse).
    #[inline(always)]
    pub(super) fn certain(&self, lanes: L, within: [&Row; 2]) -> u32 {
        let inside = lanes.less_equal(self.slack, self.least)
            | lanes.less_equal(self.greatest, lanes.sub(lanes.splat(0.0), self.slack));
        inside
            & lanes.less_equal(lanes.load(within[0]), self.first)
            & lanes.less_equal(self.last, lanes.load(within[1]))
    }
}

/// Eight rays of a fan.
#[derive(Clone, Copy)]
pub(super) struct FanRow {
    /// Slopes relative to the fan's middle.
    delta: [Row; 2],
    /// Interval of depths, empty for lanes without a ray.
    pub(super) near: Row,
    pub(super) limit: Row,
}

impl FanRow {
    /// A row with no active depth interval.
    #[inline(always)]
    pub(super) fn new(fan: &Fan, shears: &ShearRow) -> Self {
        let (mut x, mut y) = ([0.0; WIDTH], [0.0; WIDTH]);
        for lane in 0..WIDTH {
            x[lane] = (shears.x[lane] - fan.axes[0].slope) as f32;
            y[lane] = (shears.y[lane] - fan.axes[1].slope) as f32;
        }
        let delta = [x, y];
        Self { delta, near: [f32::INFINITY; WIDTH], limit: [f32::NEG_INFINITY; WIDTH] }
    }

    /// Sets, for rays of one direction, the offsets of their origins from the fan's middle, starting at an
    /// index.
    #[inline(always)]
    pub(super) fn set_offsets(&mut self, offsets: &[[f64; PACKET]; 2], first: usize) {
        for lane in 0..WIDTH {
            self.delta[0][lane] = offsets[0][first + lane] as f32;
            self.delta[1][lane] = offsets[1][first + lane] as f32;
        }
    }

    /// Greatest depth at which any ray still looks for a hit.
    #[inline(always)]
    pub(super) fn greatest_limit(&self) -> f32 {
        let mut greatest = f32::NEG_INFINITY;
        for &limit in &self.limit {
            greatest = if limit > greatest { limit } else { greatest };
        }
        greatest
    }
}

/// One edge function of one triangle at the slopes of eight rays: constant plus x and y terms.
#[inline(always)]
fn at<L: Lanes>(lanes: L, terms: &[Row; 3], lane: usize, x: L::Float, y: L::Float) -> L::Float {
    let [constant, by_x, by_y] = terms;
    let sum = lanes.mul_add(lanes.splat(by_x[lane]), x, lanes.splat(constant[lane]));
    lanes.mul_add(lanes.splat(by_y[lane]), y, sum)
}
