//! Cameras from DTU projection matrices.

use glam::{DMat3, DMat4, DVec2, DVec3, DVec4};

use super::View;
use crate::io::DtuProblem;
use crate::scene::{Calibration, Camera};

/// Maximum displacement of the picture's border under the conversion to [`Camera`], in pixels.
const TOLERANCE: f64 = 1e-3;

/// Minimum volume of three rows relative to the product of their lengths.
const LEAST_VOLUME: f64 = 1e-12;

/// Skewed camera, which a [`Camera`] cannot represent: its axes are not orthogonal.
#[derive(Clone, Copy, Debug, PartialEq, thiserror::Error)]
#[error(
    "a camera whose columns are upright cannot represent this one: skew moves pixels at the border by {skew}; 0.001 is allowed"
)]
pub struct CameraMismatch {
    /// |skew/f_y| times half the film's height.
    pub skew: f64,
}

/// K, R and the centre of a projection K R (x − c).
#[derive(Clone, Copy, Debug)]
pub(in crate::io) struct Pinhole {
    pub(in crate::io) intrinsics: DMat3,
    pub(super) rotation: DMat3,
    pub(in crate::io) center: DVec3,
}

impl Pinhole {
    /// Decomposes the first three rows of a matrix, which may have any scale: K is upper triangular with a
    /// positive diagonal and K_33 = 1, and R is a rotation.
    pub(super) fn new(matrix: DMat4, index: usize) -> Result<Self, DtuProblem> {
        let singular = |what| DtuProblem::Singular { index, what };
        let rows = [0, 1, 2].map(|i| matrix.row(i));
        let largest = rows.iter().map(|row| row.abs().max_element()).fold(0.0, f64::max);
        if !(largest.is_normal() && largest.recip().is_normal()) {
            return Err(singular("its numbers are too large, too small, or all 0"));
        }
        let [first, second, third] = rows.map(|row| row / largest);
        let volume = first.truncate().dot(second.truncate().cross(third.truncate()));
        let lengths: f64 = [first, second, third].iter().map(|row| row.truncate().length()).product();
        if volume.is_nan() || volume.abs() <= LEAST_VOLUME * lengths {
            return Err(singular("its first three columns are singular"));
        }
        // The negated matrix is the same projection, but the rotation needs a positive determinant.
        let [first, second, third]: [DVec4; 3] = [first, second, third].map(|row| row * volume.signum());
        let (r3, depth) = unit(third.truncate());
        let k23 = second.truncate().dot(r3);
        let (r2, k22) = unit(second.truncate() - r3 * k23);
        let r1 = r2.cross(r3).normalize();
        let (k11, k12, k13) = (first.truncate().dot(r1), first.truncate().dot(r2), first.truncate().dot(r3));
        let shift = DVec3::new(first.w, second.w, third.w);
        // K z = shift from below, then c = −Rᵀ z.
        let z3 = shift.z / depth;
        let z2 = (shift.y - k23 * z3) / k22;
        let z1 = (shift.x - k12 * z2 - k13 * z3) / k11;
        let center = -(r1 * z1 + r2 * z2 + r3 * z3);
        let columns = [DVec3::new(k11, 0.0, 0.0), DVec3::new(k12, k22, 0.0), DVec3::new(k13, k23, depth)];
        let [x, y, z] = columns.map(|column| column / depth);
        let pinhole = Self {
            intrinsics: DMat3::from_cols(x, y, z),
            rotation: DMat3::from_cols(r1, r2, r3).transpose(),
            center,
        };
        if pinhole.intrinsics.is_finite() && pinhole.rotation.is_finite() && center.is_finite() {
            Ok(pinhole)
        } else {
            Err(singular("its numbers differ too much in size"))
        }
    }

    /// The camera of a picture with these columns and rows.
    pub(super) fn camera(&self, (width, height): (usize, usize)) -> Result<Camera, CameraMismatch> {
        let (k, size) = (self.intrinsics, DVec2::new(width as f64, height as f64));
        let focal = DVec2::new(k.x_axis.x, k.y_axis.y);
        let skew = (k.y_axis.x / focal.y).abs() * 0.5 * size.y;
        if skew.is_nan() || skew > TOLERANCE {
            return Err(CameraMismatch { skew });
        }
        // Pixel centres have whole coordinates there.
        let principal = k.z_axis.truncate() + 0.5;
        let (rotation, center) = (self.rotation, self.center);
        Ok(Calibration { rotation, center, focal, principal, size }.into())
    }
}

fn unit(v: DVec3) -> (DVec3, f64) {
    let length = v.length();
    (v / length, length)
}

impl View {
    /// Projection of a point into the picture: u to the right and v down, with (0, 0) in the middle of the
    /// top left pixel. A point behind the camera is projected, too; the projection of a point at depth 0 is
    /// not finite.
    #[must_use]
    pub fn project(&self, x: DVec3) -> DVec2 {
        let p = self.intrinsics * (self.rotation * (x - self.center));
        DVec2::new(p.x / p.z, p.y / p.z)
    }

    /// The camera in the form that a scene needs.
    ///
    /// # Errors
    /// If the axes are skewed so much that a pixel at the border is displaced by more than 0.001 pixels. Such
    /// pictures have to be resampled first.
    pub fn camera(&self) -> Result<Camera, CameraMismatch> {
        let &Self { intrinsics, rotation, center, .. } = self;
        Pinhole { intrinsics, rotation, center }.camera(self.image.size())
    }
}
