//! Errors of network files.

use flatland::sdf::shapes::ShapeError;

use super::MemoryError;

/// Problem with a network file.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum NetworkProblem {
    /// The network does not fit into memory.
    #[error(transparent)]
    Memory(#[from] MemoryError),
    /// The file is too short for its header.
    #[error("the header takes {expected} bytes, but the file has {found}")]
    Truncated {
        /// The number of bytes of the length field and the header.
        expected: u128,
        /// The number of bytes in the file.
        found: usize,
    },
    /// The header is not a valid safetensors header.
    #[error("cannot understand the header: {0}")]
    Header(#[from] serde_json::Error),
    /// The length of the tensors does not match the header.
    #[error("the tensors take {expected} bytes, but the file has {found} for them")]
    Length {
        /// The number of bytes that the header declares.
        expected: usize,
        /// The number of bytes in the file.
        found: usize,
    },
    /// The metadata do not describe the architecture.
    #[error(
        "the metadata have no \"network\"; write \"sharpness=100 frequencies=0\" there, with the numbers it was trained with"
    )]
    NoArchitecture,
    /// The architecture in the metadata cannot be parsed.
    #[error("the metadata's \"network\": expected {expected}, found \"{found}\"")]
    Architecture {
        /// The expected syntax.
        expected: &'static str,
        /// The text found, cut after 60 characters.
        found: String,
    },
    /// A tensor of the network is missing.
    #[error("there is no tensor \"{tensor}\"")]
    Missing {
        /// Its name.
        tensor: String,
    },
    /// A tensor does not belong to the network.
    #[error("a network has no tensor \"{tensor}\"; expected layers.K.weight and layers.K.bias only")]
    Unexpected {
        /// Its name, cut after 60 characters.
        tensor: String,
    },
    /// The element type is not supported.
    #[error("\"{tensor}\" has numbers of type {found}, which are not supported; save as F32 or F64")]
    Type {
        /// Its name.
        tensor: String,
        /// The type.
        found: String,
    },
    /// The shape of a tensor does not match the network.
    #[error("\"{tensor}\" has the shape {found:?}; expected {expected:?}")]
    Shape {
        /// Its name.
        tensor: String,
        /// Rows and columns of a weight, rows of a bias.
        expected: Vec<usize>,
        /// The shape found.
        found: Vec<usize>,
    },
    /// A weight is NaN or infinite.
    #[error("number {index} of \"{tensor}\" (from 0, row by row) is {value}; all must be finite")]
    NotFinite {
        /// The tensor's name.
        tensor: String,
        /// Its index in the tensor.
        index: usize,
        /// Its value.
        value: f64,
    },
    /// The sizes do not form a valid network.
    #[error(transparent)]
    Network(#[from] ShapeError),
    /// The header cannot be written.
    #[error("cannot write the tensors: {0}")]
    Write(#[from] safetensors::SafeTensorError),
}
