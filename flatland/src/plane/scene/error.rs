//! Errors of scenes.

use crate::plane::PolygonError;
use crate::plane::shade::ShadeError;

/// Reason for rejecting a scene.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum SceneError {
    /// A shade has an invalid coefficient.
    #[error("shape {shape}: {source}")]
    Shade {
        /// Index of the shape.
        shape: usize,
        /// The violation.
        source: ShadeError,
    },
    /// A displaced polygon is invalid.
    #[error("shape {shape}: {source}")]
    Polygon {
        /// Index of the shape.
        shape: usize,
        /// The violation.
        source: PolygonError,
    },
    /// The background is not finite.
    #[error("the background has a component that is not finite")]
    Background,
}
