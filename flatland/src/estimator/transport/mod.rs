//! The methods that differentiate an image of a flat world, behind one trait.
//!
//! | method | unbiased | needs |
//! |---|---|---|
//! | [`WarpedArea`] of auxiliary rays | with debiasing; else consistent in their number | nothing |
//! | [`WarpedArea`] of the mean over jumps | yes | a list of all vertices |
//! | [`WarpedArea`] of the softened mean, with its residual | yes | a list of all vertices |
//! | [`EdgeSampling`] | yes | a list of all vertices |
//! | [`FiniteDifference`] | no: O(step²) | two worlds |
//!
//! [`WarpedArea`] takes any construction of the field; with
//! [`Construction::Followed`](crate::transport::fields::Construction) it is the rotation method of
//! Loubet et al. (2019), with `Still` the interior term alone.
//!
//! All methods differentiate the path tracer's own estimate: sample s of pixel p follows the path that
//! the image's sample s of pixel p follows, and auxiliary rays draw from a stream of their own, so that
//! the primal is the same, bit for bit, whether or not a gradient is taken.

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

/// A gradient that cannot be estimated.
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
    /// A finite difference left the space of worlds.
    #[error("displaced by θ = {theta}: {source}")]
    Displaced {
        /// The displacement.
        theta: f64,
        /// What is wrong there.
        source: WorldError,
    },
    /// The number of kernel widths in a lobe or an emitter is not in (0, 10⁶].
    #[error("{relative} kernel widths to a lobe or emitter is not in (0, 10⁶]")]
    RelativeWidth {
        /// The number.
        relative: f64,
    },
    /// The rotation method was given no candidates to follow.
    #[error("at least one candidate to follow is needed")]
    NoCandidates,
    /// The softness of a softened mean over jumps is negative or not a number.
    #[error("the softness {softness} is negative or not a number")]
    Softness {
        /// The softness, in kernel widths.
        softness: f64,
    },
    /// No samples were asked for.
    #[error("at least one sample per pixel is needed")]
    NoSamples,
    /// The finite difference's step is not positive and finite.
    #[error("the finite difference's step {step} is not positive and finite")]
    Step {
        /// The step.
        step: f64,
    },
    /// The adjoint image is not of the film's size.
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
    /// The standard error of each term; NaN from a single sample.
    pub term_error: Vec<Terms<f64>>,
    /// The standard error of the sum of the terms; NaN from a single sample.
    pub standard_error: Vec<f64>,
    /// How many rays were traced.
    pub rays: u64,
    /// The samples that were not finite, as (pixel, sample). They count as 0, and the mean is then
    /// biased.
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
    /// The standard error of the sum of the terms, parameter by parameter, from independent batches;
    /// NaN from a single one.
    pub standard_error: Tangent,
    /// How many rays were traced.
    pub rays: u64,
    /// The samples that were not finite, as (pixel, sample). They count as 0, and the mean is then
    /// biased.
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
    /// A short name for tables and legends.
    fn name(&self) -> &'static str;

    /// dI/dθ of every pixel, for one change.
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
