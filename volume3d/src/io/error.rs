//! Why a file cannot be read or written, and where.

use std::fmt;
use std::path::{Path, PathBuf};

use crate::geometry::MeshError;

/// Where in a file.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Place {
    /// The file.
    pub path: PathBuf,
    /// Where in it.
    pub at: At,
}

/// Where in a file whose name is known.
#[derive(Clone, Debug, PartialEq, Eq)]
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
}

/// What is wrong at one place of a scene.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum SceneProblem {
    /// An element that is not known where it stands.
    #[error("<{tag}> is not supported inside {parent}; supported: {supported}")]
    Tag {
        /// The element.
        tag: String,
        /// Where it stands.
        parent: String,
        /// What may stand there.
        supported: String,
    },
    /// Text between elements.
    #[error("unexpected text \"{text}\" between elements; remove it")]
    Text {
        /// The text.
        text: String,
    },
    /// An attribute that is not known.
    #[error("<{tag}> has no attribute \"{attribute}\"; supported: {supported}")]
    Attribute {
        /// The element.
        tag: String,
        /// The attribute.
        attribute: String,
        /// What is supported.
        supported: String,
    },
    /// An attribute that must be given.
    #[error("<{tag}> needs an attribute \"{attribute}\"")]
    MissingAttribute {
        /// The element.
        tag: String,
        /// The attribute.
        attribute: &'static str,
    },
    /// A plugin that is not known.
    #[error("{tag} \"{plugin}\" is not supported; supported: {supported}")]
    Plugin {
        /// The kind of plugin.
        tag: &'static str,
        /// Its type.
        plugin: String,
        /// What is supported.
        supported: &'static str,
    },
    /// A parameter that a plugin does not have here.
    #[error("{plugin} has no parameter \"{name}\" here; supported: {supported}")]
    Parameter {
        /// The plugin.
        plugin: String,
        /// The parameter.
        name: String,
        /// What is supported.
        supported: String,
    },
    /// A parameter or nested element that must be given.
    #[error("{plugin} needs {name}")]
    Missing {
        /// The plugin.
        plugin: String,
        /// What is missing.
        name: String,
    },
    /// A parameter given by the wrong element.
    #[error("parameter \"{name}\" is given as <{found}>; expected {expected}")]
    Kind {
        /// The parameter.
        name: String,
        /// The element it is given as.
        found: String,
        /// The elements it may be given as.
        expected: &'static str,
    },
    /// A value that does not parse or is out of range.
    #[error("{name}=\"{value}\": expected {expected}")]
    Value {
        /// The parameter or attribute.
        name: String,
        /// Its value, cut after 60 characters.
        value: String,
        /// What it may be.
        expected: &'static str,
    },
    /// Something that Mitsuba knows and this program refuses.
    #[error("{what} is not supported; {instead}")]
    Unsupported {
        /// The feature.
        what: String,
        /// What to do instead.
        instead: &'static str,
    },
    /// Two parameters that exclude each other.
    #[error("{plugin} takes either {first} or {second}, not both")]
    Conflict {
        /// The plugin.
        plugin: String,
        /// One of them.
        first: &'static str,
        /// The other.
        second: &'static str,
    },
    /// An id or a parameter that is given twice.
    #[error("{what} \"{name}\" was given before, at {first}")]
    Duplicate {
        /// "id" or "parameter".
        what: &'static str,
        /// Its name.
        name: String,
        /// Where it was given first.
        first: Place,
    },
    /// More of something than there may be.
    #[error("{found} {what} in {parent}; expected {expected}")]
    Count {
        /// The element.
        what: String,
        /// Where it stands.
        parent: String,
        /// How many there are.
        found: usize,
        /// How many there may be.
        expected: &'static str,
    },
    /// A reference to what does not exist.
    #[error("nothing has the id \"{id}\"; there are: {known}")]
    Reference {
        /// The id.
        id: String,
        /// The ids that exist.
        known: String,
    },
    /// A `$name` without a value.
    #[error("${name} has no value: add <default name=\"{name}\" value=\"…\"/> before its first use")]
    Variable {
        /// The name.
        name: String,
    },
    /// A value for a `$name` that does not occur.
    #[error("the value given for ${name} is not used in the scene")]
    UnusedVariable {
        /// The name.
        name: String,
    },
    /// A scene of another version of the format.
    #[error(
        "scene version \"{found}\" is not supported; expected 3.x. (Scenes before version 2.0 write names in \
         camelCase: turn toWorld into to_world and so on, and set version=\"3.0.0\".)"
    )]
    Version {
        /// The version, or nothing.
        found: String,
    },
    /// A clipping plane of the camera that cuts something in view.
    #[error(
        "{name}=\"{value}\" cuts off shape \"{shape}\", which the film has in view at a distance of {} along the \
         optical axis; clipping is not supported: remove from the scene what is not to be seen, or leave {name} out \
         to see it",
        rounded(*distance)
    )]
    Clip {
        /// "near_clip" or "far_clip".
        name: &'static str,
        /// Its value.
        value: String,
        /// The shape of which most is cut.
        shape: String,
        /// The distance of its nearest or farthest point in view, along the optical axis.
        distance: f64,
    },
    /// A file that includes itself, or one that does.
    #[error("{} includes itself, at once or by way of the files between", path.display())]
    Cycle {
        /// The file.
        path: PathBuf,
    },
    /// Elements nested without end, or too many.
    #[error("more than {limit} {what}")]
    Limit {
        /// What is counted.
        what: &'static str,
        /// How many there may be.
        limit: usize,
    },
}

