//! Errors of worlds.

/// Reason for rejecting a world.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum WorldError {
    /// An open shape needs two points, a closed one three.
    #[error("shape {shape} has {found} points, too few for a shape of its kind")]
    TooFewPoints {
        /// The shape.
        shape: usize,
        /// Number of its points.
        found: usize,
    },
    /// A point that is NaN or infinite.
    #[error("point {point} of shape {shape} is not finite")]
    NotFinite {
        /// The shape.
        shape: usize,
        /// The point.
        point: usize,
    },
    /// Two consecutive points coincide.
    #[error("segment {segment} of shape {shape} has no length")]
    NoLength {
        /// The shape.
        shape: usize,
        /// The segment.
        segment: usize,
    },
    /// Two segments cross or touch, other than consecutive segments of a shape at their common point.
    /// Visibility at such a place has no derivative when they separate.
    #[error(
        "segment {} of shape {} meets segment {} of shape {}: they may share no point but that of consecutive segments",
        first[1], first[0], second[1], second[0]
    )]
    Meet {
        /// Indices of shape and segment.
        first: [usize; 2],
        /// Indices of shape and segment.
        second: [usize; 2],
    },
    /// A material with a parameter out of range.
    #[error("the material of shape {shape}: {what}")]
    Material {
        /// The shape.
        shape: usize,
        /// The violation.
        what: &'static str,
    },
    /// The environment's radiance is negative or not finite.
    #[error("the environment's radiance {environment} is negative or not finite")]
    Environment {
        /// The radiance.
        environment: f64,
    },
}
