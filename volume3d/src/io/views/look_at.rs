//! Cameras that look at points.

use std::path::{Path, PathBuf};

use glam::DVec3;

use super::frame::stem;
use super::posed_picture::PosedPicture;
use crate::io::{At, Error, Place, ViewsProblem, image_size};
use crate::scene::Camera;

/// A picture taken by a camera that looks at a point.
#[derive(Clone, Debug, PartialEq)]
pub struct LookAt {
    /// The picture's file, whose name without extension is the view's.
    pub picture: PathBuf,
    /// Position of the camera.
    pub origin: DVec3,
    /// A point in the middle of the picture.
    pub target: DVec3,
    /// The direction that is up in the picture, not along the view.
    pub up: DVec3,
    /// Horizontal field of view, radians, in (0, π).
    pub field_of_view: f64,
}

impl LookAt {
    /// The camera.
    ///
    /// # Errors
    /// [`ViewsProblem::Value`] if it looks nowhere, or its angle is out of range.
    pub fn camera(&self) -> Result<Camera, ViewsProblem> {
        let &Self { origin, target, up, field_of_view, .. } = self;
        let error =
            |what: &str, found, expected| ViewsProblem::Value { what: what.to_owned(), found, expected };
        let direction = target - origin;
        let is_finite = origin.is_finite() && target.is_finite() && up.is_finite();
        let sine = direction.cross(up).length() / (direction.length() * up.length());
        if !(is_finite && sine > 1e-9) {
            let found = format!("{up}, from {origin} to {target}");
            return Err(error("up", found, "finite and not along the view, whose points must differ"));
        }
        if !(field_of_view > 0.0 && field_of_view < std::f64::consts::PI) {
            return Err(error("the field of view", format!("{field_of_view}"), "between 0 and pi"));
        }
        Ok(Camera::look_at(origin, target, up, field_of_view))
    }

    /// The view, whose index in the list is for messages.
    pub(super) fn posed(&self, index: usize) -> Result<PosedPicture, Error> {
        let camera = self.camera().map_err(|problem| {
            let place = Place::new(Path::new("the list of views"), At::Item("view".to_owned(), index));
            Error::Views { place, problem: Box::new(problem) }
        })?;
        let (width, height) = image_size(&self.picture)?;
        let (name, picture) = (stem(&self.picture), self.picture.clone());
        Ok(PosedPicture { name, camera, picture, mask: None, weights: None, width, height })
    }
}