/// What is wrong with a file of triangles.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum MeshProblem {
    /// There is no room for it in memory.
    #[error(transparent)]
    Memory(#[from] MemoryError),
    /// Something else than what the format demands.
    #[error("expected {expected}, found \"{found}\"")]
    Expected {
        /// What should be there.
        expected: &'static str,
        /// What is there, cut after 60 characters.
        found: String,
    },
    /// The file ends too early.
    #[error("the file ends before {what}")]
    Truncated {
        /// What is missing.
        what: String,
    },
    /// The file goes on after its end.
    #[error("{bytes} bytes follow the last element that the header announces")]
    Trailing {
        /// How many.
        bytes: usize,
    },
    /// A face names what does not exist.
    #[error("the face refers to {what} {index}, but there are {count} so far")]
    Index {
        /// "vertex", "normal" or "texture coordinate".
        what: &'static str,
        /// The index as the file gives it.
        index: i64,
        /// How many there are.
        count: usize,
    },
    /// A face of fewer than three corners.
    #[error("a face of {corners} corners; a face needs at least 3")]
    Corners {
        /// How many corners there are.
        corners: usize,
    },
    /// Some corners have what others lack.
    #[error("some corners have {what} and others have none; give all or none")]
    Mixed {
        /// "normals" or "texture coordinates".
        what: &'static str,
    },
    /// Something that the format knows and this program refuses.
    #[error("{what} is not supported; {instead}")]
    Unsupported {
        /// The feature.
        what: String,
        /// What to do instead.
        instead: &'static str,
    },
    /// The header announces no such thing.
    #[error("the header has no {what}")]
    Missing {
        /// What is missing.
        what: &'static str,
    },
    /// The numbers do not make a mesh.
    #[error(transparent)]
    Geometry(#[from] MeshError),
}

/// What is wrong with an image.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum ImageProblem {
    /// There is no room for it in memory.
    #[error(transparent)]
    Memory(#[from] MemoryError),
    /// The file cannot be decoded or encoded.
    #[error("{0}")]
    Codec(#[from] image::ImageError),
    /// A PNG cannot be encoded.
    #[error("{0}")]
    Png(#[from] png::EncodingError),
    /// Not one of the formats that are read.
    #[error("not a PNG, OpenEXR or Radiance HDR image")]
    Format,
    /// An image without pixels, or with more than can be dealt with.
    #[error("{width}×{height} pixels; expected at least 1×1 and at most {limit} in all")]
    Size {
        /// Columns.
        width: usize,
        /// Rows.
        height: usize,
        /// The largest number of pixels.
        limit: usize,
    },
    /// The number of pixels is not that of the size.
    #[error("{found} pixels given for {width}×{height}")]
    Length {
        /// Columns.
        width: usize,
        /// Rows.
        height: usize,
        /// How many pixels there are.
        found: usize,
    },
    /// A pixel is NaN or infinite.
    #[error("the pixel in column {x}, row {y} (from the top left, from 0) is not finite")]
    NotFinite {
        /// Its column.
        x: usize,
        /// Its row.
        y: usize,
    },
    /// The file is too short for its size.
    #[error("{width}×{height} pixels are announced, which the file is too short for")]
    Truncated {
        /// Columns.
        width: usize,
        /// Rows.
        height: usize,
    },
    /// A pixel is negative where radiance is expected.
    #[error("the pixel in column {x}, row {y} (from the top left, from 0) is negative")]
    Negative {
        /// Its column.
        x: usize,
        /// Its row.
        y: usize,
    },
    /// A pixel is negative or above 1 where reflectance is expected.
    #[error("the pixel in column {x}, row {y} (from the top left, from 0) is outside [0, 1]")]
    Range {
        /// Its column.
        x: usize,
        /// Its row.
        y: usize,
    },
}

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

/// A number with four digits that count, for a message.
fn rounded(x: f64) -> f64 {
    format!("{x:.3e}").parse().unwrap_or(x)
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
