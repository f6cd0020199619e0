//! Why a scene cannot be read.

use std::path::PathBuf;

use super::Place;
use crate::sdf::{BakeError, GridError};

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
    /// A ball that is not in its grid.
    #[error("there is no such grid: {0}")]
    Grid(GridError),
    /// A network that makes no surface.
    #[error("the network cannot be put on a grid: {0}")]
    Network(BakeError),
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
    /// A file that is in none of the folders it may be in.
    #[error("cannot find \"{name}\"; looked for: {tried}")]
    NotFound {
        /// Its name in the scene.
        name: String,
        /// The places where it may be.
        tried: String,
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
    /// A file of the format in a version that is not known.
    #[error("scene version \"{found}\" is not supported; expected 0.x to 3.x")]
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

/// A number with four digits that count, for a message.
fn rounded(x: f64) -> f64 {
    format!("{x:.3e}").parse().unwrap_or(x)
}
