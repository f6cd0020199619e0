//! Filters of single rays: eight boxes, and eight triangles.

use super::frame::FrameRay;
use super::frame_rays::FrameRays;
use super::tree::{Leaf, Node};
use super::watertight::PERMUTATIONS;
use crate::lanes::{Lanes, Row, Steps};

/// A ray against eight boxes: slabs, with error bounds in the depths of zero (see the frame).
pub(super) struct BoxTest<L: Lanes> {
    lanes: L,
    negative: [bool; 3],
    /// By axis, for the near plane and the far plane.
    zero: [[L::Float; 2]; 3],
    inverse: [L::Float; 3],
    /// Depth 0, where the ray enters the scene.
    near: L::Float,
}

impl<L: Lanes> BoxTest<L> {
    #[inline(always)]
    pub(super) fn new(lanes: L, ray: &FrameRay) -> Self {
        let mut zero = [[lanes.splat(0.0); 2]; 3];
        let mut inverse = [lanes.splat(0.0); 3];
        for axis in 0..3 {
            zero[axis] = [lanes.splat(ray.zero[axis][0]), lanes.splat(ray.zero[axis][1])];
            inverse[axis] = lanes.splat(ray.inverse[axis]);
        }
        Self { lanes, negative: ray.negative, zero, inverse, near: lanes.splat(0.0) }
    }

    /// The test of one ray of [`FrameRays`].
    #[inline(always)]
    pub(super) fn beside(lanes: L, rays: &FrameRays, at: usize) -> Self {
        let mut zero = [[lanes.splat(0.0); 2]; 3];
        let mut inverse = [lanes.splat(0.0); 3];
        let mut negative = [false; 3];
        for axis in 0..3 {
            zero[axis] = [lanes.splat(rays.zero[axis][0][at]), lanes.splat(rays.zero[axis][1][at])];
            inverse[axis] = lanes.splat(rays.inverse[axis][at]);
            negative[axis] = rays.negative[axis][at] != 0;
        }
        Self { lanes, negative, zero, inverse, near: lanes.splat(0.0) }
    }

    /// Boxes entered no deeper than `limit`, and their entry depths.
    #[inline(always)]
    pub(super) fn entered(&self, node: &Node, limit: f32) -> (u32, Row) {
        let lanes = self.lanes;
        let mut enter = self.near;
        let mut leave = lanes.splat(limit);
        for axis in 0..3 {
            let negative = self.negative[axis];
            let near = lanes.load(&node.planes[axis][usize::from(negative)]);
            let far = lanes.load(&node.planes[axis][usize::from(!negative)]);
            let [near_zero, far_zero] = self.zero[axis];
            enter = lanes.max(enter, lanes.mul_sub(near, self.inverse[axis], near_zero));
            leave = lanes.min(leave, lanes.mul_sub(far, self.inverse[axis], far_zero));
        }
        (lanes.less_equal(enter, leave), lanes.store(enter))
    }
}

/// A ray against eight triangles: keeps all that the exact test would accept, and few others.
pub(super) struct TriangleTest<L: Lanes> {
    lanes: L,
    axes: [usize; 3],
    /// 1 or −1, from the last axis to depth.
    forward: L::Float,
    origin: [L::Float; 3],
    /// Slopes against depth.
    slopes: [L::Float; 2],
    near: L::Float,
    /// Depths of the interval, narrowed.
    within: [L::Float; 2],
    /// Error of a sheared coordinate, without that of the grid.
    error: f32,
}

/// Result of the filter for eight triangles.
#[derive(Clone, Copy)]
pub(super) struct Filtered<L: Lanes> {
    /// Bit mask of triangles that the exact test may accept.
    pub(super) candidates: u32,
    /// Extremes of the edge functions, and their error.
    least: L::Float,
    greatest: L::Float,
    slack: L::Float,
    /// Depths, widened by their error.
    first: L::Float,
    last: L::Float,
}

/// Error of an edge function c_x b_y − c_y b_x of sheared coordinates off by e, divided by e times the sum of
/// |x| + |y| over all three vertices: the errors of the factors contribute e
/// (|b_x| + |b_y| + |c_x| + |c_y|) + 2 e². The roundings of two products and a difference contribute 2 u
/// (|c_x b_y| + |c_y b_x|) with all coordinates below 4, so 8 u (|b_x| + |b_y|) or less than half of e. The
/// computed coordinates may be smaller than the true ones by e each, which is within the absolute term of
/// [`EDGE_FLOOR`].
const EDGE_SHARE: f32 = 1.5;

/// Second-order terms of that bound, divided by e²: 2, and 1.5 for each of 6 coordinates.
const EDGE_FLOOR: f32 = 12.0;

impl<L: Lanes> TriangleTest<L> {
    #[inline(always)]
    pub(super) fn new(lanes: L, ray: &FrameRay) -> Self {
        let [x, y, z] = ray.vertex_origin;
        Self {
            lanes,
            axes: ray.axes,
            forward: lanes.splat(ray.forward),
            origin: [lanes.splat(x), lanes.splat(y), lanes.splat(z)],
            slopes: [lanes.splat(ray.slopes[0]), lanes.splat(ray.slopes[1])],
            near: lanes.splat(ray.near),
            within: [lanes.splat(ray.within[0]), lanes.splat(ray.within[1])],
            error: ray.vertex_error,
        }
    }

