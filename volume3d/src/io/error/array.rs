//! Errors of NumPy arrays.

use super::MemoryError;

/// Problem with a NumPy array.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum ArrayProblem {
    /// The array does not fit into memory.
    #[error(transparent)]
    Memory(#[from] MemoryError),
    /// The file is not an NPY file, or has an unknown version.
    #[error("not an NPY file of version 1, 2 or 3")]
    Magic,
    /// The header cannot be parsed.
    #[error("cannot understand the header: expected {expected}")]
    Header {
        /// The expected syntax.
        expected: &'static str,
    },
    /// The element type is not supported.
    #[error("numbers of type \"{found}\" are not supported; save as float32 or float64")]
    Type {
        /// The type as the file gives it.
        found: String,
    },
    /// The array is in Fortran (column-major) order.
    #[error("Fortran order is not supported; save numpy.ascontiguousarray(array)")]
    FortranOrder,
    /// The length of the file or of the values does not match the shape.
    #[error("the shape asks for {expected}, but there are {found}")]
    Length {
        /// Bytes in a file, numbers in memory.
        expected: String,
        /// The number found.
        found: usize,
    },
}
