//! The methods that differentiate an image, behind one trait.
//!
//! | method | unbiased | needs |
//! |---|---|---|
//! | [`Exact`] | exact | the arrangement of all edges |
//! | [`WarpedArea`] of auxiliary points | with debiasing; else consistent in their number | nothing |
//! | [`WarpedArea`] of the mean over discontinuities | yes | a list of all edges |
//! | softened [`WarpedArea`], with its residual | yes, if no visible edges coincide | a list of all edges |
//! | [`EdgeSampling`] | yes, if no visible edges coincide | a list of all edges |
//! | [`Rotation`] | no | nothing |
//! | [`FiniteDifference`] | no: O(step²) | two scenes |
//!
//! Forward mode differentiates every pixel with respect to one parameter, a [`Motion`]. Reverse mode
//! differentiates one loss, given as its adjoint image ∂L/∂I, with respect to every vertex. All sampled
//! methods draw sample s of pixel p from a stream of its own, so that results depend only on the seed, and
//! forward and reverse mode use the same random numbers: they are a linear map and its transpose.

mod area_integral;
mod boundary_integral;
mod edge_points;
mod edge_sampling;
mod exact;
mod finite_difference;
mod linear;
mod rotation;
pub mod transport;
mod warped_area;

pub use area_integral::{AreaIntegral, Form};
pub use boundary_integral::BoundaryIntegral;
pub use edge_sampling::EdgeSampling;
pub use exact::Exact;
pub use finite_difference::FiniteDifference;
pub use rotation::Rotation;
pub use warped_area::{Construction, WarpedArea};

use glam::DVec2;

use crate::plane::exact::ExactError;
use crate::plane::{Film, Image, Motion, MotionError, Scene};
use crate::warp::WarpError;

/// Reason why a gradient cannot be estimated.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum EstimatorError {
    /// The motion does not fit the scene.
    #[error(transparent)]
    Motion(#[from] MotionError),
    /// The warp's parameters are out of range.
    #[error(transparent)]
    Warp(#[from] WarpError),
    /// The exact derivative does not exist or cannot be computed.
    #[error(transparent)]
    Exact(#[from] ExactError),
    /// The rotation method has no candidates to follow.
    #[error("at least one candidate to follow is needed")]
    NoCandidates,
    /// No samples were requested.
    #[error("at least one sample per pixel is needed")]
    NoSamples,
    /// The finite difference's step is not positive and finite.
    #[error("the finite difference's step {step} is not positive and finite")]
    Step {
        /// The step.
        step: f64,
    },
    /// The softness of a softened mean over discontinuities is negative or NaN.
    #[error("the softness {softness} is negative or not a number")]
    Softness {
        /// The softness, in pixels.
        softness: f64,
    },
    /// The adjoint image differs from the film in size.
    #[error("adjoint image of {found:?} pixels for a film of {expected:?}")]
    AdjointSize {
        /// Width and height of the film.
        expected: (usize, usize),
        /// Width and height of the image.
        found: (usize, usize),
    },
}

/// dI/dθ of every pixel.
#[derive(Clone, Debug, PartialEq)]
pub struct GradientImage {
    /// The estimate, per channel.
    pub mean: Image,
    /// Standard error of the mean, per channel; 0 if exact, NaN for a single sample.
    pub standard_error: Image,
    /// Number of visibility queries.
    pub rays: u64,
    /// Number of non-finite samples. They count as 0, which biases the mean.
    pub non_finite: u64,
}

/// dL/dp of every vertex p of the scene, shape by shape.
#[derive(Clone, Debug, PartialEq)]
pub struct VertexGradient {
    /// The estimate.
    pub mean: Vec<DVec2>,
    /// Standard error of each component, from independent batches; NaN for a single one.
    pub standard_error: Vec<DVec2>,
    /// Number of visibility queries.
    pub rays: u64,
    /// Number of non-finite samples. They count as 0, which biases the mean.
    pub non_finite: u64,
}

/// A method that differentiates the image of a scene of polygons.
pub trait Method: Sync {
    /// Short name for tables and legends.
    fn name(&self) -> &'static str;

    /// dI/dθ of every pixel, for one motion.
    ///
    /// # Errors
    /// An [`EstimatorError`] that names the parameter, or the place where no derivative exists.
    fn forward(&self, scene: &Scene, motion: &Motion, film: &Film) -> Result<GradientImage, EstimatorError>;

    /// dL/dp of every vertex, for the loss whose adjoint image is ∂L/∂I.
    ///
    /// # Errors
    /// An [`EstimatorError`] that names the parameter, or the place where no derivative exists.
    fn reverse(&self, scene: &Scene, film: &Film, adjoint: &Image) -> Result<VertexGradient, EstimatorError>;
}

fn check_adjoint(film: &Film, adjoint: &Image) -> Result<(), EstimatorError> {
    let (expected, found) = ((film.width(), film.height()), (adjoint.width(), adjoint.height()));
    if expected == found { Ok(()) } else { Err(EstimatorError::AdjointSize { expected, found }) }
}
