//! Errors of worlds with mirrors, glass and openings.

/// Reason why a world of [`chain`](crate::chain) is invalid.
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
    /// Two surfaces meet other than at their ends.
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
    /// The number of numbers differs from the world's.
    #[error("{found} numbers for a world of {expected}")]
    Numbers {
        /// Expected number.
        expected: usize,
        /// Number given.
        found: usize,
    },
}
