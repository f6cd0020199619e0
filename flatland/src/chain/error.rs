//! Errors of worlds with mirrors, glass and openings.

use crate::transport::CameraError;

/// Reason why a world of [`chain`](crate::chain) is invalid, or has no exact derivative.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum ChainError {
    /// The environment's radiance is negative or not finite.
    #[error("the environment's radiance {environment} is negative or not finite")]
    Environment {
        /// The radiance.
        environment: f64,
    },
    /// A surface is invalid.
    #[error("surface {surface}: {what}")]
    Surface {
        /// Index of the surface.
        surface: usize,
        /// The violation.
        what: &'static str,
    },
    /// Two surfaces cross, touch or overlap other than by their ends.
    #[error("surfaces {first} and {second} meet: only ends of both may touch")]
    Meet {
        /// Index of a surface.
        first: usize,
        /// Index of another.
        second: usize,
    },
    /// A light's numbers are not finite, or its power is negative.
    #[error("light {light} has a negative power, or a number that is not finite")]
    Light {
        /// Index of the light.
        light: usize,
    },
    /// Too few or too many numbers for a world, or rates for a world and its camera.
    #[error("{found} numbers, but {expected} are needed")]
    Numbers {
        /// Expected number.
        expected: usize,
        /// Number given.
        found: usize,
    },
    /// The grid of an exact integral has no points.
    #[error("cells = 0: the grid needs at least one point per pixel")]
    NoCells,
    /// The camera cannot be used.
    #[error(transparent)]
    Camera(#[from] CameraError),
}
