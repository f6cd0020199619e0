//! Why a gradient cannot be taken, or an image.

use flatland::sdf::fields::FieldError;
use flatland::warp::WarpError;

use super::progress::Stopped;
use super::unsupported::Unsupported;
use crate::scene::SceneError;

/// Why there is no gradient, or no image.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum GradientError {
    /// What is asked for cannot be differentiated.
    #[error(transparent)]
    Unsupported(#[from] Unsupported),
    /// A parameter of the warp is out of range.
    #[error(transparent)]
    Warp(#[from] WarpError),
    /// The adjoint image has another size than the film.
    #[error("the adjoint image is {} x {}, but the film {} x {}", found.0, found.1, film.0, film.1)]
    Adjoint {
        /// Its columns and rows.
        found: (usize, usize),
        /// Those of the film.
        film: (usize, usize),
    },
    /// A change belongs to another scene.
    #[error("the change is not one of this scene: its tables have other sizes")]
    Tangent,
    /// No samples.
    #[error("at least {least} samples a pixel are needed, not {samples}")]
    Samples {
        /// How many there are.
        samples: usize,
        /// How many there must be.
        least: usize,
    },
    /// A mean over jumps with a reach that is not positive.
    #[error("the reach of the mean over jumps, {name}, must be positive and finite, not {reach}")]
    Reach {
        /// Which reach: film or lobe.
        name: &'static str,
        /// Its value.
        reach: f64,
    },
    /// A parameter of the field of implicit surfaces is out of range.
    #[error(transparent)]
    ImplicitField(#[from] FieldError),
    /// A softened mean over jumps whose softness is negative or not a number.
    #[error("the softness of the mean over jumps must be 0 or more pixels, not {softness}")]
    Softness {
        /// The softness.
        softness: f64,
    },
    /// Samples are spread over another film.
    #[error("the allocation of samples is not for a film of this size")]
    Allocation,
    /// A step of finite differences that is not positive.
    #[error("the step of finite differences must be positive and finite, not {step}")]
    Step {
        /// The step.
        step: f64,
    },
    /// A step of finite differences leads out of a parameter's range.
    #[error("the step of finite differences leaves the scenes that can be rendered: {0}")]
    Scene(#[from] SceneError),
    /// A method that only differentiates along one change.
    #[error("finite differences have no reverse mode")]
    NoReverse,
    /// Stopped on request.
    #[error(transparent)]
    Stopped(#[from] Stopped),
}
