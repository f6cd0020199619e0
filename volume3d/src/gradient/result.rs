//! What an estimate of a gradient image says.

use glam::DVec3;

/// A sample that was not finite: left out of the sums, and reported here.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct NonFinite {
    /// The cell's column in the image; −1 and the width are beside it.
    pub column: isize,
    /// The cell's row.
    pub row: isize,
    /// The sample's number.
    pub sample: usize,
}

/// Interior, primary and secondary term of a derivative, pixel by pixel.
#[derive(Clone, Debug, PartialEq)]
pub struct Terms {
    /// ∂f/∂θ: what changes while all jumps stand still.
    pub interior: Vec<DVec3>,
    /// The motion of jumps on the film.
    pub primary: Vec<DVec3>,
    /// The motion of jumps seen from shading points: shadows, reflections, occluded light.
    pub secondary: Vec<DVec3>,
}

/// A gradient image: the derivative of every pixel along one change.
#[derive(Clone, Debug, PartialEq)]
pub struct GradientImage {
    /// Columns.
    pub width: usize,
    /// Rows, from the top.
    pub height: usize,
    /// The image itself, from the same samples.
    pub image: Vec<DVec3>,
    /// Its standard error.
    pub image_error: Vec<DVec3>,
    /// dI/dθ of every pixel, linear RGB.
    pub gradient: Vec<DVec3>,
    /// The standard error of each.
    pub standard_error: Vec<DVec3>,
    /// The terms it is the sum of, if they were asked for and the method tells them apart.
    pub terms: Option<Terms>,
    /// Auxiliary rays that were traced.
    pub auxiliary_rays: u64,
    /// Samples that were not finite.
    pub non_finite: Vec<NonFinite>,
}

/// An image.
#[derive(Clone, Debug, PartialEq)]
pub struct Image {
    /// Columns.
    pub width: usize,
    /// Rows, from the top.
    pub height: usize,
    /// Linear RGB, row by row from the top.
    pub pixels: Vec<DVec3>,
    /// The standard error of each.
    pub standard_error: Vec<DVec3>,
    /// Samples that were not finite.
    pub non_finite: Vec<NonFinite>,
}
