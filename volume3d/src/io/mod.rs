//! Files: scenes, meshes, images and arrays, read and written.
//!
//! Every reader returns a value or an [`Error`] that names the file and, if applicable, the line or the
//! element; none panics, and none allocates more than the file is long enough to hold. Every writer is
//! atomic: a file is at every moment what it was before, or complete.
//!
//! | what | read | written |
//! |---|---|---|
//! | scenes | Mitsuba XML, of which [`mitsuba`] says what is understood: [`load_scene`] | the same, with its meshes and textures: [`write_scene`] |
//! | meshes | OBJ, PLY, also gzipped: [`load_mesh`]; Mitsuba's `serialized`: [`parse_serialized`] | OBJ, PLY: [`write_obj`], [`write_ply`] |
//! | images | PNG, JPEG, OpenEXR, Radiance HDR: [`load_image`], [`read_exr`] | OpenEXR, PNG: [`write_exr`], [`write_png`], [`write_signed_png`] |
//! | arrays | NPY: [`read_npy`] | NPY: [`write_npy`] |
//! | grids of signed distances | Mitsuba's binary volumes: [`read_sdf`] | the same: [`write_sdf`] |
//! | pictures with masks and cameras | folders as [`dtu`] says: [`dtu::read_views`] | |
//! | pictures with cameras | NeRF's `transforms.json`, COLMAP, DTU, sensors of Mitsuba: [`views::Views`] | |
//! | networks | safetensors: [`read_network`] | the same: [`write_network`] |

pub mod dtu;
mod error;
mod files;
#[doc(hidden)]
pub mod fuzz;
mod image;
mod memory;
pub mod mitsuba;
mod network;
mod npy;
mod npz;
mod obj;
mod ply;
mod polygon;
mod sdf;
mod serialized;
mod soup;
pub mod views;

#[cfg(test)]
mod tests;

use std::path::Path;

pub use self::error::{
    ArrayProblem, At, DtuProblem, Error, GridProblem, ImageProblem, MemoryError, MeshProblem, NetworkProblem,
    Place, SceneProblem, ViewsProblem,
};
pub use self::files::{destination, read_bytes, read_text, write_bytes};
pub use self::image::{
    Encoding, covered, encode_png, encode_signed_png, image_size, load_image, load_image_over, read_exr,
    read_image, signed_colour, signed_range, write_animation, write_exr, write_exr_with_comments, write_png,
    write_png_with_comments, write_signed_png, write_signed_png_with_comments,
};
pub use self::mitsuba::{
    Note, PosedSensor, ReadOptions, load_scene, load_scene_with, load_sensors, read_scene, read_scene_with,
    write_scene,
};
pub use self::network::{parse_network, read_network, write_network};
pub use self::npy::{Array, Precision, parse_npy, read_npy, write_npy};
pub use self::obj::{read_obj, write_obj};
pub use self::ply::{read_ply, write_ply};
pub use self::sdf::{parse_sdf, read_sdf, write_sdf};
pub use self::serialized::parse_serialized;

use self::soup::Soup;
use crate::geometry::Mesh;

/// Reads a mesh from a file named `.ply`, `.obj`, `.ply.gz` or `.obj.gz`; see [`read_ply`] and [`read_obj`].
///
/// # Errors
/// [`Error::File`], [`Error::Extension`] or [`Error::Mesh`].
pub fn load_mesh(path: &Path) -> Result<Mesh, Error> {
    load_mesh_with_notes(path).map(|(mesh, _)| mesh)
}

/// [`load_mesh`], with notes on interpretations that may not be intended: faces that are not flat, or several
/// materials.
///
/// # Errors
/// As [`load_mesh`].
pub fn load_mesh_with_notes(path: &Path) -> Result<(Mesh, Vec<String>), Error> {
    let name = path.to_string_lossy().to_ascii_lowercase();
    let name = name.strip_suffix(".gz").unwrap_or(&name);
    let format = match name {
        name if name.ends_with(".ply") => MeshFormat::Ply,
        name if name.ends_with(".obj") => MeshFormat::Obj,
        _ => {
            let supported = ".ply, .obj, .ply.gz, .obj.gz";
            return Err(Error::Extension { path: path.to_path_buf(), supported });
        }
    };
    let mut soup = format.parse(&files::read(path)?, path)?;
    let notes = std::mem::take(&mut soup.notes);
    soup.into_mesh(false)
        .map(|mesh| (mesh, notes))
        .map_err(|e| Error::Mesh { place: Place::new(path, At::Whole), problem: MeshProblem::Geometry(e) })
}

#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum MeshFormat {
    Obj,
    Ply,
}

impl MeshFormat {
    /// Reads a file that may be gzipped.
    fn parse(self, bytes: &[u8], path: &Path) -> Result<Soup, Error> {
        const GZIP: &[u8] = &[0x1f, 0x8b];
        let parse = match self {
            Self::Obj => obj::parse,
            Self::Ply => ply::parse,
        };
        if bytes.starts_with(GZIP) { parse(&files::inflate(bytes, path)?, path) } else { parse(bytes, path) }
    }
}
