//! What all waves of a scene share.

use glam::DVec3;

use super::faces::{Faces, Finish};
use crate::lanes::Instructions;
use crate::path::integrator::Paths;
use crate::scene::Environment;

/// What waves look up, made once for all of them.
#[derive(Clone, Debug)]
pub(crate) struct WaveTables {
    pub(super) faces: Faces,
    /// Of an environment that is the same in all directions, and what a camera ray sees of it.
    pub(super) environment: Option<DVec3>,
    pub(super) instructions: Instructions,
}

impl WaveTables {
    /// Of a scene whose paths may go side by side: in empty space, between meshes, and lit by shapes and by a constant
    /// environment alone.
    pub(crate) fn new(paths: &Paths<'_>) -> Option<Self> {
        let description = &paths.scene.description;
        let environment = match &description.environment {
            None => None,
            Some(Environment::Constant { radiance, .. }) => Some(*radiance),
            Some(Environment::Map { .. }) => return None,
        };
        let is_plain = description.media.is_empty()
            && description.implicits.is_empty()
            && description.lights.is_empty()
            && description.shapes.iter().all(|s| s.radiance.is_none() || s.radiance_texture.is_none());
        let faces = is_plain.then(|| Faces::new(paths.scene))?;
        let any = faces.finishes.iter().any(|finish| matches!(finish, Finish::Matt { .. }));
        any.then(|| Self { faces, environment, instructions: Instructions::detect() })
    }
}
