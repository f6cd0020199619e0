//! Scenes of Mitsuba, all versions.
//!
//! What is understood means what it means in Mitsuba 3 (version 3.9, RGB variants); whatever is not understood is an error
//! with its line, be it a plugin or a single parameter, and all errors are told at once. What is read in another way than it
//! may have been meant is [noted](Note). Nothing is dropped in silence.
//!
#![doc = include_str!("support.md")]
//!
//! - `sdfgrid` has `filename`, a `to_world` without shear, and two of our own: `interpolation`, `cubic` unless it is
//!   `trilinear`, which Mitsuba's is and which biases gradients, and `use_grid_bbox`, the file's box in place of [0, 1]³; or
//!   without a file, of our own, a ball of a `radius` in `cells` (16) between `low` and `high` (−1 and 1).
//! - `sdfnetwork`, of our own, is a [network](crate::sdf::network) with `filename` (safetensors), [on a
//!   grid](crate::sdf::Baked) of `cells` (64) between `low` and `high` (−1 and 1), or [itself](crate::sdf::Guided) with that as a guide if `itself`
//!   is true, a hundred times slower, or without any with 0 cells, slower still; `to_world` as above. Without a file it is a new one, about a ball: `hidden` (4), `width` (64), `sharpness` (100),
//!   `frequencies` (0), `radius` (0.5), `seed`.
//!
//! `default`, `$name`, `include`, `path`, `alias`, `ref` and all transforms are understood. Files are looked
//! for in the folders of `<path>`, the last first, then beside the main file, then beside the file that names
//! them. Files of versions before 2 are upgraded as Mitsuba does it: names in camelCase, `uscale` and the
//! like. A checkerboard that gives numbers, as of `roughness` or `opacity`, has them in each other's places,
//! as in Mitsuba 3.9.
//!
//! # Deviations from Mitsuba
//! - Spheres, disks and cylinders are meshes, within a [thousandth](crate::geometry::TOLERANCE) of their radius, with the
//!   normals of what they are meshes of. Derivatives are those of the meshes.
//! - Steps within a texture, of a `checkerboard` or with `filter_type` `nearest`, are narrow ramps: a step moves with its
//!   surface, and derivatives would miss its motion. A checkerboard's are 1/128 of its period wide.
//! - `bsplinecurve` and `linearcurve` are meshes, within a thousandth of the largest radius; their control points are moved by
//!   `to_world`, and their radii are not. Of a curve of lines, what a cone hides of the spheres beside it is left out, and other
//!   hidden parts are there. What looks into an open end sees the inside, which Mitsuba leaves out. A scene whose curves have
//!   more than 2²¹ vertices is refused.
//! - An `instance` is a copy with vertices of its own of every shape in its `shapegroup`, called by its own name and theirs.
//! - Spectra and named metals become linear RGB where they are read, by the CIE observer of 1931: under D65 unless they are
//!   of an emitter. `blackbody` is read too, which Mitsuba's RGB variants refuse.
//! - Where `eta` of `principled` is 1, its metal and its tint reflect as with an `eta` close to it; Mitsuba
//!   3.9 leaves them out.
//! - `<rotate>` is a rotation whatever the length of its axis; Mitsuba's is none unless that is 1. A note
//!   says so in every run.
//! - Corners of triangles without texture coordinates, in an OBJ or PLY file of which others have some, are
//!   at (0, 0), and those without normals have their triangle's; in Mitsuba both are undefined. A note says
//!   so in every run.
//! - The list `texcoord` of PLY faces, which Mitsuba refuses, is the texture coordinates of their corners.
//! - Facets of α = 0 are the smooth material, as `conductor` is of `roughconductor`; Mitsuba's have an α of
//!   10⁻⁴. Rough materials whose `int_ior` is their `ext_ior`, which Mitsuba refuses, have no boundary: light
//!   passes in a straight line, or the base of plastic is there alone.
//! - `direct` renders all direct light however many `emitter_samples` and `bsdf_samples` there are, as one
//!   of each does. Mitsuba 3.9 has the same image of lights with an extent, adds up point lights once for
//!   each of several `emitter_samples`, and leaves them out without any.
//! - `directional` emitters may have a `kappa`, the concentration of their lobe ([`Light::Directional`]).
//! - `perspective` sensors may have a `pixel_aspect`, 1 unless given: by how many more pixels an angle is shown along columns
//!   ([`Camera`](crate::scene::Camera)).
//! - What an `area` emits is textured as surfaces are, with steps as ramps.
//! - `dielectric` and the like have one colour for all of what they reflect, and a texture for `specular_transmittance` only.
//!   `bumpmap` and `normalmap` cannot be on a material that light passes, and their `flip_invalid_normals` and
//!   `use_shadowing_function` are true, as where they are not given.
//! - `mask` may be within `twosided`.
//! - `orthographic` sensors are perspective ones ten thousand half widths behind where they stand: what is ten widths before one
//!   is seen smaller by two thousandths. A scene of which something is behind the sensor, in view, is refused.
//! - `pplastic` is that of light without polarisation, as in Mitsuba's RGB variants.
//! - `blendbsdf` mixes materials without masks, reliefs and mixtures of their own, and `twosided` takes two of that kind that no
//!   light passes. Beside a smooth lobe Mitsuba 3.9 loses a part of the light of an ideal one (a mirror of weight 0.3 beside black counts 0.2); here
//!   it has its weight.
//! - A `mesh_attribute` of a PLY file is an image of two by two texels a triangle, and the mesh has texture coordinates for it in
//!   the place of its own: one surface has attributes or images. The fourth texel may be outside of [0, 1], where no
//!   triangle shows it; written as an image, it is read again with that mesh, refused with any other, and no parameter. Attributes of faces have steps between them, how these move is missed by
//!   derivatives, and a note says so. A number may have a name without `_x`, and colours in whole numbers are fractions of the
//!   largest, which Mitsuba takes as they are.
//! - `polarizer`, `circular` and `retarder` are what they are to light without polarisation, as in Mitsuba's RGB variants.
//! - A scene without a sensor has that of Mitsuba 2, which sees all of it along z.
//! - Integrators and films that resolve time (`transient_path` and the like) stand for the image of light at all times.
//! - A medium is left out where the integrator sees surfaces only, as `path` does, and within a surface that no light passes.
//!   Where it is seen it is `homogeneous`, by `sigma_t` and `albedo` with a `scale`, or by `sigma_s` and `sigma_a` as before
//!   version 2, each the same everywhere; `sigma_t` may be above 1, which Mitsuba 3 allows by the scale only. Without a phase
//!   function it is isotropic. What an emitter says of the medium around it is ignored: surfaces and the sensor say the same.
//! - An `<animation>` of transforms with a `time` each, as before version 3, is the transform at the time of the first sensor's
//!   shutter; one that moves while the shutter is open is refused, or leniently that of the middle.
//! - `aov` without another integrator shows the image of `path`. Leniently `sky` and `sunsky` are a constant sky of radiance 1.
//! - Plugins of shapes and materials may be written with other capitals, and `disney` is `principled`.
//! - `<rgb value="#rrggbb"/>` is a colour in sRGB, as in HTML; Mitsuba 3 refuses it. `<srgb>` is read as before version 2.
//! - A `to_uv` whose third column only has a translation is read as before version 3.9, which ignores that column.
//! - A transform that mirrors turns the triangles of a shape, so that what faced outwards still does.
//! - Without given normals, OBJ vertices of one `v` share a normal even where their `vt` differ; in Mitsuba a
//!   seam of texture coordinates is a crease.
//! - An `sdfgrid` is interpolated by a cubic spline unless it says otherwise, its normals are those of φ whatever `normals`
//!   says, and clip planes are not checked against it.
//! - Films see what is beyond their border, as with `sample_border`, whether it is set or not: a note says
//!   so in every run where it makes a difference, at pixels within the filter's radius of the border.
//! - Meshes emit from the front of their faces, Mitsuba's from where vertex normals point to: a note says
//!   so in every run where the two differ.
//! - Faces with dents are cut into triangles that do not leave them; Mitsuba makes fans around their first
//!   corner.
//! - An environment map may have any size; Mitsuba's has at least two columns and three rows.
//! - `near_clip` and `far_clip` cut nothing. A scene of which they would cut something that the film has in view is
//!   refused. Where they are not given there are none; Mitsuba then cuts at 0.01 and at 10000.
//! - Parameters that change noise, storage or time and not what is computed are accepted with any value, and ignored. So is
//!   `focus_distance` without a lens, and the alpha of `rgba`.
//! - The `prb`, `_reparam` and `_projective` integrators stand for the images they render, those of `path` (with
//!   `max_depth` 6 unless given, as there) and `direct`; how derivatives are computed is not said by the scene.
//!
//! [`Light::Directional`]: crate::scene::Light::Directional

