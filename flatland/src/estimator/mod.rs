//! The methods that differentiate an image, behind one trait.
//!
//! | method | unbiased | needs |
//! |---|---|---|
//! | [`Exact`] | exact | the arrangement of all edges |
//! | [`WarpedArea`] of auxiliary points | with debiasing; else consistent in their number | nothing |
//! | [`WarpedArea`] of the mean over jumps | yes | a list of all edges |
//! | [`WarpedArea`] of the softened mean, with its residual | yes, if no two visible edges coincide | a list of all edges |
//! | [`EdgeSampling`] | yes, if no two visible edges coincide | a list of all edges |
//! | [`Rotation`] | no | nothing |
//! | [`FiniteDifference`] | no: O(step²) | two scenes |
//!
//! Forward mode differentiates every pixel with respect to one parameter, a [`Motion`]. Reverse
//! mode differentiates one loss, given as its adjoint image ∂L/∂I, with respect to every vertex.
//! All sampled methods draw sample s of pixel p from a stream of its own, so that results depend on
//! the seed alone, and forward and reverse see the same random numbers: they are one linear map and
//! its transpose.

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

/// A gradient that cannot be estimated.
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
    /// The rotation method was given no candidates to follow.
    #[error("at least one candidate to follow is needed")]
    NoCandidates,
    /// No samples were asked for.
    #[error("at least one sample per pixel is needed")]
    NoSamples,
    /// The finite difference's step is not positive and finite.
    #[error("the finite difference's step {step} is not positive and finite")]
    Step {
        /// The step.
        step: f64,
    },
    /// The softness of a softened mean over jumps is negative or not a number.
    #[error("the softness {softness} is negative or not a number")]
    Softness {
        /// The softness, in pixels.
        softness: f64,
    },
    /// The adjoint image is not of the film's size.
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
    /// The standard error of that mean, per channel; 0 where exact, NaN from a single sample.
    pub standard_error: Image,
    /// How many times the scene was asked what is seen at a point.
    pub rays: u64,
    /// How many samples were not finite. They count as 0, and the mean is then biased.
    pub non_finite: u64,
}

/// dL/dp of every vertex p of the scene, shape after shape.
#[derive(Clone, Debug, PartialEq)]
pub struct VertexGradient {
    /// The estimate.
    pub mean: Vec<DVec2>,
    /// The standard error of each component, from independent batches; NaN from a single one.
    pub standard_error: Vec<DVec2>,
    /// How many times the scene was asked what is seen at a point.
    pub rays: u64,
    /// How many samples were not finite. They count as 0, and the mean is then biased.
    pub non_finite: u64,
}

/// A method that differentiates the image of a scene of polygons.
pub trait Method: Sync {
    /// A short name for tables and legends.
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
