//! What has no exact answer.

use crate::transport::{CameraError, TangentError};

/// An exact image or derivative that cannot be had.
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
        /// How many were asked for.
        bounces: usize,
    },
    /// The camera stands on a segment.
    #[error("the camera stands on segment {segment}, of shape {shape}")]
    CameraOnSegment {
        /// The shape.
        shape: usize,
        /// The segment, numbered through the whole world.
        segment: usize,
    },
    /// Not differentiable: a vertex that is seen on the edge of a pixel moves, and the filter jumps
    /// there.
    #[error(
        "not differentiable: vertex {vertex} moves across the box filter's edge it is seen on, at u = {u}"
    )]
    PixelEdge {
        /// The vertex, numbered through the whole world.
        vertex: usize,
        /// The film coordinate.
        u: f64,
    },
    /// Not differentiable: two vertices are seen at one film coordinate and part.
    #[error("not differentiable: vertices {} and {} are seen at the same u = {u} and part", vertices[0], vertices[1])]
    Coincide {
        /// Both vertices, numbered through the whole world.
        vertices: [usize; 2],
        /// The film coordinate.
        u: f64,
    },
    /// Panels are cut into at least 1 part and at most 1024.
    #[error("panels cut into {parts} parts, not into 1 to 1024")]
    Parts {
        /// The parts.
        parts: usize,
    },
    /// Radiosity is for surfaces without gloss.
    #[error("shape {shape} is glossy: radiosity knows diffuse surfaces only")]
    Glossy {
        /// The shape.
        shape: usize,
    },
    /// The system of infinitely many bounces was not solved to rounding.
    #[error("infinitely many bounces: the iteration stopped at a residual of {residual:e}")]
    NotConverged {
        /// The largest entry of the residual, a radiance or its rate.
        residual: f64,
    },
    /// Infinitely many bounces between surfaces that absorb nothing need not converge.
    #[error("shape {shape} reflects all light: infinitely many bounces need not converge")]
    NoAbsorption {
        /// The shape.
        shape: usize,
    },
}
