//! The methods that differentiate an image of a flat world, behind one trait.
//!
//! | method | unbiased | needs |
//! |---|---|---|
//! | [`WarpedArea`] of auxiliary rays | with debiasing; else consistent in their number | nothing |
//! | [`WarpedArea`] of the mean over discontinuities | yes | a list of all vertices |
//! | [`WarpedArea`] of the softened mean, with its residual | yes | a list of all vertices |
//! | [`EdgeSampling`] | yes | a list of all vertices |
//! | [`FiniteDifference`] | no: O(step²) | two worlds |
//!
//! [`WarpedArea`] accepts any construction of the field; with
//! [`Construction::Followed`](crate::transport::fields::Construction) it is the rotation method of Loubet et
//! al. (2019), with `Still` the interior term alone.
//!
//! All methods differentiate the path tracer's own estimate: sample s of pixel p follows the same path as the
//! image's sample s of pixel p, and auxiliary rays use a separate stream, so that the primal has the same
//! bits with and without a gradient.

mod driver;
mod edge_sampling;
mod fault;
mod film_jumps;
mod finite_difference;
mod jumps;
mod kernels;
mod record;
mod residual;
mod streams;
mod sweep;
#[cfg(test)]
mod tests;
mod warped_area;

pub use edge_sampling::EdgeSampling;
pub use fault::Fault;
pub use finite_difference::FiniteDifference;
pub use jumps::EdgeChoice;
pub use kernels::Kernels;
pub use warped_area::WarpedArea;

use crate::transport::{Camera, CameraError, Tangent, TangentError, Terms, World, WorldError};
use crate::warp::WarpError;

/// Reason why a gradient cannot be estimated.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum PathError {
    /// The camera cannot be used.
    #[error(transparent)]
    Camera(#[from] CameraError),
    /// The change does not fit the world.
    #[error(transparent)]
    Tangent(#[from] TangentError),
    /// The warp's parameters are out of range.
    #[error(transparent)]
    Warp(#[from] WarpError),
    /// A finite difference led to an invalid world.
    #[error("displaced by θ = {theta}: {source}")]
    Displaced {
        /// The displacement.
        theta: f64,
        /// The violation there.
        source: WorldError,
    },
    /// The number of kernel widths in a lobe or an emitter is not in (0, 10⁶].
    #[error("{relative} kernel widths to a lobe or emitter is not in (0, 10⁶]")]
    RelativeWidth {
        /// The number.
        relative: f64,
    },
    /// The rotation method has no candidates to follow.
    #[error("at least one candidate to follow is needed")]
    NoCandidates,
    /// The softness of a softened mean over discontinuities is negative or NaN.
    #[error("the softness {softness} is negative or not a number")]
    Softness {
        /// The softness, in kernel widths.
        softness: f64,
    },
    /// No samples were requested.
    #[error("at least one sample per pixel is needed")]
    NoSamples,
    /// The finite difference's step is not positive and finite.
    #[error("the finite difference's step {step} is not positive and finite")]
    Step {
        /// The step.
        step: f64,
    },
    /// The adjoint image differs from the film in size.
    #[error("adjoint image of {found} pixels for a film of {expected}")]
    AdjointSize {
        /// Pixels of the film.
        expected: usize,
        /// Pixels of the image.
        found: usize,
    },
}

/// dI/dθ of every pixel.
#[derive(Clone, Debug, PartialEq)]
pub struct GradientImage {
    /// The estimate, term by term.
    pub mean: Vec<Terms<f64>>,
    /// Standard error of each term; NaN for a single sample.
    pub term_error: Vec<Terms<f64>>,
    /// Standard error of the sum of the terms; NaN for a single sample.
    pub standard_error: Vec<f64>,
    /// Number of rays traced.
    pub rays: u64,
    /// Non-finite samples, as (pixel, sample). They count as 0, which biases the mean.
    pub non_finite: Vec<(usize, usize)>,
}

impl GradientImage {
    /// The derivative of every pixel.
    #[must_use]
    pub fn total(&self) -> Vec<f64> {
        self.mean.iter().map(|t| t.total()).collect()
    }
}

/// dL/dp of every parameter p.
#[derive(Clone, Debug, PartialEq)]
pub struct Gradient {
    /// The estimate, term by term.
    pub mean: Terms<Tangent>,
    /// Standard error of the sum of the terms, by parameter, from independent batches; NaN for a single one.
    pub standard_error: Tangent,
    /// Number of rays traced.
    pub rays: u64,
    /// Non-finite samples, as (pixel, sample). They count as 0, which biases the mean.
    pub non_finite: Vec<(usize, usize)>,
}

impl Gradient {
    /// The gradient.
    #[must_use]
    pub fn total(&self) -> Tangent {
        self.mean.interior.clone().and(&self.mean.primary).and(&self.mean.secondary)
    }
}

/// A method that differentiates an image of a flat world.
pub trait Method: Sync {
    /// Short name for tables and legends.
    fn name(&self) -> &'static str;

    /// dI/dθ of every pixel, for one tangent.
    ///
    /// # Errors
    /// A [`PathError`] that names the parameter.
    fn forward(&self, world: &World, camera: &Camera, change: &Tangent) -> Result<GradientImage, PathError>;

    /// dL/dp of every parameter, for the loss whose adjoint image is ∂L/∂I.
    ///
    /// # Errors
    /// A [`PathError`] that names the parameter.
    fn reverse(&self, world: &World, camera: &Camera, adjoint: &[f64]) -> Result<Gradient, PathError>;
}
