//! Errors of gradients and rendering.

use flatland::sdf::fields::FieldError;
use flatland::warp::WarpError;
use glam::DVec3;

use crate::Image;
use crate::gradient::run::progress::Stopped;
use crate::gradient::unsupported::Unsupported;
use crate::scene::{Scene, SceneError};

/// Reason why a gradient or an image cannot be computed.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum GradientError {
    /// The scene or parameter is not differentiable by this method.
    #[error(transparent)]
    Unsupported(#[from] Unsupported),
    /// A parameter of the warp is out of range.
    #[error(transparent)]
    Warp(#[from] WarpError),
    /// The adjoint image and the film differ in size.
    #[error("the adjoint image is {} x {}, but the film {} x {}", found.0, found.1, film.0, film.1)]
    Adjoint {
        /// Columns and rows of the adjoint image.
        found: (usize, usize),
        /// Columns and rows of the film.
        film: (usize, usize),
    },
    /// A pixel of the adjoint image is NaN or infinite.
    #[error("the adjoint image is {value} in pixel ({x}, {y}), but must be finite")]
    NonFiniteAdjoint {
        /// Column.
        x: usize,
        /// Row, from the top.
        y: usize,
        /// The pixel.
        value: DVec3,
    },
    /// The tangent belongs to another scene.
    #[error("the tangent belongs to another scene: its tables differ in size")]
    Tangent,
    /// Too few samples.
    #[error("at least {least} samples per pixel are needed, not {samples}")]
    Samples {
        /// Number of samples given.
        samples: usize,
        /// Minimum number of samples.
        least: usize,
    },
    /// The reach of a mean over discontinuities is not positive.
    #[error("the reach {name} of the mean over discontinuities must be positive and finite, not {reach}")]
    Reach {
        /// Name of the reach: film or lobe.
        name: &'static str,
        /// Its value.
        reach: f64,
    },
    /// A parameter of the field of implicit surfaces is out of range.
    #[error(transparent)]
    ImplicitField(#[from] FieldError),
    /// The softness of a mean over discontinuities is negative or NaN.
    #[error("the softness of the mean over discontinuities must be 0 or more pixels, not {softness}")]
    Softness {
        /// Its value.
        softness: f64,
    },
    /// The allocation of samples belongs to another film.
    #[error("the sample allocation belongs to a film of another size")]
    Allocation,
    /// The step of finite differences is not positive.
    #[error("the step of finite differences must be positive and finite, not {step}")]
    Step {
        /// Its value.
        step: f64,
    },
    /// A parameter leaves its range within the step of finite differences.
    #[error("the step of finite differences leads to an invalid scene: {0}")]
    Scene(#[from] SceneError),
    /// The method has no reverse mode.
    #[error("finite differences have no reverse mode")]
    NoReverse,
    /// Cancelled.
    #[error(transparent)]
    Stopped(#[from] Stopped),
}

/// Checks that an adjoint image has the size of the film and finite pixels.
pub(in crate::gradient) fn check_adjoint(scene: &Scene, adjoint: &Image) -> Result<(), GradientError> {
    let Image { width, height, pixels } = adjoint;
    if adjoint.size() != scene.size() || pixels.len() != width * height {
        return Err(GradientError::Adjoint { found: adjoint.size(), film: scene.size() });
    }
    match pixels.iter().position(|pixel| !pixel.is_finite()) {
        Some(i) => Err(GradientError::NonFiniteAdjoint { x: i % width, y: i / width, value: pixels[i] }),
        None => Ok(()),
    }
}
