//! Why a grid of signed distances cannot be read or written.

use super::MemoryError;
use crate::sdf::GridError;

/// What is wrong with a grid's file.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum GridProblem {
    /// There is no room for it in memory.
    #[error(transparent)]
    Memory(#[from] MemoryError),
    /// The file is not of this format.
    #[error("not a Mitsuba volume: it does not begin with \"VOL\"")]
    Magic,
    /// A version of the format that is not read.
    #[error("version {found} of the volume format is not supported; expected 3")]
    Version {
        /// The version.
        found: u8,
    },
    /// The file ends within its header.
    #[error("the file ends after {found} bytes, within its header of 48")]
    Header {
        /// Bytes there are.
        found: usize,
    },
    /// Numbers of another type.
    #[error("numbers of type {found} are not supported; write float32, type 1")]
    Type {
        /// The type.
        found: i32,
    },
    /// More than one number, or none, for every node.
    #[error("{found} channels; a grid of distances has 1")]
    Channels {
        /// How many.
        found: i32,
    },
    /// A negative number of nodes.
    #[error("a size of {} × {} × {} nodes", size[0], size[1], size[2])]
    Size {
        /// Nodes along x, y and z.
        size: [i32; 3],
    },
    /// The file is shorter or longer than its size says.
    #[error(
        "{} × {} × {} nodes take {expected} bytes, but the file has {found}", size[0], size[1], size[2]
    )]
    Length {
        /// Nodes along x, y and z.
        size: [usize; 3],
        /// Bytes of the whole file.
        expected: u128,
        /// Bytes there are.
        found: usize,
    },
    /// The numbers are no grid of distances.
    #[error(transparent)]
    Grid(#[from] GridError),
    /// The box is so far from the origin that single precision moves it.
    #[error(
        "float32 would move a corner of the box by {cells:.3} cells: the box is too far from the origin for cells so small"
    )]
    Far {
        /// Shift in cells.
        cells: f64,
    },
    /// A node or corner is beyond single precision.
    #[error("{what} {index} is {value}, which float32 cannot hold")]
    Single {
        /// "node", "low corner" or "high corner".
        what: &'static str,
        /// Its index.
        index: usize,
        /// Its value.
        value: f64,
    },
}
