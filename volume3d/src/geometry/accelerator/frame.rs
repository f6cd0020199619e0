//! The frame of the single-precision filters: the scene centred and scaled to the cube [−1, 1]³.
//!
//! A ray enters the frame at the scene's bounds, however far away it starts, so that every filtered number is
//! of order one and rounding errors are bounded by constants. Distances become depths τ along the ray's
//! longest axis. With u = 2⁻²⁴ the rounding unit of single precision, each bound below counts the roundings
//! and rounds the count up; second-order terms u² are 10⁻⁷ of it.

use glam::DVec3;

use super::Ray;
use super::watertight::{Shear, larger, smaller};

/// Rounding unit of single precision.
pub(super) const UNIT: f64 = 1.0 / 16_777_216.0;

/// Error of a filtered plane of a box, in space along the plane's axis. The computed depth is b r − o r with
/// r = 1/d, |b| ≤ 1 and the origin |o| slightly above 1 at most: both products have the relative error u (the
/// first only if it is rounded separately), which moves the plane by u each; the common r, of relative error
/// u, and the difference each move a plane of |b − o| ≤ 2 by 2 u: together 6 u.
const PLANE_ERROR: f64 = 8.0 * UNIT;

/// Error of a sheared coordinate x − s z with |s| ≤ 1 of a vertex on the grid of its leaf, n h + (a − o) for
/// n steps of h from the anchor a, without the vertex' distance from the grid. The origin o is off by u; the
/// difference, the product n h and the sum, at most 2 each, are off by 2 u more each. So x and z are off by 7
/// u, s z by (7 + 2 + 2) u (z, s, product), and the last difference, at most 4, by 4 u more: 22 u.
pub(super) const VERTEX_ERROR: f64 = 23.0 * UNIT;

/// Error of the double-precision steps before the filter, relative to the ray's distance from the scene's
/// centre: several roundings of 2⁻⁵³ (centring, scaling, advancing, and those of the exact test).
pub(super) const DOUBLE_ERROR: f64 = 1.0 / 1_125_899_906_842_624.0;

/// Smallest slope used for a box: over a depth of 2 a ray of slope 0 deviates by 2⁻³⁹, within the slack of
/// [`PLANE_ERROR`], and no reciprocal is infinite.
pub(super) const SMALLEST_SLOPE: f64 = 1.0 / 1_099_511_627_776.0;

/// Bound on the scale and its reciprocal for which products of two areas in double precision are finite and,
/// unless far smaller than any error, above zero.
const LARGEST_SCALE: f64 = 1e75;

/// The empty interval of depths.
const NOWHERE: [f32; 2] = [f32::INFINITY, f32::NEG_INFINITY];

/// Margin of the bounds in which a ray starts, so that grazing rays are kept.
const MARGIN: f64 = UNIT;

/// The map p ↦ scale (p − centre), with scale a power of two.
#[derive(Clone, Copy, Debug)]
pub(super) struct Frame {
    pub(super) centre: DVec3,
    pub(super) scale: f64,
    /// Half extents of the scene, at most 1.
    pub(super) half: DVec3,
    /// Whether the scale is moderate, see [`LARGEST_SCALE`].
    pub(super) moderate: bool,
}

/// A ray in the frame, for the filters.
#[derive(Clone, Copy, Debug)]
pub(super) struct FrameRay {
    /// Indices of the axes that become x, y and z.
    pub(super) axes: [usize; 3],
    /// Whether the direction is negative, by axis.
    pub(super) negative: [bool; 3],
    /// By axis, depths of the near and far planes through 0, moved by the error of a plane: a plane at b is
    /// met at the depth b / d less these.
    pub(super) zero: [[f32; 2]; 3],
    /// 1 / d: depth per distance along each axis.
    pub(super) inverse: [f32; 3],
    /// 1 or −1, from the longest axis to depth.
    pub(super) forward: f32,
    /// Origin with the axes permuted.
    pub(super) vertex_origin: [f32; 3],
    /// Slopes of the first two permuted axes against depth.
    pub(super) slopes: [f32; 2],
    /// Error of a sheared coordinate.
    pub(super) vertex_error: f32,
    /// Depths of the interval, widened.
    pub(super) near: f32,
    pub(super) far: f32,
    /// The interval narrowed; empty if the exact test may overflow or underflow.
    pub(super) within: [f32; 2],
}

