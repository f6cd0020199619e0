//! Fans: rays with one longest axis that share either an origin and similar slopes, or a direction.

use glam::DVec3;

use super::frame::{DOUBLE_ERROR, Depth, Frame, SMALLEST_SLOPE, UNIT};
use super::watertight::{PACKET, Shears, larger, smaller};
use crate::lanes::WIDTH;

/// Rays with one longest axis and sign, in the form of the filters; with one origin, or one direction.
#[derive(Clone, Copy, Debug)]
pub(super) struct Fan {
    /// The two transverse axes, in the order of the permutation.
    pub(super) axes: [FanAxis; 2],
    /// The longest axis, and whether the rays are opposite to it.
    pub(super) along: usize,
    pub(super) backward: bool,
    /// Origin, or corners of the box of all origins, plus and minus the error of a plane.
    pub(super) origin_high: [f32; 3],
    pub(super) origin_low: [f32; 3],
    /// Point where the middle ray enters the scene, axes permuted.
    pub(super) vertex_origin: [f32; 3],
    /// Its position along the longest axis, from the origin.
    pub(super) start: f64,
    /// ζ is `opening` times the depth from there, plus [`farness`](Self::farness); constantly 1 for rays of
    /// one direction, whose spacing does not change.
    pub(super) opening: f32,
    pub(super) farness: f32,
    /// Whether hits may be accepted as certain, see [`Frame`].
    pub(super) is_moderate: bool,
    /// For rays of one direction, the plane where depths start, in the frame and in space.
    plane: Option<f64>,
    centre: f64,
    middle: [f64; 2],
    /// Error of a coordinate sheared along the middle ray.
    pub(super) vertex_error: f32,
    scale: f64,
    slack: f64,
}

/// Slopes of a fan along one axis.
#[derive(Clone, Copy, Debug)]
pub(super) struct FanAxis {
    pub(super) axis: usize,
    /// Middle and half width.
    pub(super) slope: f64,
    pub(super) spread: f32,
    /// Whether the slopes against depth, whose extreme reciprocals follow, are negative or of both signs.
    pub(super) negative: bool,
    pub(super) straddles: bool,
    pub(super) inverse: [f32; 2],
}

/// Error of a vertex sheared along the middle ray: as for a single ray with the origin below 2, off by 2 u,
/// and differences to it of at most 3. x and z are off by (2 + 3 + 2 + 3) u, s z by at most (10 + 3 + 3) u,
/// and the last difference, at most 6, by 6 u: 32 u.
const FAN_VERTEX_ERROR: f64 = 33.0 * UNIT;

/// Distance of the origin from the scene's centre above which rays are traced individually: boxes are
/// intersected from the fan's origin itself, with an error proportional to its distance.
const FARTHEST_FAN: f64 = 256.0;

/// Upper bound on the depth of the scene from where rays enter it.
const DEEPEST: f64 = 2.5;

/// Width of a fan above which rays are traced individually: |δ ζ| must be below 1, with room for rounding,
/// for the error bounds of the triangle filter.
const WIDEST_FAN: f64 = 0.9;

impl Fan {
    /// The fan of rays; `None` if it is wider than `widest`, or too wide for packets.
    #[inline(always)]
    pub(super) fn new(frame: &Frame, origin: DVec3, shears: &Shears, widest: f64) -> Option<Self> {
        let [least, greatest] = shears.extremes();
        let backward = shears.rows[0].inverse[0] < 0.0;
        let reach = (f64::INFINITY, widest);
        Self::of_extremes(frame, origin, shears.axes, [least, greatest], backward, reach).ok()
    }

    /// The fan of rays that end at a common point, traced backwards from there, given the distances of their
    /// origins. Their width at their origins is at most `widest`.
    #[inline(always)]
    pub(super) fn backwards(
        frame: &Frame,
        (end, distances): (DVec3, &[f64; PACKET]),
        (shears, members): (&Shears, u32),
        widest: f64,
    ) -> Result<Self, f64> {
        let backward = shears.rows[0].inverse[0] > 0.0;
        let mut depths = [0.0; PACKET];
        for at in 0..PACKET {
            depths[at] = distances[at] / shears.rows[at / WIDTH].inverse[at % WIDTH].abs();
        }
        let deepest = frame.scale * bounds(&depths, members)[1];
        // Rounding of directions and distances grows with the distances.
        if deepest.is_nan() || deepest > FARTHEST_FAN {
            return Err(f64::INFINITY);
        }
        let [x, y] = [bounds(&shears.x(), members), bounds(&shears.y(), members)];
        let extremes = [[x[0], y[0]], [x[1], y[1]]];
        Self::of_extremes(frame, end, shears.axes, extremes, backward, (deepest, widest))
    }

