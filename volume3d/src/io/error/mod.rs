//! Why a file cannot be read or written, and where.

mod array;
mod dtu;
mod grid;
mod image;
mod mesh;
mod network;
mod scene;

use std::fmt;
use std::path::{Path, PathBuf};

pub use array::ArrayProblem;
pub use dtu::DtuProblem;
pub use grid::GridProblem;
pub use image::ImageProblem;
pub use mesh::MeshProblem;
pub use network::NetworkProblem;
pub use scene::SceneProblem;

/// Where in a file.
#[derive(Clone, Debug, PartialEq, Eq, Hash)]
pub struct Place {
    /// The file.
    pub path: PathBuf,
    /// Where in it.
    pub at: At,
}

/// Where in a file whose name is known.
#[derive(Clone, Debug, PartialEq, Eq, Hash)]
pub enum At {
    /// Nowhere in particular.
    Whole,
    /// A line of text, from 1.
    Line(usize),
    /// A line and a column in characters, both from 1.
    Column(usize, usize),
    /// One element of a binary file: what it is called there, and its index from 0.
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

/// Memory that cannot be had.
#[derive(Clone, Copy, Debug, PartialEq, Eq, thiserror::Error)]
#[error("{what} would take {bytes} bytes of memory, which cannot be had")]
pub struct MemoryError {
    /// What it is for.
    pub what: &'static str,
    /// How much.
    pub bytes: usize,
}

/// A file that cannot be read or written.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum Error {
    /// The operating system refuses.
    #[error("cannot {action} {}: {source}", path.display())]
    File {
        /// "read", "write", "decompress".
        action: &'static str,
        /// The file.
        path: PathBuf,
        /// Why.
        source: std::io::Error,
    },
    /// The name of a file does not tell how to read it.
    #[error("{}: cannot tell the format from the name; supported: {supported}", path.display())]
    Extension {
        /// The file.
        path: PathBuf,
        /// What is supported.
        supported: &'static str,
    },
    /// A scene that is not well-formed XML.
    #[error("{}: not well-formed XML: {source}", path.display())]
    Xml {
        /// The file.
        path: PathBuf,
        /// What is wrong, and where.
        source: roxmltree::Error,
    },
    /// A scene that is well-formed but cannot be understood.
    #[error("{place}: {problem}")]
    Scene {
        /// Where.
        place: Place,
        /// What is wrong there.
        problem: Box<SceneProblem>,
    },
    /// Several things in a scene that cannot be understood.
    #[error("{} problems:\n{}", problems.len(), lines(problems))]
    Several {
        /// All of them.
        problems: Vec<Error>,
    },
    /// A file that a scene names cannot be used.
    #[error("{place}: {source}")]
    Referenced {
        /// Where it is named.
        place: Place,
        /// What is wrong with it.
        source: Box<Error>,
    },
    /// A file of triangles that cannot be read.
    #[error("{place}: {problem}")]
    Mesh {
        /// Where.
        place: Place,
        /// What is wrong there.
        problem: MeshProblem,
    },
    /// An image that cannot be read or written.
    #[error("{}: {problem}", path.display())]
    Image {
        /// The file.
        path: PathBuf,
        /// What is wrong with it.
        problem: ImageProblem,
    },
    /// A NumPy array that cannot be read or written.
    #[error("{}: {problem}", path.display())]
    Array {
        /// The file.
        path: PathBuf,
        /// What is wrong with it.
        problem: ArrayProblem,
    },
    /// A grid of signed distances that cannot be read or written.
    #[error("{}: {problem}", path.display())]
    Grid {
        /// The file.
        path: PathBuf,
        /// What is wrong with it.
        problem: GridProblem,
    },
    /// Pictures with masks and cameras that cannot be read.
    #[error("{}: {problem}", path.display())]
    Dtu {
        /// The folder, or the file of cameras.
        path: PathBuf,
        /// What is wrong with it.
        problem: DtuProblem,
    },
    /// A network that cannot be read or written.
    #[error("{}: {problem}", path.display())]
    Network {
        /// The file.
        path: PathBuf,
        /// What is wrong with it.
        problem: NetworkProblem,
    },
    /// An implicit surface that is no grid, to be written.
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