/// A ray in the frame with axes in their original order, and the map from distances to depths.
#[derive(Clone, Copy, Debug)]
pub(super) struct Entry {
    /// Whether the ray can meet the scene at all.
    pub(super) meets: bool,
    pub(super) depth: Depth,
    pub(super) zero: [[f32; 2]; 3],
    pub(super) inverse: [f32; 3],
    pub(super) place: [f32; 3],
    pub(super) slopes: [f32; 3],
    pub(super) vertex_error: f32,
    pub(super) near: f32,
    pub(super) far: f32,
    pub(super) within: [f32; 2],
}

/// Map from distances along a ray to depths in the frame.
#[derive(Clone, Copy, Debug)]
pub(super) struct Depth {
    pub(super) scale: f64,
    pub(super) start: f64,
    pub(super) slack: f64,
}

impl Depth {
    #[inline(always)]
    fn exact(self, distance: f64) -> f64 {
        distance * self.scale - self.start
    }

    /// A depth at least that of `distance`.
    #[inline(always)]
    pub(super) fn above(self, distance: f64) -> f32 {
        let depth = self.exact(distance);
        (depth + depth.abs() * (2.0 * UNIT) + self.slack) as f32
    }

    /// A depth at most that of `distance`; infinite if that is.
    #[inline(always)]
    pub(super) fn below(self, distance: f64) -> f32 {
        // Not +∞, which could not be subtracted from.
        let depth = smaller(self.exact(distance), f64::MAX);
        (depth - depth.abs() * (2.0 * UNIT) - self.slack) as f32
    }
}

impl Frame {
    /// The frame of a box, which may be empty.
    pub(super) fn around((lower, upper): (DVec3, DVec3)) -> Self {
        if lower.x <= upper.x { Self::new(lower, upper) } else { Self::new(DVec3::ZERO, DVec3::ZERO) }
    }

    /// The frame of the points between two corners.
    fn new(lower: DVec3, upper: DVec3) -> Self {
        let centre = 0.5 * lower + 0.5 * upper;
        let half = (upper - centre).max(centre - lower);
        let size = half.max_element();
        // The largest power of two with scale · size ≤ 1, within the exponents of doubles.
        let exponent = if size > 0.0 { -size.log2().ceil() } else { 0.0 };
        let scale = exponent.clamp(-1000.0, 1000.0).exp2();
        let moderate = (1.0 / LARGEST_SCALE..LARGEST_SCALE).contains(&scale);
        Self { centre, scale, half: scale * half, moderate }
    }

    pub(super) fn place(&self, p: DVec3) -> DVec3 {
        self.scale * (p - self.centre)
    }

    /// One coordinate of some points, in the frame.
    #[inline(always)]
    pub(super) fn placed<const N: usize>(&self, axis: usize, places: &[f64; N]) -> [f64; N] {
        let centre = self.centre.to_array()[axis];
        let mut placed = *places;
        for place in &mut placed {
            *place = self.scale * (*place - centre);
        }
        placed
    }

    /// The piece of a ray that can meet the scene, or `None`.
    #[inline(always)]
    pub(super) fn ray(&self, ray: &Ray, shear: &Shear) -> Option<(FrameRay, Depth)> {
        let (origin, direction) = (ray.origin.to_array(), ray.direction.to_array());
        let entry = self.entry(origin, direction, (ray.near, ray.far));
        let frame_ray = FrameRay::new(&entry, shear.axes, shear.slopes[2].is_sign_negative());
        entry.meets.then_some((frame_ray, entry.depth))
    }

