//! Errors of reading and writing files, with their locations.

mod array;
mod dtu;
mod grid;
mod image;
mod mesh;
mod network;
mod scene;
mod views;

use std::fmt;
use std::path::{Path, PathBuf};

pub use array::ArrayProblem;
pub use dtu::DtuProblem;
pub use grid::GridProblem;
pub use image::ImageProblem;
pub use mesh::MeshProblem;
pub use network::NetworkProblem;
pub use scene::SceneProblem;
pub use views::ViewsProblem;

/// Location in a file.
#[derive(Clone, Debug, PartialEq, Eq, Hash)]
pub struct Place {
    /// The file.
    pub path: PathBuf,
    /// The location within the file.
    pub at: At,
}

/// Location within a file.
#[derive(Clone, Debug, PartialEq, Eq, Hash)]
pub enum At {
    /// The file as a whole.
    Whole,
    /// A line of text, from 1.
    Line(usize),
    /// A line and a column in characters, both from 1.
    Column(usize, usize),
    /// One element of a binary file: its name there, and its index from 0.
    Item(String, usize),
}

impl Place {
    pub(super) fn new(path: &Path, at: At) -> Self {
        Self { path: path.to_path_buf(), at }
    }
}

impl fmt::Display for Place {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let path = self.path.display();
        match &self.at {
            At::Whole => write!(f, "{path}"),
            At::Line(line) => write!(f, "{path}:{line}"),
            At::Column(line, column) => write!(f, "{path}:{line}:{column}"),
            At::Item(name, index) => write!(f, "{path}, {name} {index}"),
        }
    }
}

/// Failed memory allocation.
#[derive(Clone, Copy, Debug, PartialEq, Eq, thiserror::Error)]
#[error("{what} would take {bytes} bytes of memory, which cannot be had")]
pub struct MemoryError {
    /// The purpose.
    pub what: &'static str,
    /// The size in bytes.
    pub bytes: usize,
}

/// Error of reading or writing a file.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum Error {
    /// The operating system reports an error.
    #[error("cannot {action} {}: {source}", path.display())]
    File {
        /// "read", "write", "decompress".
        action: &'static str,
        /// The file.
        path: PathBuf,
        /// The cause.
        source: std::io::Error,
    },
    /// The file name has no supported extension.
    #[error("{}: cannot tell the format from the name; supported: {supported}", path.display())]
    Extension {
        /// The file.
        path: PathBuf,
        /// The supported extensions.
        supported: &'static str,
    },
    /// A scene is not well-formed XML.
    #[error("{}: not well-formed XML: {source}", path.display())]
    Xml {
        /// The file.
        path: PathBuf,
        /// The syntax error, with its location.
        source: roxmltree::Error,
    },
    /// A well-formed scene has an error.
    #[error("{place}: {problem}")]
    Scene {
        /// The location.
        place: Place,
        /// The problem.
        problem: Box<SceneProblem>,
    },
    /// A scene has several errors.
    #[error("{} problems:\n{}", problems.len(), lines(problems))]
    Several {
        /// The errors.
        problems: Vec<Error>,
    },
    /// A file referenced by a scene cannot be used.
    #[error("{place}: {source}")]
    Referenced {
        /// The location of the reference.
        place: Place,
        /// The cause.
        source: Box<Error>,
    },
    /// A mesh file cannot be read.
    #[error("{place}: {problem}")]
    Mesh {
        /// The location.
        place: Place,
        /// The problem.
        problem: MeshProblem,
    },
    /// An image cannot be read or written.
    #[error("{}: {problem}", path.display())]
    Image {
        /// The file.
        path: PathBuf,
        /// The problem.
        problem: ImageProblem,
    },
    /// A NumPy array cannot be read or written.
    #[error("{}: {problem}", path.display())]
    Array {
        /// The file.
        path: PathBuf,
        /// The problem.
        problem: ArrayProblem,
    },
    /// An SDF grid cannot be read or written.
    #[error("{}: {problem}", path.display())]
    Grid {
        /// The file.
        path: PathBuf,
        /// The problem.
        problem: GridProblem,
    },
    /// A DTU folder cannot be read.
    #[error("{}: {problem}", path.display())]
    Dtu {
        /// The folder, or the file of cameras.
        path: PathBuf,
        /// The problem.
        problem: DtuProblem,
    },
    /// The cameras of pictures cannot be read.
    #[error("{place}: {problem}")]
    Views {
        /// The location.
        place: Place,
        /// The problem.
        problem: Box<ViewsProblem>,
    },
    /// A network cannot be read or written.
    #[error("{}: {problem}", path.display())]
    Network {
        /// The file.
        path: PathBuf,
        /// The problem.
        problem: NetworkProblem,
    },
    /// An implicit surface to be written is neither a grid nor a network.
    #[error(
        "implicit surface `{shape}` is no grid or network, and there is no file format for others; sample it with `Grid::sampled`"
    )]
    NoFormat {
        /// The surface.
        shape: String,
    },
}

/// One message a line.
fn lines(problems: &[Error]) -> String {
    problems.iter().map(|problem| format!("  {problem}")).collect::<Vec<_>>().join("\n")
}

/// The beginning of a text, for a message.
pub(super) fn excerpt(text: &str) -> String {
    const LONGEST: usize = 60;
    let mut shown: String = text.chars().take(LONGEST).collect();
    if shown.len() < text.len() {
        shown.push('…');
    }
    shown
}
