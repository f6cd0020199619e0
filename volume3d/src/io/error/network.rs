//! Why a network cannot be read or written.

use flatland::sdf::shapes::ShapeError;

use super::MemoryError;

/// What is wrong with a network's file.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum NetworkProblem {
    /// There is no room for it in memory.
    #[error(transparent)]
    Memory(#[from] MemoryError),
    /// The file is too short for its header.
    #[error("the header takes {expected} bytes, but the file has {found}")]
    Truncated {
        /// Bytes that the length and the header take.
        expected: u128,
        /// Bytes there are.
        found: usize,
    },
    /// The header is not that of a safetensors file.
    #[error("cannot understand the header: {0}")]
    Header(#[from] serde_json::Error),
    /// The tensors are shorter or longer than the header says.
    #[error("the tensors take {expected} bytes, but the file has {found} for them")]
    Length {
        /// Bytes that the header announces.
        expected: usize,
        /// Bytes there are.
        found: usize,
    },
    /// The metadata do not say what the weights are for.
    #[error(
        "the metadata have no \"network\"; write \"sharpness=100 frequencies=0\" there, with the numbers it was trained with"
    )]
    NoArchitecture,
    /// The metadata say what cannot be understood.
    #[error("the metadata's \"network\": expected {expected}, found \"{found}\"")]
    Architecture {
        /// What should be there.
        expected: &'static str,
        /// What is there, cut after 60 characters.
        found: String,
    },
    /// A tensor that the network needs is not there.
    #[error("there is no tensor \"{tensor}\"")]
    Missing {
        /// Its name.
        tensor: String,
    },
    /// A tensor that is no part of a network.
    #[error("a network has no tensor \"{tensor}\"; expected layers.K.weight and layers.K.bias only")]
    Unexpected {
        /// Its name, cut after 60 characters.
        tensor: String,
    },
    /// Numbers of a type that is not read.
    #[error("\"{tensor}\" has numbers of type {found}, which are not supported; save as F32 or F64")]
    Type {
        /// Its name.
        tensor: String,
        /// The type.
        found: String,
    },
    /// A tensor has another shape than its place in the network asks for.
    #[error("\"{tensor}\" has the shape {found:?}; expected {expected:?}")]
    Shape {
        /// Its name.
        tensor: String,
        /// Rows and columns of a weight, rows of a bias.
        expected: Vec<usize>,
        /// The shape it has.
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
    /// The sizes are none of a network.
    #[error(transparent)]
    Network(#[from] ShapeError),
    /// The header cannot be written.
    #[error("cannot write the tensors: {0}")]
    Write(#[from] safetensors::SafeTensorError),
}
