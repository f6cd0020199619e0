//! What a scene may be refused for.

use crate::plane::PolygonError;
use crate::plane::shade::ShadeError;

/// A scene that cannot be used.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum SceneError {
    /// A shade with a bad coefficient.
    #[error("shape {shape}: {source}")]
    Shade {
        /// Which shape.
        shape: usize,
        /// What is wrong with it.
        source: ShadeError,
    },
    /// A displaced polygon that is not one.
    #[error("shape {shape}: {source}")]
    Polygon {
        /// Which shape.
        shape: usize,
        /// What is wrong with it.
        source: PolygonError,
    },
    /// The background is not finite.
    #[error("the background has a component that is not finite")]
    Background,
}