mod alpha;
mod animation;
mod attribute;
mod beam;
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
mod power;
mod principled;
mod reader;
mod scene;
mod sensor;
mod shape;
mod spectrum;
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

/// How a scene is read.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct ReadOptions {
    /// Values for the `$name`s of the scene, which go before its `<default>`s.
    pub variables: Vec<(String, String)>,
    /// Columns and rows of the film, in the place of those that the scene gives. The field of view stays what it is along the
    /// axis to which the scene's `fov` refers.
    pub size: Option<(usize, usize)>,
    /// Whether what is not supported is replaced or left out, with a [`Note`] each, in the place of an error:
    /// a material by a grey diffuse one or by its diffuse part, metal by metal and glass by glass with what
    /// can be read of them, an integrator by `path`, a sensor by `perspective`. The image is then another
    /// one. What is wrong and not only unsupported is left out too.
    pub is_lenient: bool,
}

/// Reads a Mitsuba scene and all files it names.
///
/// # Errors
/// [`Error`], with the line.
pub fn load_scene(path: &Path) -> Result<Description, Error> {
    load_scene_with(path, &[])
}

/// [`load_scene`] with values for the `$name`s of the scene, which go before its `<default>`s.
///
/// # Errors
/// [`Error`], with the line; also if a name does not occur.
pub fn load_scene_with(path: &Path, variables: &[(String, String)]) -> Result<Description, Error> {
    read_scene(&files::read(path)?, path, variables, &|path| files::read_bytes(path))
}

/// [`load_scene_with`] from memory. `path` is for messages, and other files are looked for beside it;
/// `open` reads them.
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

/// [`read_scene`], with notes of what was read in another way than it may have been meant.
///
/// # Errors
/// [`Error::Several`] with all that is refused, each with file, line and column, or the one.
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
