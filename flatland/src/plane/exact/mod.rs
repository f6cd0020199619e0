//! Every integral of the theory, exactly: the arrangement of all edges and what follows from it.
//!
//! The edges of a scene cut the plane into faces in which one shade is visible. An [`Arrangement`]
//! triangulates them (constrained Delaunay triangulation), so that for box and tent filters every
//! integral over a pixel is a sum of polynomials over triangles and segments, for which
//! Gauss–Legendre quadrature of the right order is exact to rounding. The Gaussian filter is not
//! polynomial; its cells are one σ wide and 8 points a side leave an error below 10⁻¹².
//!
//! Per pixel p, with filter h:
//!
//! ```text
//! primal      ∫ h f du
//! interior    ∫ h ∂f/∂θ du
//! boundary    ∮ h Δf (v·ν) dl                         visible parts only
//! divergence  ∫ ∇·(V h f) du  −  ∮ f (V·n) dl        V: the oracle field; n: pixel edge (box only)
//! ```
//!
//! and boundary = divergence by the divergence theorem. Where the derivative does not exist, two
//! visible edges that coincide and part, or a moving edge on the edge of a box pixel, the answer is
//! an error that names the place.

mod arrangement;
mod harmonic;
mod integrals;
mod noding;
mod oracle;
mod quadrature;

pub use arrangement::{Arrangement, Boundary};
pub use harmonic::HarmonicField;
pub use oracle::OracleField;

use glam::DVec2;

/// An exact integral that cannot be had.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum ExactError {
    /// The edges' crossings, rounded to doubles, keep creating new crossings.
    #[error("the arrangement still had crossings after {rounds} rounds of splitting, near ({}, {})", at.x, at.y)]
    Noding {
        /// How many rounds were made.
        rounds: usize,
        /// A crossing that was left.
        at: DVec2,
    },
    /// A node's coordinate is not 0 and not of magnitude 2⁻¹⁴² to 2²⁰¹.
    #[error("a coordinate of the arrangement is not 0 and not of magnitude 2⁻¹⁴² to 2²⁰¹")]
    Coordinate,
    /// Edges of two shapes coincide to working precision and move apart: the derivative from the
    /// left differs from the derivative from the right.
    #[error("not differentiable: edges of shapes {first} and {second} coincide at ({}, {}) and move apart", at.x, at.y)]
    EdgesPart {
        /// One of the shapes.
        first: usize,
        /// The other.
        second: usize,
        /// A point of the common edge.
        at: DVec2,
    },
    /// A moving edge lies on the edge of a pixel whose filter jumps there.
    #[error("not differentiable: an edge of shape {shape} moves across the box filter's edge it lies on, at ({}, {})", at.x, at.y)]
    PixelEdge {
        /// The shape.
        shape: usize,
        /// A point of the edge.
        at: DVec2,
    },
    /// Not one velocity per vertex, or one that is not finite.
    #[error("{found} velocities for {expected} vertices, or one that is not finite")]
    Velocities {
        /// The scene's vertices.
        expected: usize,
        /// The velocities given.
        found: usize,
    },
}
