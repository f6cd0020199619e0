//! Pictures with the cameras that took them, from the formats of other programs.
//!
//! | from | cameras | axes of a camera | pixels |
//! |---|---|---|---|
//! | [`Views::from_transforms`] | `transforms.json` of NeRF (Mildenhall et al. 2020), instant-ngp and nerfstudio | x right, y up, looks along −z | centres at halves |
//! | [`Views::from_colmap`] | `cameras` and `images` of COLMAP, as text or binary | x right, y down, looks along z | centres at halves |
//! | [`Views::from_dtu`] | `cameras.npz`, see [`dtu`] | x right, y down, looks along z | centres at whole numbers |
//! | [`Views::from_sensors`] | all sensors of a Mitsuba scene | x left, y up, looks along z | centres at halves |
//! | [`Views::from_look_at`] | positions and targets | | |
//!
//! Focal lengths may differ and principal points may be anywhere. Lenses that distort are refused by name,
//! since they are no [`Camera`](crate::scene::Camera). A picture may be a copy in fewer pixels of the one
//! that its camera describes. A view has the name of its picture, without the extension. Views are in the
//! order of the file; those of COLMAP are sorted by name.

mod colmap;
mod frame;
mod look_at;
mod posed_picture;
mod scaled;
mod transforms;

use std::collections::HashSet;
use std::path::{Path, PathBuf};

pub(super) use self::colmap::{parse_binary as parse_colmap_binary, parse_text as parse_colmap_text};
pub use self::look_at::LookAt;
pub use self::posed_picture::PosedPicture;
pub(super) use self::transforms::parse as parse_transforms;

pub(super) use self::frame::{Frame, posed};

use self::frame::stem;
use self::scaled::scaled;
use super::{At, Error, Place, ViewsProblem, dtu, image_size, mitsuba};

/// Pictures with their cameras, at least one.
#[derive(Clone, Debug, PartialEq)]
pub struct Views {
    /// The views, with names of their own.
    pub list: Vec<PosedPicture>,
    /// The files that describe the cameras.
    pub files: Vec<PathBuf>,
}

impl Views {
    /// Views of `transforms.json`, whose pictures are named from its folder, with or without extension.
    ///
    /// Understood are `camera_angle_x`, `camera_angle_y`, `fl_x`, `fl_y`, `cx`, `cy`, `w` and `h`, of the
    /// file or of a frame, which takes precedence; `mask_path`, whose black pixels do not count; and
    /// `camera_model`, `is_fisheye` and coefficients of distortion, which must be 0. Without an angle or
    /// focal length along y, pixels are square; without `cx` and `cy` the principal point is the middle.
    /// Poses are those of the file: scales for other programs, such as `aabb_scale`, are ignored.
    ///
    /// # Errors
    /// [`Error::File`], or [`Error::Views`] with the frame.
    pub fn from_transforms(path: &Path) -> Result<Self, Error> {
        let frames = transforms::parse(&super::files::read(path)?, path)?;
        let folder = path.parent().unwrap_or(Path::new(""));
        let find = |name: &str| transforms::picture(&folder.join(name));
        Self::from_frames(frames, path, vec![path.to_path_buf()], &find)
    }

    /// Views of a COLMAP model: a folder with `cameras.bin` and `images.bin`, or else `cameras.txt` and
    /// `images.txt`. Pictures are in the folder `images`; if `None`, in the one of that name in the model's
    /// folder or the nearest above it.
    ///
    /// # Errors
    /// [`Error::File`], or [`Error::Views`] with the line or the image.
    pub fn from_colmap(model: &Path, images: Option<&Path>) -> Result<Self, Error> {
        let images = images.map_or_else(|| colmap::images_near(model), Path::to_path_buf);
        let model = colmap::read(model)?;
        let find = |name: &str| images.join(name);
        Self::from_frames(model.frames, &model.images, vec![model.cameras, model.images.clone()], &find)
    }

    /// Views of a folder in the layout of DTU data, with their masks, in coordinates of its unit ball.
    ///
    /// # Errors
    /// [`Error::File`], [`Error::Image`] or [`Error::Dtu`].
    pub fn from_dtu(folder: &Path) -> Result<Self, Error> {
        let folder = dtu::Folder::open(folder)?;
        let view = |index| {
            let Some([picture, mask]) = folder.pictures(index) else { return Ok(None) };
            let (width, height) = image_size(picture)?;
            let camera = folder.camera(index, (width, height))?;
            let name = stem(picture);
            let (picture, mask) = (picture.to_path_buf(), Some(mask.to_path_buf()));
            Ok::<_, Error>(Some(PosedPicture { name, camera, picture, mask, weights: None, width, height }))
        };
        let list = (0..folder.len()).filter_map(|index| view(index).transpose()).collect::<Result<_, _>>()?;
        Self::new(list, &folder.cameras(), vec![folder.cameras()])
    }

