//! DTU data in the layout of IDR (Yariv et al. 2020): pictures with masks and cameras. NeuS (Wang et al.
//! 2021) names the file of cameras `cameras_sphere.npz` instead; rename it.
//!
//! A folder has `image/*.png`, `mask/*.png` and `cameras.npz`. In the latter, `world_mat_i` is the projection
//! of image i, a 4 × 4 matrix whose first three rows map world points to pixels, and `scale_mat_i` maps the
//! unit ball, which contains the object, to the world. [`View`]s are in the coordinates of the ball. Images
//! and masks are sorted by name: numerically if all names are numbers, otherwise alphabetically.

mod camera;

use std::path::{Path, PathBuf};

use glam::{DMat3, DVec3};

pub use self::camera::CameraMismatch;

use self::camera::Pinhole;
use super::npz::Npz;
use super::{DtuProblem, Error, files, load_image};
use crate::Image;
use crate::scene::Camera;

/// Name of the camera file.
const CAMERAS: &str = "cameras.npz";

/// Picture with its camera, which maps x to the pixel K R (x − c), divided by its third coordinate.
#[derive(Clone, Debug, PartialEq)]
pub struct View {
    /// The picture's file name without its extension.
    pub name: String,
    /// The picture, linear RGB. 24 bytes a pixel: 46 MB of the DTU data.
    pub image: Image,
    /// Whether a pixel shows the object, row by row from the top: its mean over the channels is above one
    /// half of white, as stored.
    pub mask: Vec<bool>,
    /// K: upper triangular in pixels, with a positive diagonal and K_33 = 1. Pixel centres have whole
    /// coordinates, as in OpenCV.
    pub intrinsics: DMat3,
    /// R, from the ball's coordinates to the camera's: x to the right, y down, z into the picture.
    pub rotation: DMat3,
    /// c, in the ball's coordinates.
    pub center: DVec3,
}

/// DTU folder whose names and cameras are read at once, and whose pictures are read one by one.
#[derive(Debug)]
pub struct Folder {
    path: PathBuf,
    names: Vec<[PathBuf; 2]>,
    pinholes: Vec<Pinhole>,
}

/// Reads all views of a folder; [`Folder`] reads them one by one, with less memory.
///
/// # Errors
/// [`Error::File`], [`Error::Dtu`] or [`Error::Image`].
pub fn read_views(path: &Path) -> Result<Vec<View>, Error> {
    let folder = Folder::open(path)?;
    (0..folder.len()).map(|index| folder.view(index)).collect()
}

impl Folder {
    /// Reads the names and all cameras.
    ///
    /// # Errors
    /// [`Error::File`], or [`Error::Dtu`] if the numbers of images, masks and cameras differ, or a matrix is
    /// not that of a camera.
    pub fn open(path: &Path) -> Result<Self, Error> {
        let images = names(&path.join("image"))?;
        let masks = names(&path.join("mask"))?;
        let error = |problem| Error::Dtu { path: path.to_path_buf(), problem };
        if images.len() != masks.len() {
            return Err(error(DtuProblem::Count { images: images.len(), masks: masks.len() }));
        }
        for (index, (image, mask)) in images.iter().zip(&masks).enumerate() {
            if matches!((number(image), number(mask)), (Some(i), Some(m)) if i != m) {
                let (image, mask) = (file_name(image), file_name(mask));
                return Err(error(DtuProblem::Pair { index, image, mask }));
            }
        }
        let file = path.join(CAMERAS);
        let pinholes = parse_cameras(&files::read(&file)?, images.len())
            .map_err(|problem| Error::Dtu { path: file, problem })?;
        let names = images.into_iter().zip(masks).map(|(image, mask)| [image, mask]).collect();
        Ok(Self { path: path.to_path_buf(), names, pinholes })
    }

    /// The number of views, at least one.
    #[expect(clippy::len_without_is_empty, reason = "an empty folder is refused")]
    #[must_use]
    pub fn len(&self) -> usize {
        self.names.len()
    }