    /// The test of one ray of [`FrameRays`].
    #[inline(always)]
    pub(super) fn beside(lanes: L, rays: &FrameRays, at: usize) -> Self {
        let axes = PERMUTATIONS[usize::from(rays.along[at]) % 3];
        let [x, y, z] = axes;
        let backward = rays.negative[z][at] != 0;
        Self {
            lanes,
            axes,
            forward: lanes.splat(if backward { -1.0 } else { 1.0 }),
            origin: axes.map(|axis| lanes.splat(rays.place[axis][at])),
            slopes: [lanes.splat(rays.slopes[x][at]), lanes.splat(rays.slopes[y][at])],
            near: lanes.splat(rays.near[at]),
            within: rays.within.map(|depth| lanes.splat(depth[at])),
            error: rays.vertex_error[at],
        }
    }

    #[inline(always)]
    pub(super) fn filtered(&self, leaf: &Leaf, limit: f32) -> Filtered<L> {
        let lanes = self.lanes;
        let [a, b, c] = &leaf.vertices;
        let grid = Grid::new(lanes, leaf, self.axes, self.origin);
        let (a, b, c) = (self.sheared(&grid, a), self.sheared(&grid, b), self.sheared(&grid, c));
        let (u, v, w) = (edge(lanes, c, b), edge(lanes, a, c), edge(lanes, b, a));
        let error = self.error + leaf.step;
        let slack = lanes.mul_add(
            lanes.splat(EDGE_SHARE * error),
            lanes.add(lanes.add(size(lanes, a), size(lanes, b)), size(lanes, c)),
            lanes.splat(EDGE_FLOOR * error * error),
        );
        let zero = lanes.splat(0.0);
        let least = lanes.min(lanes.min(u, v), w);
        let greatest = lanes.max(lanes.max(u, v), w);
        let inside = lanes.less_equal(zero, lanes.add(least, slack)) | lanes.less_equal(greatest, slack);
        // A crossing lies between the depths of the vertices.
        let error = lanes.splat(error);
        let first = lanes.sub(lanes.min(lanes.min(a[2], b[2]), c[2]), error);
        let last = lanes.add(lanes.max(lanes.max(a[2], b[2]), c[2]), error);
        let candidates =
            inside & lanes.less_equal(first, lanes.splat(limit)) & lanes.less_equal(self.near, last);
        Filtered { candidates, least, greatest, slack, first, last }
    }

    /// Triangles that the exact test certainly accepts, at a distance within the ray: those whose edge
    /// functions differ from zero by more than their error, and whose three vertices lie within the interval.
    #[inline(always)]
    pub(super) fn certain(&self, filtered: &Filtered<L>) -> u32 {
        let lanes = self.lanes;
        let Filtered { least, greatest, slack, first, last, .. } = *filtered;
        let inside =
            lanes.less_equal(slack, least) | lanes.less_equal(greatest, lanes.sub(lanes.splat(0.0), slack));
        inside & lanes.less_equal(self.within[0], first) & lanes.less_equal(last, self.within[1])
    }

    #[inline(always)]
    fn sheared(&self, grid: &Grid<L>, vertex: &[Steps; 3]) -> [L::Float; 3] {
        let lanes = self.lanes;
        let [x, y, z] = grid.relative(lanes, vertex);
        let z = lanes.mul(z, self.forward);
        [lanes.mul_sub_from(self.slopes[0], z, x), lanes.mul_sub_from(self.slopes[1], z, y), z]
    }
}

/// The grid of a leaf relative to a ray. Half a step along its own axis and, with slopes of at most 1, half a
/// step in depth put a sheared coordinate off by at most one step.
pub(super) struct Grid<L: Lanes> {
    axes: [usize; 3],
    /// Relative to the origin, axes permuted.
    anchor: [L::Float; 3],
    step: L::Float,
}

impl<L: Lanes> Grid<L> {
    #[inline(always)]
    pub(super) fn new(lanes: L, leaf: &Leaf, axes: [usize; 3], origin: [L::Float; 3]) -> Self {
        let [x, y, z] = axes;
        let anchor = &leaf.anchor;
        let anchor = [
            lanes.sub(lanes.splat(anchor[x]), origin[0]),
            lanes.sub(lanes.splat(anchor[y]), origin[1]),
            lanes.sub(lanes.splat(anchor[z]), origin[2]),
        ];
        Self { axes, anchor, step: lanes.splat(leaf.step) }
    }

    /// Vertices relative to the origin, axes permuted.
    #[inline(always)]
    pub(super) fn relative(&self, lanes: L, vertex: &[Steps; 3]) -> [L::Float; 3] {
        let [x, y, z] = self.axes;
        [
            lanes.mul_add(lanes.load_steps(&vertex[x]), self.step, self.anchor[0]),
            lanes.mul_add(lanes.load_steps(&vertex[y]), self.step, self.anchor[1]),
            lanes.mul_add(lanes.load_steps(&vertex[z]), self.step, self.anchor[2]),
        ]
    }
}

/// c_x b_y − c_y b_x.
#[inline(always)]
pub(super) fn edge<L: Lanes>(lanes: L, c: [L::Float; 3], b: [L::Float; 3]) -> L::Float {
    lanes.mul_sub_from(c[1], b[0], lanes.mul(c[0], b[1]))
}

/// |x| + |y|.
#[inline(always)]
pub(super) fn size<L: Lanes>(lanes: L, p: [L::Float; 3]) -> L::Float {
    lanes.add(lanes.abs(p[0]), lanes.abs(p[1]))
}