    #[inline(always)]
    fn of_extremes(
        frame: &Frame,
        origin: DVec3,
        [across_x, across_y, along]: [usize; 3],
        [least, greatest]: [[f64; 2]; 2],
        backward: bool,
        (deepest, widest): (f64, f64),
    ) -> Result<Self, f64> {
        let sign = if backward { -1.0 } else { 1.0 };
        let axes = [
            FanAxis::new(across_x, sign, least[0], greatest[0]),
            FanAxis::new(across_y, sign, least[1], greatest[1]),
        ];

        let origin = frame.place(origin);
        let reach = origin.abs().max_element();
        // For rays that end here, the rounding of their end points is included.
        let error = 2.0 * DOUBLE_ERROR * (1.0 + reach);
        let start = (-frame.half[along] - sign * origin[along]).max(0.0);
        let mut entry = origin;
        entry[along] += sign * start;
        for FanAxis { axis, slope, .. } in axes {
            entry[axis] += sign * slope * start;
        }
        let spread = axes[0].spread.max(axes[1].spread);
        let footprint = f64::from(spread) * (start + DEEPEST);
        let width = f64::from(spread) * (start + DEEPEST).min(deepest);
        let possible = reach <= FARTHEST_FAN && footprint <= WIDEST_FAN && entry.abs().max_element() <= 2.0;
        if !(possible && width <= widest) {
            return Err(width / widest);
        }
        let margin = 5.0 * UNIT * (1.0 + reach) + error;
        let [x, y] = axes.map(|axis| entry[axis.axis] as f32);
        Ok(Self {
            axes,
            along,
            backward,
            origin_high: (origin + margin).as_vec3().to_array(),
            origin_low: (origin - margin).as_vec3().to_array(),
            vertex_origin: [x, y, entry[along] as f32],
            start: sign * start,
            opening: 1.0,
            farness: (sign * start) as f32,
            is_moderate: frame.moderate,
            plane: None,
            centre: 0.0,
            middle: [0.0; 2],
            vertex_error: (FAN_VERTEX_ERROR + 4.0 * error) as f32,
            scale: frame.scale,
            slack: UNIT * UNIT + 4.0 * error,
        })
    }

    /// The fan of rays of one direction, given their origins by coordinate.
    #[inline(always)]
    pub(super) fn parallel(
        frame: &Frame,
        origins: &[[f64; PACKET]; 3],
        (shears, members): (&Shears, u32),
        widest: f64,
    ) -> Result<Self, f64> {
        let first = &shears.rows[0];
        let [across_x, across_y, along] = shears.axes;
        let (slopes, backward) = ([first.x[0], first.y[0]], first.inverse[0] < 0.0);
        let sign = if backward { -1.0 } else { 1.0 };
        let x = bounds(&frame.placed(0, &origins[0]), members);
        let y = bounds(&frame.placed(1, &origins[1]), members);
        let z = bounds(&frame.placed(2, &origins[2]), members);
        let (low, high) = (DVec3::new(x[0], y[0], z[0]), DVec3::new(x[1], y[1], z[1]));
        let reach = low.abs().max(high.abs()).max_element();
        // Behind all origins.
        let plane = if backward { high[along] } else { low[along] };
        let mut spread = [0.0; 2];
        let mut middle = [0.0; 2];
        for (i, axis) in [across_x, across_y].into_iter().enumerate() {
            let [least, greatest] =
                bounds(&sheared(frame, origins, [axis, along], plane, slopes[i]), members);
            middle[i] = 0.5 * (least + greatest);
            spread[i] = (0.5 * (greatest - least)) * (1.0 + 4.0 * UNIT) + f64::from(f32::MIN_POSITIVE);
        }
        let footprint = spread[0].max(spread[1]) + UNIT;
        let entry = middle[0].abs().max(middle[1].abs()).max(reach);
        if !(entry <= 2.0 && footprint <= WIDEST_FAN.min(widest)) {
            return Err(footprint / widest);
        }
        let error = 2.0 * DOUBLE_ERROR * (1.0 + reach);
        let margin = 5.0 * UNIT * (1.0 + reach) + error;
        let axes = [
            FanAxis { spread: spread[0] as f32, ..FanAxis::new(across_x, sign, slopes[0], slopes[0]) },
            FanAxis { spread: spread[1] as f32, ..FanAxis::new(across_y, sign, slopes[1], slopes[1]) },
        ];
        Ok(Self {
            axes,
            along,
            backward,
            origin_high: (high + margin).as_vec3().to_array(),
            origin_low: (low - margin).as_vec3().to_array(),
            vertex_origin: [middle[0] as f32, middle[1] as f32, plane as f32],
            start: 0.0,
            opening: 0.0,
            farness: 1.0,
            is_moderate: frame.moderate,
            plane: Some(plane),
            centre: frame.centre[along],
            middle,
            vertex_error: (FAN_VERTEX_ERROR + 4.0 * error) as f32,
            scale: frame.scale,
            slack: UNIT * UNIT + 4.0 * error,
        })
    }