    /// Views of all sensors of a Mitsuba scene, in order, with a picture each. `variables` are values for its
    /// `$name`s. Other objects of the scene are not read, and clipping planes do not matter. A film's crop
    /// becomes a camera of that size. Names are the ids of sensors, or those of pictures.
    ///
    /// # Errors
    /// Those of [`load_scene`](super::load_scene), or [`Error::Views`].
    pub fn from_sensors(
        scene: &Path,
        variables: &[(String, String)],
        pictures: &[PathBuf],
    ) -> Result<Self, Error> {
        let sensors = mitsuba::load_sensors(scene, variables)?;
        let error =
            |problem| Error::Views { place: Place::new(scene, At::Whole), problem: Box::new(problem) };
        if sensors.len() != pictures.len() {
            return Err(error(ViewsProblem::Count { sensors: sensors.len(), pictures: pictures.len() }));
        }
        let view = |(sensor, picture): (mitsuba::PosedSensor, &PathBuf)| {
            let mitsuba::PosedSensor { id, camera, width, height } = sensor;
            let size = image_size(picture)?;
            let camera = scaled(camera, (width as f64, height as f64), size, picture).map_err(error)?;
            let (name, picture) = (id.unwrap_or_else(|| stem(picture)), picture.clone());
            let (width, height) = size;
            Ok::<_, Error>(PosedPicture { name, camera, picture, mask: None, weights: None, width, height })
        };
        let list = sensors.into_iter().zip(pictures).map(view).collect::<Result<_, _>>()?;
        Self::new(list, scene, vec![scene.to_path_buf()])
    }

    /// Views of cameras that look at points.
    ///
    /// # Errors
    /// [`Error::File`], [`Error::Image`], or [`Error::Views`] with the index of a camera that looks nowhere.
    pub fn from_look_at(cameras: &[LookAt]) -> Result<Self, Error> {
        let list = cameras.iter().enumerate().map(|(i, camera)| camera.posed(i)).collect::<Result<_, _>>()?;
        Self::new(list, Path::new("the list of views"), vec![])
    }

    /// The same views in fewer pixels, of the same shape up to rounding.
    ///
    /// # Errors
    /// [`Error::Views`] if a picture has too few pixels or another shape.
    pub fn resized(self, width: usize, height: usize) -> Result<Self, Error> {
        let list = self.list.into_iter().map(|view| view.resized(width, height)).collect::<Result<_, _>>()?;
        Ok(Self { list, ..self })
    }

    /// Finds the pictures of frames and their sizes.
    fn from_frames(
        frames: Vec<Frame>,
        path: &Path,
        files: Vec<PathBuf>,
        find: &dyn Fn(&str) -> PathBuf,
    ) -> Result<Self, Error> {
        let list = frames.into_iter().map(|frame| {
            let at = frame.at.clone();
            let error =
                |problem| Error::Views { place: Place::new(path, at.clone()), problem: Box::new(problem) };
            let picture = find(&frame.picture);
            let unread = |source| error(ViewsProblem::Picture { source: Box::new(source) });
            let size = image_size(&picture).map_err(unread)?;
            let weights = frame.weights.as_deref().map(find);
            posed(frame, picture, weights, size).map_err(error)
        });
        let list = list.collect::<Result<_, _>>()?;
        Self::new(list, path, files)
    }

    /// Refuses an empty list, and two views of one name.
    fn new(list: Vec<PosedPicture>, path: &Path, files: Vec<PathBuf>) -> Result<Self, Error> {
        let error = |problem| Error::Views { place: Place::new(path, At::Whole), problem: Box::new(problem) };
        if list.is_empty() {
            return Err(error(ViewsProblem::Empty));
        }
        let mut names = HashSet::new();
        if let Some(second) = list.iter().find(|view| !names.insert(view.name.as_str())) {
            return Err(error(ViewsProblem::Twice { what: format!("views called `{}`", second.name) }));
        }
        Ok(Self { list, files })
    }
}
