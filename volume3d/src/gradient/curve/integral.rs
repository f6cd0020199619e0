//! A kind of curve: how its points are drawn, what they are worth, and how fast they move across V.

use glam::DVec3;

use super::address::Address;
use super::drawing::CameraSubpath;
use super::field::WarpField;
use crate::gradient::modes::differential::Differential;
use crate::path::Frame;

/// Δ(f − L₀) at a point of a curve, divided by the density of the point.
#[derive(Clone, Copy, Debug)]
pub(super) struct Difference {
    /// Difference of radiance, from the side before to the side behind; or the radiance on one side, if the
    /// sides have speeds of their own.
    pub(super) radiance: DVec3,
    /// Factor of each pixel's control variate L₀: 0 for a difference of two sides, in which it cancels.
    pub(super) control_variate: f64,
}

impl Difference {
    /// A difference of two sides.
    pub(super) fn of(radiance: DVec3) -> Self {
        Self { radiance, control_variate: 0.0 }
    }
}

/// The integral ∮ Δ[(f − L₀)(v − V)]·ν dl over all curves of one kind.
///
/// The mean over samples of [`difference`](Self::difference) × [`speed`](Self::speed), summed over the points
/// that a sample draws, is the integral.
pub(super) trait Curve: Sync {
    /// V.
    type Field: WarpField;

    /// A point of a curve, or one side of it.
    type Point;

    fn field(&self) -> &Self::Field;

    /// Whether there is nothing to sample.
    fn is_empty(&self) -> bool;

    /// Draws a sample: calls back with the points that it finds, each with the camera path that sees it.
    fn draw(&self, address: Address, found: &mut impl FnMut(&CameraSubpath<'_>, &Self::Point));

    /// Δ(f − L₀) divided by the density of the point.
    fn difference(&self, path: &CameraSubpath<'_>, point: &Self::Point) -> Difference;

    /// A number whose derivative is (v − V)·ν, with ν from the side before to the side behind; times |∇G| for
    /// a curve {G = 0} whose difference is divided by it.
    fn speed<C: Differential>(
        &self,
        calculus: &mut C,
        frame: &Frame<C::Number>,
        path: &CameraSubpath<'_>,
        point: &Self::Point,
    ) -> C::Number;
}
