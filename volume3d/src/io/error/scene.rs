//! Errors of scene files.

use std::path::PathBuf;

use super::Place;
use crate::sdf::{BakeError, GridError};

/// Problem at one location of a scene.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum SceneProblem {
    /// An unknown element in its parent.
    #[error("<{tag}> is not supported inside {parent}; supported: {supported}")]
    Tag {
        /// The element.
        tag: String,
        /// The parent element.
        parent: String,
        /// The supported elements.
        supported: String,
    },
    /// A ball that does not fit into its grid.
    #[error("there is no such grid: {0}")]
    Grid(GridError),
    /// A network without a surface.
    #[error("the network cannot be put on a grid: {0}")]
    Network(BakeError),
    /// Text between elements.
    #[error("unexpected text \"{text}\" between elements; remove it")]
    Text {
        /// The text.
        text: String,
    },
    /// An unknown attribute.
    #[error("<{tag}> has no attribute \"{attribute}\"; supported: {supported}")]
    Attribute {
        /// The element.
        tag: String,
        /// The attribute.
        attribute: String,
        /// The supported attributes.
        supported: String,
    },
    /// A required attribute is missing.
    #[error("<{tag}> needs an attribute \"{attribute}\"")]
    MissingAttribute {
        /// The element.
        tag: String,
        /// The attribute.
        attribute: &'static str,
    },
    /// An unknown plugin.
    #[error("{tag} \"{plugin}\" is not supported; supported: {supported}")]
    Plugin {
        /// The kind of plugin.
        tag: &'static str,
        /// Its type.
        plugin: String,
        /// The supported plugins.
        supported: &'static str,
    },
    /// A parameter that the plugin does not have.
    #[error("{plugin} has no parameter \"{name}\" here; supported: {supported}")]
    Parameter {
        /// The plugin.
        plugin: String,
        /// The parameter.
        name: String,
        /// The supported parameters.
        supported: String,
    },
    /// A required parameter or nested element is missing.
    #[error("{plugin} needs {name}")]
    Missing {
        /// The plugin.
        plugin: String,
        /// The name of the missing part.
        name: String,
    },
    /// A parameter given by the wrong kind of element.
    #[error("parameter \"{name}\" is given as <{found}>; expected {expected}")]
    Kind {
        /// The parameter.
        name: String,
        /// The element found.
        found: String,
        /// The allowed elements.
        expected: &'static str,
    },
    /// A value that cannot be parsed or is out of range.
    #[error("{name}=\"{value}\": expected {expected}")]
    Value {
        /// The parameter or attribute.
        name: String,
        /// Its value, cut after 60 characters.
        value: String,
        /// The allowed values.
        expected: &'static str,
    },
    /// A feature of Mitsuba that is not supported.
    #[error("{what} is not supported; {instead}")]
    Unsupported {
        /// The feature.
        what: String,
        /// The alternative.
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
    /// An id or a parameter given twice.
    #[error("{what} \"{name}\" was given before, at {first}")]
    Duplicate {
        /// "id" or "parameter".
        what: &'static str,
        /// Its name.
        name: String,
        /// The location of the first occurrence.
        first: Place,
    },
    /// Too many or too few elements.
    #[error("{found} {what} in {parent}; expected {expected}")]
    Count {
        /// The element.
        what: String,
        /// The parent element.
        parent: String,
        /// The number found.
        found: usize,
        /// The allowed number.
        expected: &'static str,
    },
    /// A file is in none of the search folders.
    #[error("cannot find \"{name}\"; looked for: {tried}")]
    NotFound {
        /// Its name in the scene.
        name: String,
        /// The paths tried.
        tried: String,
    },
    /// A reference to an unknown id.
    #[error("nothing has the id \"{id}\"; there are: {known}")]
    Reference {
        /// The id.
        id: String,
        /// The known ids.
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
    /// An unknown version of the file format.
    #[error("scene version \"{found}\" is not supported; expected 0.x to 3.x")]
    Version {
        /// The version, or empty.
        found: String,
    },
    /// A clipping plane of the camera cuts a visible surface.
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
        /// The shape most of which is cut.
        shape: String,
        /// The distance of its nearest or farthest visible point, along the optical axis.
        distance: f64,
    },
    /// A cyclic include.
    #[error("{} includes itself, at once or by way of the files between", path.display())]
    Cycle {
        /// The file.
        path: PathBuf,
    },
    /// Elements nested too deeply, or too many.
    #[error("more than {limit} {what}")]
    Limit {
        /// The counted quantity.
        what: &'static str,
        /// The maximum.
        limit: usize,
    },
}

/// A number rounded to four significant digits, for a message.
fn rounded(x: f64) -> f64 {
    format!("{x:.3e}").parse().unwrap_or(x)
}
