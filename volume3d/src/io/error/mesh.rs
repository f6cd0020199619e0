//! Why triangles cannot be read.

use super::MemoryError;
use crate::geometry::MeshError;

/// What is wrong with a file of triangles.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum MeshProblem {
    /// There is no room for it in memory.
    #[error(transparent)]
    Memory(#[from] MemoryError),
    /// Something else than what the format demands.
    #[error("expected {expected}, found \"{found}\"")]
    Expected {
        /// What should be there.
        expected: &'static str,
        /// What is there, cut after 60 characters.
        found: String,
    },
    /// The file ends too early.
    #[error("the file ends before {what}")]
    Truncated {
        /// What is missing.
        what: String,
    },
    /// The file goes on after its end.
    #[error("{bytes} bytes follow the last element that the header announces")]
    Trailing {
        /// How many.
        bytes: usize,
    },
    /// A face names what does not exist.
    #[error("the face refers to {what} {index}, but there are {count} so far")]
    Index {
        /// "vertex", "normal" or "texture coordinate".
        what: &'static str,
        /// The index as the file gives it.
        index: i64,
        /// How many there are.
        count: usize,
    },
    /// A face of fewer than three corners.
    #[error("a face of {corners} corners; a face needs at least 3")]
    Corners {
        /// How many corners there are.
        corners: usize,
    },
    /// A file of points only.
    #[error("there are no faces, only {vertices} vertices: nothing would be seen")]
    Faceless {
        /// Number of vertices.
        vertices: usize,
    },
    /// A list of texture coordinates that does not fit its face.
    #[error(
        "the list texcoord has {found} numbers for a face of {corners} corners; give two for each corner, or none"
    )]
    FaceCoordinates {
        /// How many numbers there are.
        found: usize,
        /// How many corners the face has.
        corners: usize,
    },
    /// An attribute that the file does not have.
    #[error("there is no attribute \"{name}\" of one or three numbers; the file has {known}")]
    Attribute {
        /// What it is called.
        name: String,
        /// What there is.
        known: String,
    },
    /// Something that the format knows and this program refuses.
    #[error("{what} is not supported; {instead}")]
    Unsupported {
        /// The feature.
        what: String,
        /// What to do instead.
        instead: &'static str,
    },
    /// The header announces no such thing.
    #[error("the header has no {what}")]
    Missing {
        /// What is missing.
        what: &'static str,
    },
    /// The numbers do not make a mesh.
    #[error(transparent)]
    Geometry(#[from] MeshError),
}
