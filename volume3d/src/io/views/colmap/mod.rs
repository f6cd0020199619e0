//! COLMAP models: cameras and the images that they took.
//!
//! A point x is at R x + t in the axes of an image's camera, with R the rotation by its quaternion; a
//! pinhole sees (x, y, z) there at f_x x/z + c_x, f_y y/z + c_y, with the middle of the top left pixel at
//! (½, ½). Formats: <https://colmap.github.io/format.html>.

mod binary;
mod model;
mod text;

use std::collections::BTreeMap;
use std::path::{Path, PathBuf};

use glam::{DMat3, DQuat, DVec3};

use self::model::Model;
use super::frame::{Frame, Lens};
use crate::io::{At, Error, Place, ViewsProblem, files};

/// A camera as stored.
#[derive(Clone, Debug)]
struct CameraRecord {
    at: At,
    model: &'static Model,
    size: (u64, u64),
    parameters: Vec<f64>,
}

/// An image as stored.
#[derive(Clone, Debug)]
struct ImageRecord {
    at: At,
    /// w, x, y, z.
    quaternion: [f64; 4],
    translation: [f64; 3],
    camera: u32,
    name: String,
}

/// The frames of a model, and its files.
pub(super) struct ModelFiles {
    pub(super) frames: Vec<Frame>,
    pub(super) cameras: PathBuf,
    pub(super) images: PathBuf,
}

/// Reads a model: binary if it has both files, otherwise text.
pub(super) fn read(folder: &Path) -> Result<ModelFiles, Error> {
    let named =
        |extension: &str| ["cameras", "images"].map(|name| folder.join(format!("{name}.{extension}")));
    let binary = named("bin");
    let is_binary = binary.iter().all(|path| path.exists());
    let [cameras, images] = if is_binary { binary } else { named("txt") };
    if !is_binary && !cameras.exists() {
        let expected = "cameras.bin and images.bin, or cameras.txt and images.txt, which COLMAP writes to a folder such as sparse/0";
        let problem = Box::new(ViewsProblem::Missing { what: "camera file".to_owned(), expected });
        return Err(Error::Views { place: Place::new(folder, At::Whole), problem });
    }
    let parse = if is_binary { parse_binary } else { parse_text };
    let frames = parse([&files::read(&cameras)?, &files::read(&images)?], [&cameras, &images])?;
    Ok(ModelFiles { frames, cameras, images })
}

/// The folder `images` in a model's folder or the nearest above it; in the former if there is none.
pub(super) fn images_near(model: &Path) -> PathBuf {
    let whole = std::path::absolute(model).unwrap_or_else(|_| model.to_path_buf());
    let mut near = whole.ancestors().map(|folder| folder.join("images"));
    near.find(|images| images.is_dir()).unwrap_or_else(|| model.join("images"))
}

/// The frames of `cameras.txt` and `images.txt`, sorted by the names of pictures.
pub(in crate::io) fn parse_text(contents: [&[u8]; 2], paths: [&Path; 2]) -> Result<Vec<Frame>, Error> {
    let cameras = text::cameras(contents[0]).map_err(|e| located(paths[0], e))?;
    let images = text::images(contents[1]).map_err(|e| located(paths[1], e))?;
    frames(&cameras, images, paths)
}

/// The frames of `cameras.bin` and `images.bin`, sorted by the names of pictures.
pub(in crate::io) fn parse_binary(contents: [&[u8]; 2], paths: [&Path; 2]) -> Result<Vec<Frame>, Error> {
    let cameras = binary::cameras(contents[0]).map_err(|e| located(paths[0], e))?;
    let images = binary::images(contents[1]).map_err(|e| located(paths[1], e))?;
    frames(&cameras, images, paths)
}

/// A problem and its location in a file.
type Located = (At, ViewsProblem);

fn located(path: &Path, (at, problem): Located) -> Error {
    Error::Views { place: Place::new(path, at), problem: Box::new(problem) }
}

fn frames(
    cameras: &BTreeMap<u32, CameraRecord>,
    mut images: Vec<ImageRecord>,
    [of_cameras, of_images]: [&Path; 2],
) -> Result<Vec<Frame>, Error> {
    images.sort_by(|a, b| a.name.cmp(&b.name));
    let frame = |image: ImageRecord| {
        let id = image.camera;
        let error = |problem| located(of_images, (image.at.clone(), problem));
        let unknown = || error(ViewsProblem::NoCamera { id, cameras: of_cameras.to_path_buf() });
        let camera = cameras.get(&id).ok_or_else(unknown)?;
        let lens = camera.lens(id).map_err(|problem| located(of_cameras, (camera.at.clone(), problem)))?;
        let (rotation, center) = image.pose().map_err(error)?;
        Ok(Frame { at: image.at, picture: image.name, weights: None, rotation, center, lens })
    };
    images.into_iter().map(frame).collect()
}

impl CameraRecord {
    fn lens(&self, id: u32) -> Result<Lens, ViewsProblem> {
        let (focal, principal) = self.model.pinhole(id, &self.parameters)?;
        let size = Some((self.size.0 as f64, self.size.1 as f64));
        Ok(Lens { size, focal, principal })
    }
}

impl ImageRecord {
    /// R, and the camera's centre −Rᵀ t.
    fn pose(&self) -> Result<(DMat3, DVec3), ViewsProblem> {
        let [w, x, y, z] = self.quaternion;
        let largest = self.quaternion.iter().fold(0.0_f64, |m, q| m.max(q.abs()));
        let wrong = |what: &str, found: String, expected| {
            Err(ViewsProblem::Value { what: what.to_owned(), found, expected })
        };
        // Scaled first, so that no square overflows.
        let turn = DQuat::from_xyzw(x / largest, y / largest, z / largest, w / largest).normalize();
        if !turn.is_finite() {
            return wrong("the quaternion", format!("{:?}", self.quaternion), "finite numbers, not all 0");
        }
        let (rotation, translation) = (DMat3::from_quat(turn), DVec3::from_array(self.translation));
        let center = -(rotation.transpose() * translation);
        if !center.is_finite() {
            return wrong("the translation", format!("{:?}", self.translation), "finite numbers");
        }
        Ok((rotation, center))
    }
}
