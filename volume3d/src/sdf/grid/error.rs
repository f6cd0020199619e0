//! Errors of grids.

use flatland::sdf::shapes::ShapeError;
use glam::DVec3;

/// Reason for rejecting a grid.
#[derive(Clone, Copy, Debug, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum GridError {
    /// An axis has fewer than two nodes.
    #[error("a grid of {} × {} × {} nodes has no cell; at least 2 × 2 × 2 are needed", size[0], size[1], size[2])]
    TooFew {
        /// Nodes along x, y and z.
        size: [usize; 3],
    },
    /// The number of node values does not match the size.
    #[error("{found} node values for {} × {} × {} nodes", size[0], size[1], size[2])]
    Count {
        /// Nodes along x, y and z.
        size: [usize; 3],
        /// Number of node values given.
        found: usize,
    },
    /// A node value is NaN or infinite.
    #[error("node ({}, {}, {}) is {value}; every node must be finite", node[0], node[1], node[2])]
    NotFinite {
        /// Position along x, y and z, from 0.
        node: [usize; 3],
        /// Its value.
        value: f64,
    },
    /// All nodes are positive, or none is.
    #[error(
        "every node is {sign}, so that the grid has no surface; values are positive outside and negative inside"
    )]
    OneSign {
        /// "positive", or "0 or negative".
        sign: &'static str,
    },
    /// The low corner is not finite, or a spacing not positive and finite.
    #[error(
        "invalid grid: the low corner {low} and the spacing {spacing} must be finite, and \
             the spacing positive along every axis"
    )]
    Place {
        /// The low corner.
        low: DVec3,
        /// The spacing along each axis.
        spacing: DVec3,
    },
}

impl From<GridError> for ShapeError {
    fn from(error: GridError) -> Self {
        let (value, wanted) = match error {
            GridError::Count { size, found } => {
                return Self::Count { expected: size.iter().product(), found };
            }
            GridError::NotFinite { value, .. } => (value, "finite"),
            GridError::OneSign { sign: "positive" } => {
                (1.0, "joined by one of the other sign: there is no surface")
            }
            GridError::OneSign { .. } => (-1.0, "joined by one of the other sign: there is no surface"),
            GridError::TooFew { .. } | GridError::Place { .. } => (f64::NAN, "on a grid"),
        };
        Self::Parameter { shape: "grid", parameter: "node value", value, wanted }
    }
}
