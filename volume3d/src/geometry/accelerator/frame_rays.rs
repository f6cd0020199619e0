//! Rays of a sheaf in the frame, computed in SIMD.
//!
//! Every number has the bits of a single ray's, from the same operations in the same order: the error bounds
//! are those of the frame.

use super::frame::Frame;
use super::sheaf::Sheaf;
use super::watertight::{PACKET, larger};

/// One number per ray.
type Numbers = [f32; PACKET];

/// The results of [`Frame::ray`] for every ray, bit for bit.
#[derive(Clone, Copy)]
pub(super) struct FrameRays {
    /// Index of the longest axis.
    pub(super) along: [u8; PACKET],
    /// Whether the direction is negative, by axis.
    pub(super) negative: [[u8; PACKET]; 3],
    /// By axis and side.
    pub(super) zero: [[Numbers; 2]; 3],
    pub(super) inverse: [Numbers; 3],
    pub(super) place: [Numbers; 3],
    pub(super) slopes: [Numbers; 3],
    pub(super) vertex_error: Numbers,
    pub(super) near: Numbers,
    pub(super) far: Numbers,
    pub(super) within: [Numbers; 2],
    /// Bit mask of rays that can meet the scene.
    pub(super) meeting: u32,
    /// Bit mask of rays with finite origin and slopes; the data of others are meaningless.
    pub(super) finite: u32,
}

impl FrameRays {
    /// No rays.
    pub(super) const NONE: Self = Self {
        along: [0; PACKET],
        negative: [[0; PACKET]; 3],
        zero: [[[0.0; PACKET]; 2]; 3],
        inverse: [[0.0; PACKET]; 3],
        place: [[0.0; PACKET]; 3],
        slopes: [[0.0; PACKET]; 3],
        vertex_error: [0.0; PACKET],
        near: [0.0; PACKET],
        far: [0.0; PACKET],
        within: [[0.0; PACKET]; 2],
        meeting: 0,
        finite: 0,
    };

    /// Replaces the rays by those of a sheaf.
    #[inline(always)]
    pub(super) fn fill(&mut self, frame: &Frame, sheaf: &Sheaf) {
        let Self { along, negative, zero, inverse, place, slopes, vertex_error, near, far, within, .. } =
            self;
        let (mut meets, mut odd) = ([0.0; PACKET], [0.0; PACKET]);
        // Copies, so that the compiler can rule out aliasing.
        let (frame, origins, directions, ends) = (*frame, sheaf.origins, sheaf.directions, sheaf.far);
        for at in 0..PACKET {
            let origin = [origins[0][at], origins[1][at], origins[2][at]];
            let direction = [directions[0][at], directions[1][at], directions[2][at]];
            let entry = frame.entry(origin, direction, (sheaf.near, ends[at]));
            for axis in 0..3 {
                zero[axis][0][at] = entry.zero[axis][0];
                zero[axis][1][at] = entry.zero[axis][1];
                inverse[axis][at] = entry.inverse[axis];
                place[axis][at] = entry.place[axis];
                slopes[axis][at] = entry.slopes[axis];
            }
            vertex_error[at] = entry.vertex_error;
            near[at] = entry.near;
            far[at] = entry.far;
            within[0][at] = entry.within[0];
            within[1][at] = entry.within[1];
            meets[at] = if entry.meets { 1.0 } else { 0.0 };
            let sum = (origin[0] + origin[1] + origin[2]) as f32;
            odd[at] = 0.0 * (sum + entry.slopes[0] + entry.slopes[1] + entry.slopes[2]);
        }
        for at in 0..PACKET {
            let [x, y, z] = [0, 1, 2].map(|axis| directions[axis][at].abs());
            along[at] = if z > larger(x, y) { 2 } else { u8::from(y > x) };
            for axis in 0..3 {
                negative[axis][at] = u8::from(inverse[axis][at] < 0.0);
            }
        }
        (self.meeting, self.finite) = (0, 0);
        for at in 0..PACKET {
            self.meeting |= u32::from(meets[at] == 1.0) << at;
            self.finite |= u32::from(odd[at] == 0.0) << at;
        }
    }
}
