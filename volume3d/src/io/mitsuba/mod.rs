//! Scenes of Mitsuba, all versions.
//!
//! Supported elements have the meaning of Mitsuba 3 (version 3.9, RGB variants); an unsupported plugin or
//! parameter is an error with its line, and all errors are reported together. Interpretations that may not be
//! intended are [noted](Note). Nothing is dropped silently.
//!
#![doc = include_str!("support.md")]
//!
//! - `sdfgrid` has `filename` and a `to_world` without shear. Two parameters are extensions: `interpolation`,
//!   `cubic` (default) or `trilinear` (Mitsuba's, which biases gradients), and `use_grid_bbox`, which places
//!   the grid in the file's bounding box instead of [0, 1]³. A grid without a file, also an extension, is a
//!   ball with a `radius` in `cells` (16) between `low` and `high` (−1 and 1).
//! - `sdfnetwork`, an extension, is a [network](crate::sdf::network) from `filename` (safetensors), [on a
//!   grid](crate::sdf::Baked) of `cells` (64) between `low` and `high` (−1 and 1). If `itself` is true, the
//!   [network itself](crate::sdf::Guided) is traced with the grid as a guide, a hundred times slower; with 0
//!   cells without a guide, slower still. `to_world` is as above. Without a file it is a new network
//!   initialised to a ball: `hidden` (4), `width` (64), `sharpness` (100), `frequencies` (0), `radius` (0.5),
//!   `seed`.
//!
//! `default`, `$name`, `include`, `path`, `alias`, `ref` and all transforms are supported. Files are searched
//! in the folders of `<path>`, the last first, then next to the main file, then next to the file that refers
//! to them. Files of versions before 2 are upgraded as by Mitsuba: names in camelCase, `uscale` and similar.
//! A checkerboard of numbers, as for `roughness` or `opacity`, has its two values exchanged, as in Mitsuba
//! 3.9.
//!
//! # Deviations from Mitsuba
//!
//! [`guide::deviations`](crate::guide::deviations) lists everything with a different meaning here, with the
//! size of the difference, and what is refused; a test of this reader has a scene for each.

mod alpha;
mod animation;
mod attribute;
mod bsdf;
mod cie;
mod clip;
mod curve;
mod dielectric;
mod document;
mod element;
mod emitter;
mod film;
mod folders;
mod harmless;
mod implicit;
mod instance;
mod integrator;
mod journal;
mod knots;
mod medium;
mod mesh_attribute;
mod metals;
mod object;
mod orthographic;
mod posed_sensor;
mod power;
mod principled;
mod reader;
mod scene;
mod sensor;
mod shape;
mod spectrum;
mod spot;
mod steps;
mod substitute;
mod support;
mod texture;
mod transform;
mod upgrade;
mod values;
mod variables;
mod write;
mod write_bsdf;
mod write_light;
mod write_medium;
mod write_texture;

pub use self::journal::Note;
pub(super) use self::posed_sensor::parse_sensors;
pub use self::posed_sensor::{PosedSensor, load_sensors};
pub use self::support::support_table;
pub use self::write::write_scene;

use std::path::Path;
use std::rc::Rc;

use self::document::Document;
use self::journal::Journal;
use self::reader::Reader;
use self::variables::Variables;
use super::{Error, files};
use crate::scene::Description;

/// Options of the scene reader.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct ReadOptions {
    /// Values for the `$name`s of the scene, which take precedence over its `<default>`s.
    pub variables: Vec<(String, String)>,
    /// Columns and rows of the film, instead of those in the scene. The field of view is kept along the axis
    /// to which the scene's `fov` refers.
    pub size: Option<(usize, usize)>,
    /// Whether unsupported parts are replaced or ignored, with a [`Note`] each, instead of an error: a
    /// material by a grey diffuse one or its diffuse part, metal by metal and glass by glass with all
    /// readable parameters, an integrator by `path`, a sensor by `perspective`. The image then differs from
    /// that of the scene. Invalid parts are ignored, too.
    pub is_lenient: bool,
}

/// Reads a Mitsuba scene and all files it names.
///
/// # Errors
/// [`Error`], with the line.
pub fn load_scene(path: &Path) -> Result<Description, Error> {
    load_scene_with(path, &[])
}

/// [`load_scene`] with values for the `$name`s of the scene, which take precedence over its `<default>`s.
///
/// # Errors
/// [`Error`], with the line; also if a name does not occur.
pub fn load_scene_with(path: &Path, variables: &[(String, String)]) -> Result<Description, Error> {
    read_scene(&files::read(path)?, path, variables, &|path| files::read_bytes(path))
}

/// [`load_scene_with`] from memory. `path` is for messages, and other files are searched next to it; `open`
/// reads them.
///
/// # Errors
/// [`Error`], with the line.
pub fn read_scene(
    bytes: &[u8],
    path: &Path,
    variables: &[(String, String)],
    open: &dyn Fn(&Path) -> std::io::Result<Vec<u8>>,
) -> Result<Description, Error> {
    let options = ReadOptions { variables: variables.to_vec(), ..ReadOptions::default() };
    read_scene_with(bytes, path, &options, open).map(|(description, _)| description)
}

/// [`read_scene`], with notes on interpretations that may not be intended.
///
/// # Errors
/// [`Error::Several`] with all errors, each with file, line and column, or the single error.
pub fn read_scene_with(
    bytes: &[u8],
    path: &Path,
    options: &ReadOptions,
    open: &dyn Fn(&Path) -> std::io::Result<Vec<u8>>,
) -> Result<(Description, Vec<Note>), Error> {
    let journal = Rc::new(Journal::new(options.is_lenient));
    let document = Document::parse(bytes, path, Variables::new(&options.variables), open, journal)?;
    Reader::new(&document, open).read(options.size)
}
