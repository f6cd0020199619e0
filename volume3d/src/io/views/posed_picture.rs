//! A picture with its camera.

use std::path::{Path, PathBuf};

use glam::DVec3;

use super::scaled::scaled;
use crate::Image;
use crate::io::{At, Encoding, Error, Place, ViewsProblem, load_image, load_image_over};
use crate::scene::Camera;

/// A picture with its camera.
#[derive(Clone, Debug, PartialEq)]
pub struct PosedPicture {
    /// A name that no other view has.
    pub name: String,
    /// The camera, for a film of [`width`](Self::width) × [`height`](Self::height) pixels.
    pub camera: Camera,
    /// The picture's file.
    pub picture: PathBuf,
    /// A picture that is white where the object is seen, as of DTU data.
    pub mask: Option<PathBuf>,
    /// A picture that is black where pixels do not count, as the `mask_path` of nerfstudio.
    pub weights: Option<PathBuf>,
    /// Columns.
    pub width: usize,
    /// Rows.
    pub height: usize,
}

impl PosedPicture {
    /// The same view in fewer pixels, of the same shape up to rounding.
    ///
    /// # Errors
    /// [`Error::Views`] if the picture has too few pixels or another shape.
    pub fn resized(self, width: usize, height: usize) -> Result<Self, Error> {
        let found = (self.width, self.height);
        let fits = (1..=found.0).contains(&width) && (1..=found.1).contains(&height);
        let declared = (found.0 as f64, found.1 as f64);
        match scaled(self.camera.clone(), declared, (width, height), &self.picture) {
            Ok(camera) if fits => Ok(Self { camera, width, height, ..self }),
            _ => Err(self.too_few(&self.picture, found, (width, height))),
        }
    }

    /// Reads the picture as linear RGB, over `background` where it is transparent, and reduces it to the
    /// view's size: every pixel is the mean over its area.
    ///
    /// # Errors
    /// [`Error::File`], [`Error::Image`], or [`Error::Views`] if the picture has too few pixels.
    pub fn load(&self, background: DVec3) -> Result<Image, Error> {
        self.reduced(load_image_over(&self.picture, background, Encoding::File, None)?, &self.picture)
    }

    /// Reads the weights of pixels, from 0 to 1, if there are any, and reduces them like the picture.
    ///
    /// # Errors
    /// The errors of [`load`](Self::load).
    pub fn load_weights(&self) -> Result<Option<Image>, Error> {
        self.weights.as_deref().map(|path| self.numbers(path)).transpose()
    }

    /// Reads the mask as numbers from 0 to 1, if there is one, and reduces it like the picture.
    ///
    /// # Errors
    /// The errors of [`load`](Self::load).
    pub fn load_mask(&self) -> Result<Option<Image>, Error> {
        self.mask.as_deref().map(|path| self.numbers(path)).transpose()
    }

    fn numbers(&self, path: &Path) -> Result<Image, Error> {
        self.reduced(load_image(path, true)?, path)
    }

    fn reduced(&self, image: Image, path: &Path) -> Result<Image, Error> {
        let (found, asked) = (image.size(), (self.width, self.height));
        if found == asked {
            return Ok(image);
        }
        image.reduced(self.width, self.height).ok_or_else(|| self.too_few(path, found, asked))
    }

    fn too_few(&self, path: &Path, found: (usize, usize), asked: (usize, usize)) -> Error {
        let problem = ViewsProblem::Resized { name: self.name.clone(), found, asked };
        Error::Views { place: Place::new(path, At::Whole), problem: Box::new(problem) }
    }
}