    /// Depth map of a ray with 1/d_z = `inverse` and an origin at a position along the longest axis, which
    /// matters only for rays of one direction.
    #[inline(always)]
    pub(super) fn depth_of(&self, inverse: f64, origin: f64) -> Depth {
        let depth = self.depth(inverse);
        match self.plane {
            None => depth,
            Some(plane) => {
                let from_plane = self.scale * (origin - self.centre) - plane;
                Depth { start: if self.backward { from_plane } else { -from_plane }, ..depth }
            }
        }
    }

    /// Depth map of a ray of the fan with 1/d_z = `inverse`, starting where the middle ray enters the scene.
    #[inline(always)]
    pub(super) fn depth(&self, inverse: f64) -> Depth {
        self.depth_of_scale(self.scale / inverse.abs())
    }

    /// Depth map from [`Depth::scale`].
    #[inline(always)]
    pub(super) fn depth_of_scale(&self, scale: f64) -> Depth {
        Depth { scale, start: self.start.abs(), slack: self.slack }
    }

    /// The depth from the fan's origin, rounded up.
    #[inline(always)]
    pub(super) fn whole_depth(&self, depth: f32) -> f32 {
        let depth = f64::from(depth) + self.start.abs();
        (depth + depth.abs() * (2.0 * UNIT)) as f32
    }
}

impl FanAxis {
    #[inline(always)]
    fn new(axis: usize, sign: f64, least: f64, greatest: f64) -> Self {
        let slope = 0.5 * (least + greatest);
        // Rounded up: differences to the middle are rounded to single precision.
        let spread = ((0.5 * (greatest - least)) * (1.0 + 4.0 * UNIT) + f64::from(f32::MIN_POSITIVE)) as f32;
        let (least, greatest) = if sign < 0.0 { (-greatest, -least) } else { (least, greatest) };
        let straddles = least < SMALLEST_SLOPE && greatest > -SMALLEST_SLOPE;
        let ends = if straddles {
            [least.min(-SMALLEST_SLOPE), greatest.max(SMALLEST_SLOPE)]
        } else {
            [least, greatest]
        };
        Self {
            axis,
            slope,
            spread,
            negative: !straddles && least < 0.0,
            straddles,
            inverse: [(1.0 / ends[0]) as f32, (1.0 / ends[1]) as f32],
        }
    }
}

/// Coordinates of points along an axis, sheared along rays of a slope from a plane orthogonal to another
/// axis.
#[inline(always)]
fn sheared(
    frame: &Frame,
    points: &[[f64; PACKET]; 3],
    [axis, along]: [usize; 2],
    plane: f64,
    slope: f64,
) -> [f64; PACKET] {
    let (mut places, depths) = (frame.placed(axis, &points[axis]), frame.placed(along, &points[along]));
    for at in 0..PACKET {
        places[at] -= slope * (depths[at] - plane);
    }
    places
}

/// Least and greatest of some numbers.
#[inline(always)]
fn bounds(numbers: &[f64; PACKET], members: u32) -> [f64; 2] {
    let (mut least, mut greatest) = ([f64::INFINITY; 4], [f64::NEG_INFINITY; 4]);
    for at in 0..PACKET {
        let member = members >> at & 1 == 1;
        let (low, high) = (&mut least[at % 4], &mut greatest[at % 4]);
        // In this order NaN is ignored.
        *low = smaller(if member { numbers[at] } else { f64::INFINITY }, *low);
        *high = larger(if member { numbers[at] } else { f64::NEG_INFINITY }, *high);
    }
    let [a, b, c, d] = least;
    let [e, f, g, h] = greatest;
    [smaller(smaller(a, b), smaller(c, d)), larger(larger(e, f), larger(g, h))]
}

/// Offsets of the origins of rays of one direction from the middle, along both transverse axes, sheared along
/// the rays.
#[inline(always)]
pub(super) fn beside(fan: &Fan, frame: &Frame, origins: &[[f64; PACKET]; 3]) -> [[f64; PACKET]; 2] {
    let mut offsets = [[0.0; PACKET]; 2];
    for (i, offsets) in offsets.iter_mut().enumerate() {
        let FanAxis { axis, slope, .. } = fan.axes[i];
        let places = sheared(frame, origins, [axis, fan.along], fan.plane.unwrap_or(0.0), slope);
        for at in 0..PACKET {
            offsets[at] = places[at] - fan.middle[i];
        }
    }
    offsets
}
