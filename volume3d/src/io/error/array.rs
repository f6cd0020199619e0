//! Why an array cannot be read or written.

use super::MemoryError;

/// What is wrong with a NumPy array.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum ArrayProblem {
    /// There is no room for it in memory.
    #[error(transparent)]
    Memory(#[from] MemoryError),
    /// The file is no NPY file, or one of an unknown version.
    #[error("not an NPY file of version 1, 2 or 3")]
    Magic,
    /// The header cannot be understood.
    #[error("cannot understand the header: expected {expected}")]
    Header {
        /// What should be there.
        expected: &'static str,
    },
    /// The numbers are of a type that is not read.
    #[error("numbers of type \"{found}\" are not supported; save as float32 or float64")]
    Type {
        /// The type as the file gives it.
        found: String,
    },
    /// The array is stored column by column.
    #[error("Fortran order is not supported; save numpy.ascontiguousarray(array)")]
    FortranOrder,
    /// The file is shorter or longer than its shape says, or the values are.
    #[error("the shape asks for {expected}, but there are {found}")]
    Length {
        /// Bytes in a file, numbers in memory.
        expected: String,
        /// How many there are.
        found: usize,
    },
}
