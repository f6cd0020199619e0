//! Error type of all estimators.

use crate::plane::MotionError;
use crate::plane::exact::ExactError;
use crate::sdf::fields::FieldError;
use crate::transport::{CameraError, TangentError, WorldError};
use crate::warp::WarpError;

/// Reason why a derivative cannot be estimated.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum EstimatorError {
    /// The motion does not fit the scene.
    #[error(transparent)]
    Motion(#[from] MotionError),
    /// The camera cannot be used.
    #[error(transparent)]
    Camera(#[from] CameraError),
    /// The change does not fit the world.
    #[error(transparent)]
    Tangent(#[from] TangentError),
    /// The warp's parameters are out of range.
    #[error(transparent)]
    Warp(#[from] WarpError),
    /// The parameters of an implicit surface's field are out of range.
    #[error(transparent)]
    Field(#[from] FieldError),
    /// The exact derivative does not exist or cannot be computed.
    #[error(transparent)]
    Exact(#[from] ExactError),
    /// A finite difference led to an invalid world.
    #[error("displaced by θ = {theta}: {source}")]
    Displaced {
        /// The displacement.
        theta: f64,
        /// The violation there.
        source: WorldError,
    },
    /// No samples were requested.
    #[error("at least one sample per pixel is needed")]
    NoSamples,
    /// The rotation method has no candidates to follow.
    #[error("at least one candidate to follow is needed")]
    NoCandidates,
    /// The finite difference's step is not positive and finite.
    #[error("the finite difference's step {step} is not positive and finite")]
    Step {
        /// The step.
        step: f64,
    },
    /// The softness of a softened mean over discontinuities is negative or NaN.
    #[error("the softness {softness} is negative or not a number")]
    Softness {
        /// The softness: in pixels in the plane, in kernel widths along paths.
        softness: f64,
    },
    /// The number of kernel widths in a lobe or an emitter is not in (0, 10⁶].
    #[error("{relative} kernel widths to a lobe or emitter is not in (0, 10⁶]")]
    RelativeWidth {
        /// The number.
        relative: f64,
    },
    /// The width of a relaxed boundary's band is not positive and finite.
    #[error("the band's width ε = {width} is not positive and finite")]
    Band {
        /// ε.
        width: f64,
    },
    /// The adjoint image differs from the film in size.
    #[error("an adjoint image of {} × {} pixels for a film of {} × {}", found.0, found.1, expected.0, expected.1)]
    AdjointSize {
        /// Width and height of the film.
        expected: (usize, usize),
        /// Width and height of the image.
        found: (usize, usize),
    },
    /// A direction in parameter space has the wrong number of parameters.
    #[error("a direction of {found} parameters for a shape that has {expected}")]
    Direction {
        /// Number of the shape's parameters.
        expected: usize,
        /// Number given.
        found: usize,
    },
}

/// Whether an adjoint image fits the film.
pub(super) fn check_adjoint(expected: (usize, usize), found: (usize, usize)) -> Result<(), EstimatorError> {
    if expected == found { Ok(()) } else { Err(EstimatorError::AdjointSize { expected, found }) }
}

/// Whether a direction in parameter space fits the number of parameters.
pub(super) fn check_direction(expected: usize, direction: &[f64]) -> Result<(), EstimatorError> {
    let found = direction.len();
    if expected == found { Ok(()) } else { Err(EstimatorError::Direction { expected, found }) }
}

/// Whether a finite difference's step is positive and finite.
pub(super) fn check_step(step: f64) -> Result<(), EstimatorError> {
    if step > 0.0 && step.is_finite() { Ok(()) } else { Err(EstimatorError::Step { step }) }
}