    /// Entry of a ray of finite origin and direction into the scene. Branchless, so that loops over rays
    /// vectorise.
    #[inline(always)]
    pub(super) fn entry(&self, origin: [f64; 3], direction: [f64; 3], (near, far): (f64, f64)) -> Entry {
        let (centre, half) = (self.centre.to_array(), self.half.to_array());
        let longest = larger(larger(direction[0].abs(), direction[1].abs()), direction[2].abs());
        // Scaled to length 1 along the longest axis, up to rounding; the scale is a power of two, which
        // rounds nothing.
        let shorten = 1.0 / longest;
        let scale = self.scale * longest;
        let (mut places, mut slopes) = ([0.0; 3], [0.0; 3]);
        for axis in 0..3 {
            places[axis] = self.scale * (origin[axis] - centre[axis]);
            slopes[axis] = direction[axis] * shorten;
        }
        let reach = larger(larger(places[0].abs(), places[1].abs()), places[2].abs());
        let error = DOUBLE_ERROR * (1.0 + reach);

        // Range in which the line is inside the bounds.
        let around = MARGIN + error + reach * SMALLEST_SLOPE;
        let mut inverse = [0.0; 3];
        let mut enter = near * scale - error;
        let mut leave = far * scale + error;
        for axis in 0..3 {
            inverse[axis] = 1.0 / steep(slopes[axis]);
            let wide = half[axis] + around;
            let (a, b) = ((-wide - places[axis]) * inverse[axis], (wide - places[axis]) * inverse[axis]);
            enter = larger(enter, smaller(a, b));
            leave = smaller(leave, larger(a, b));
        }

        let depth = Depth { scale, start: enter, slack: UNIT * UNIT + 4.0 * error };
        // The slack of depths is within the margin, so that boxes count from depth 0.
        let margin = PLANE_ERROR + 8.0 * error;
        let mut entry = Entry {
            meets: (enter <= leave) & (near < far),
            depth,
            zero: [[0.0; 2]; 3],
            inverse: [0.0; 3],
            place: [0.0; 3],
            slopes: [0.0; 3],
            vertex_error: (VERTEX_ERROR + 4.0 * error) as f32,
            near: depth.below(near),
            far: depth.above(far),
            within: if self.moderate { [depth.above(near), depth.below(far)] } else { NOWHERE },
        };
        for axis in 0..3 {
            let start = places[axis] + enter * slopes[axis];
            entry.place[axis] = start as f32;
            entry.slopes[axis] = slopes[axis] as f32;
            entry.inverse[axis] = inverse[axis] as f32;
            let inverse = f64::from(entry.inverse[axis]);
            let margin = margin * inverse.abs();
            entry.zero[axis] = [(start * inverse + margin) as f32, (start * inverse - margin) as f32];
        }
        entry
    }
}

impl FrameRay {
    /// From an entry, with permuted axes, and whether the ray is opposite to the longest one.
    #[inline(always)]
    pub(super) fn new(entry: &Entry, axes: [usize; 3], backward: bool) -> Self {
        let &Entry { zero, inverse, place, slopes, vertex_error, near, far, within, .. } = entry;
        let [x, y, z] = axes;
        Self {
            axes,
            negative: [inverse[0] < 0.0, inverse[1] < 0.0, inverse[2] < 0.0],
            zero,
            inverse,
            vertex_origin: [place[x], place[y], place[z]],
            forward: if backward { -1.0 } else { 1.0 },
            slopes: [slopes[x], slopes[y]],
            vertex_error,
            near,
            far,
            within,
        }
    }
}

/// A slope that has a reciprocal.
#[inline(always)]
fn steep(slope: f64) -> f64 {
    if slope.abs() < SMALLEST_SLOPE { SMALLEST_SLOPE.copysign(slope) } else { slope }
}
