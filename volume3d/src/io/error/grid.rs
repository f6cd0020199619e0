//! Errors of SDF grid files.

use super::MemoryError;
use crate::sdf::GridError;

/// Problem with an SDF grid file.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum GridProblem {
    /// The grid does not fit into memory.
    #[error(transparent)]
    Memory(#[from] MemoryError),
    /// The file does not have this format.
    #[error("not a Mitsuba volume: it does not begin with \"VOL\"")]
    Magic,
    /// The version of the format is not supported.
    #[error("version {found} of the volume format is not supported; expected 3")]
    Version {
        /// The version.
        found: u8,
    },
    /// The file ends within its header.
    #[error("the file ends after {found} bytes, within its header of 48")]
    Header {
        /// The number of bytes in the file.
        found: usize,
    },
    /// The element type is not supported.
    #[error("numbers of type {found} are not supported; write float32, type 1")]
    Type {
        /// The type.
        found: i32,
    },
    /// The number of channels per node is not one.
    #[error("{found} channels; a grid of distances has 1")]
    Channels {
        /// The number of channels.
        found: i32,
    },
    /// The number of nodes is negative.
    #[error("a size of {} × {} × {} nodes", size[0], size[1], size[2])]
    Size {
        /// Nodes along x, y and z.
        size: [i32; 3],
    },
    /// The length of the file does not match its size.
    #[error(
        "{} × {} × {} nodes take {expected} bytes, but the file has {found}", size[0], size[1], size[2]
    )]
    Length {
        /// Nodes along x, y and z.
        size: [usize; 3],
        /// Bytes of the whole file.
        expected: u128,
        /// The number of bytes in the file.
        found: usize,
    },
    /// The numbers are not an SDF grid.
    #[error(transparent)]
    Grid(#[from] GridError),
    /// The box is so far from the origin that rounding to single precision moves it.
    #[error(
        "float32 would move a corner of the box by {cells:.3} cells: the box is too far from the origin for cells so small"
    )]
    Far {
        /// Shift in cells.
        cells: f64,
    },
    /// A node or corner exceeds the range of single precision.
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