    /// The path of the camera file.
    #[must_use]
    pub fn cameras(&self) -> PathBuf {
        self.path.join(CAMERAS)
    }

    /// The paths of the picture and the mask of a view, from 0; `None` if there is no such view.
    #[must_use]
    pub fn pictures(&self, index: usize) -> Option<[&Path; 2]> {
        self.names.get(index).map(|names| names.each_ref().map(PathBuf::as_path))
    }

    /// The camera of a view, from 0, for a picture with these columns and rows.
    ///
    /// # Errors
    /// [`Error::Dtu`] if there is no such view, or its pixels are skewed as in [`CameraMismatch`].
    pub fn camera(&self, index: usize, size: (usize, usize)) -> Result<Camera, Error> {
        let error = |problem| Error::Dtu { path: self.cameras(), problem };
        let pinhole = self.pinholes.get(index);
        let pinhole = pinhole.ok_or_else(|| error(DtuProblem::Index { index, count: self.len() }))?;
        pinhole.camera(size).map_err(|CameraMismatch { skew }| error(DtuProblem::Skew { index, skew }))
    }

    /// A view, from 0.
    ///
    /// # Errors
    /// [`Error::File`] or [`Error::Image`], or [`Error::Dtu`] if the mask has another size, or there is no
    /// such view.
    pub fn view(&self, index: usize) -> Result<View, Error> {
        let error = |problem| Error::Dtu { path: self.path.clone(), problem };
        let (Some([image, mask]), Some(pinhole)) = (self.names.get(index), self.pinholes.get(index)) else {
            return Err(error(DtuProblem::Index { index, count: self.len() }));
        };
        let (picture, covered) = (load_image(image, false)?, load_image(mask, true)?);
        let (expected, found) = (picture.size(), covered.size());
        if expected != found {
            return Err(error(DtuProblem::Size { index, image: image.clone(), expected, found }));
        }
        let &Pinhole { intrinsics, rotation, center } = pinhole;
        let mask = super::covered(&covered);
        Ok(View { name: stem(image), image: picture, mask, intrinsics, rotation, center })
    }
}

/// Parses the cameras of `images` images.
pub(in crate::io) fn parse_cameras(bytes: &[u8], images: usize) -> Result<Vec<Pinhole>, DtuProblem> {
    let arrays = Npz::new(bytes)?;
    let camera = |index| {
        let matrix = |kind: &str| arrays.matrix(&format!("{kind}_{index}"));
        Pinhole::new(matrix("world_mat")? * matrix("scale_mat")?, index)
    };
    let cameras = (0..images).map(camera).collect::<Result<_, _>>()?;
    let array = format!("world_mat_{images}");
    if arrays.has(&array) { Err(DtuProblem::Unused { array, images }) } else { Ok(cameras) }
}

/// The PNG files of a folder, in order, at least one.
fn names(path: &Path) -> Result<Vec<PathBuf>, Error> {
    let error = |source| Error::File { action: "read", path: path.to_path_buf(), source };
    let mut names = vec![];
    for entry in std::fs::read_dir(path).map_err(error)? {
        let name = entry.map_err(error)?.path();
        if name.extension().is_some_and(|ending| ending.eq_ignore_ascii_case("png")) {
            names.push(name);
        }
    }
    if names.is_empty() {
        return Err(Error::Dtu { path: path.to_path_buf(), problem: DtuProblem::Empty });
    }
    names.sort();
    if names.iter().all(|name| number(name).is_some()) {
        names.sort_by_key(|name| number(name));
    }
    Ok(names)
}

/// The number in a file name that is a number.
fn number(path: &Path) -> Option<u64> {
    let stem = path.file_stem()?.to_str()?;
    if stem.bytes().all(|b| b.is_ascii_digit()) { stem.parse().ok() } else { None }
}

fn stem(path: &Path) -> String {
    path.file_stem().unwrap_or_default().to_string_lossy().into_owned()
}

fn file_name(path: &Path) -> String {
    path.file_name().unwrap_or_default().to_string_lossy().into_owned()
}
