//! Exact integrals, from the arrangement of all edges.
//!
//! The edges of a scene cut the plane into faces in which one shade is visible. An [`Arrangement`]
//! triangulates them (constrained Delaunay triangulation), so that for box and tent filters every integral
//! over a pixel is a sum of polynomials over triangles and segments, for which Gauss–Legendre quadrature of
//! sufficient order is exact to rounding. The Gaussian filter is not polynomial; its cells are one σ wide,
//! where 8 points per side have an error below 10⁻¹².
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
//! and boundary = divergence by the divergence theorem. Where the derivative does not exist (two visible
//! edges that coincide and separate, or a moving edge on the edge of a box pixel), the result is an error
//! that names the place.

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

/// Reason why an exact integral is not available.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum ExactError {
    /// The crossings of edges, rounded to doubles, keep creating new crossings.
    #[error("the arrangement still had crossings after {rounds} rounds of splitting, near ({}, {})", at.x, at.y)]
    Noding {
        /// Number of rounds.
        rounds: usize,
        /// A remaining crossing.
        at: DVec2,
    },
    /// A node's coordinate is not 0 and not of magnitude 2⁻¹⁴² to 2²⁰¹.
    #[error("a coordinate of the arrangement is not 0 and not of magnitude 2⁻¹⁴² to 2²⁰¹")]
    Coordinate,
    /// Edges of two shapes coincide to working precision and move apart: the left derivative differs from the
    /// right one.
    #[error("not differentiable: edges of shapes {first} and {second} coincide at ({}, {}) and move apart", at.x, at.y)]
    EdgesPart {
        /// One of the shapes.
        first: usize,
        /// The other.
        second: usize,
        /// A point of the common edge.
        at: DVec2,
    },
    /// A moving edge lies on the edge of a box pixel.
    #[error("not differentiable: an edge of shape {shape} moves across the box filter's edge it lies on, at ({}, {})", at.x, at.y)]
    PixelEdge {
        /// The shape.
        shape: usize,
        /// A point of the edge.
        at: DVec2,
    },
    /// The number of velocities differs from the number of vertices, or one is not finite.
    #[error("{found} velocities for {expected} vertices, or one that is not finite")]
    Velocities {
        /// Number of vertices of the scene.
        expected: usize,
        /// Number of velocities given.
        found: usize,
    },
}
