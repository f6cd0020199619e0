//! Errors of reading a drawing, with positions.

use std::fmt;
use std::path::PathBuf;

#[cfg(doc)]
use super::MAX_COORDINATE;
use super::MIN_TOLERANCE;
use crate::plane::{PolygonError, SceneError, ShadeError};

/// An element of the file, with its position for the user.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Element {
    /// Its name, without a namespace.
    pub tag: String,
    /// Its id.
    pub id: Option<String>,
    /// The line where it starts, from 1.
    pub line: u32,
    /// The column where it starts, in characters, from 1.
    pub column: u32,
}

impl fmt::Display for Element {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let Self { tag, id, line, column } = self;
        match id {
            Some(id) => write!(f, "<{tag} id=\"{id}\"> at line {line}, column {column}"),
            None => write!(f, "<{tag}> at line {line}, column {column}"),
        }
    }
}

/// Reason why a drawing cannot be read.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum SvgError {
    /// The file cannot be opened, or is not UTF-8.
    #[error("{}: {source}", path.display())]
    Io {
        /// The file.
        path: PathBuf,
        /// The cause.
        source: std::io::Error,
    },
    /// The text is not well-formed XML.
    #[error("not well-formed: {message}")]
    Xml {
        /// The line, from 1.
        line: u32,
        /// The column, in characters, from 1.
        column: u32,
        /// The violation, with its position.
        message: String,
    },
    /// Something is drawn that a scene cannot represent.
    #[error("{element}: {what} is not supported")]
    Unsupported {
        /// The element that draws it.
        element: Element,
        /// The feature.
        what: String,
    },
    /// A value that does not parse, or a number beyond ±[`MAX_COORDINATE`].
    #[error("{element}: cannot read {name}=\"{value}\"")]
    Value {
        /// The element.
        element: Element,
        /// The attribute or style property.
        name: String,
        /// Its value, cut after 60 characters.
        value: String,
    },
    /// A path that is not a polygon even after its fill rule is resolved.
    #[error("{element}: {source}")]
    Polygon {
        /// The path.
        element: Element,
        /// The violation.
        source: PolygonError,
    },
    /// A gradient that is not a shade.
    #[error("{element}: {source}")]
    Shade {
        /// The element painted by the gradient.
        element: Element,
        /// The violation.
        source: ShadeError,
    },
    /// The root has no size, or usvg rejects the document as a whole.
    #[error("{message}")]
    Document {
        /// usvg's message.
        message: String,
    },
    /// A tolerance below [`MIN_TOLERANCE`], or not finite.
    #[error("tolerance {tolerance} is not a finite number of at least {MIN_TOLERANCE}")]
    Tolerance {
        /// The tolerance.
        tolerance: f64,
    },
    /// The shapes do not make a scene: the background is not finite.
    #[error(transparent)]
    Scene(#[from] SceneError),
    /// The drawing has no visible shape.
    #[error("the drawing has no visible shape")]
    Empty,
}
