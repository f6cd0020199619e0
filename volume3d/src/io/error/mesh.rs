//! Errors of mesh files.

use super::MemoryError;
use crate::geometry::MeshError;

/// Problem with a mesh file.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum MeshProblem {
    /// The mesh does not fit into memory.
    #[error(transparent)]
    Memory(#[from] MemoryError),
    /// Unexpected content.
    #[error("expected {expected}, found \"{found}\"")]
    Expected {
        /// The expected content.
        expected: &'static str,
        /// The content found, cut after 60 characters.
        found: String,
    },
    /// The file ends too early.
    #[error("the file ends before {what}")]
    Truncated {
        /// The missing part.
        what: String,
    },
    /// There is data after the end of the mesh.
    #[error("{bytes} bytes follow the last element that the header announces")]
    Trailing {
        /// The number of bytes after the end.
        bytes: usize,
    },
    /// A face refers to an element that does not exist.
    #[error("the face refers to {what} {index}, but there are {count} so far")]
    Index {
        /// "vertex", "normal" or "texture coordinate".
        what: &'static str,
        /// The index as in the file.
        index: i64,
        /// The number of elements.
        count: usize,
    },
    /// A face has fewer than three corners.
    #[error("a face of {corners} corners; a face needs at least 3")]
    Corners {
        /// The number of corners.
        corners: usize,
    },
    /// The file has points only.
    #[error("there are no faces, only {vertices} vertices: nothing would be seen")]
    Faceless {
        /// Number of vertices.
        vertices: usize,
    },
    /// The length of a list of texture coordinates does not match its face.
    #[error(
        "the list texcoord has {found} numbers for a face of {corners} corners; give two for each corner, or none"
    )]
    FaceCoordinates {
        /// The length of the list.
        found: usize,
        /// The number of corners of the face.
        corners: usize,
    },
    /// The file lacks the requested attribute.
    #[error("there is no attribute \"{name}\" of one or three numbers; the file has {known}")]
    Attribute {
        /// The requested name.
        name: String,
        /// The attributes in the file.
        known: String,
    },
    /// A feature of the format that is not supported.
    #[error("{what} is not supported; {instead}")]
    Unsupported {
        /// The feature.
        what: String,
        /// The alternative.
        instead: &'static str,
    },
    /// An element that the header does not declare.
    #[error("the header has no {what}")]
    Missing {
        /// The missing element.
        what: &'static str,
    },
    /// The numbers do not form a valid mesh.
    #[error(transparent)]
    Geometry(#[from] MeshError),
}
