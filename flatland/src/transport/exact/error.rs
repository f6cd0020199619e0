//! Errors of exact integrals.

use crate::transport::{CameraError, TangentError};

/// Reason why an exact image or derivative is not available.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum ExactError {
    /// The camera cannot be used.
    #[error(transparent)]
    Camera(#[from] CameraError),
    /// The change does not fit the world.
    #[error(transparent)]
    Tangent(#[from] TangentError),
    /// The tolerance is not in [10⁻¹⁴, 1).
    #[error("the tolerance {tolerance} is not in [1e-14, 1)")]
    Tolerance {
        /// The tolerance.
        tolerance: f64,
    },
    /// Closed forms exist for light that is scattered at most once.
    #[error("{bounces} bounces: closed forms exist for 0 and 1, and radiosity for diffuse surfaces")]
    Bounces {
        /// Number of bounces requested.
        bounces: usize,
    },
    /// The camera is on a segment.
    #[error("the camera stands on segment {segment}, of shape {shape}")]
    CameraOnSegment {
        /// The shape.
        shape: usize,
        /// Index of the segment in the whole world.
        segment: usize,
    },
    /// Not differentiable: a moving vertex is seen on the edge of a box pixel.
    #[error(
        "not differentiable: vertex {vertex} moves across the box filter's edge it is seen on, at u = {u}"
    )]
    PixelEdge {
        /// Index of the vertex in the whole world.
        vertex: usize,
        /// The film coordinate.
        u: f64,
    },
    /// Not differentiable: two vertices are seen at one film coordinate and separate.
    #[error("not differentiable: vertices {} and {} are seen at the same u = {u} and part", vertices[0], vertices[1])]
    Coincide {
        /// Indices of both vertices in the whole world.
        vertices: [usize; 2],
        /// The film coordinate.
        u: f64,
    },
    /// Panels may be cut into 1 to 1024 parts.
    #[error("panels cut into {parts} parts, not into 1 to 1024")]
    Parts {
        /// The parts.
        parts: usize,
    },
    /// Radiosity supports only surfaces without gloss.
    #[error("shape {shape} is glossy: radiosity knows diffuse surfaces only")]
    Glossy {
        /// The shape.
        shape: usize,
    },
    /// The system of infinitely many bounces did not converge to rounding.
    #[error("infinitely many bounces: the iteration stopped at a residual of {residual:e}")]
    NotConverged {
        /// Largest entry of the residual, a radiance or its rate.
        residual: f64,
    },
    /// Infinitely many bounces between surfaces without absorption need not converge.
    #[error("shape {shape} reflects all light: infinitely many bounces need not converge")]
    NoAbsorption {
        /// The shape.
        shape: usize,
    },
}
