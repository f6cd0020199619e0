//! Tables shared by all waves of a scene.

use glam::DVec3;

use super::faces::{Faces, Finish};
use crate::lanes::Instructions;
use crate::path::integrator::Paths;
use crate::scene::Environment;

/// Lookup tables of waves.
#[derive(Clone, Debug)]
pub(crate) struct WaveTables {
    pub(super) faces: Faces,
    /// Radiance of a constant environment.
    pub(super) environment: Option<DVec3>,
    pub(super) instructions: Instructions,
}

impl WaveTables {
    /// Tables of a scene that waves support: no media, meshes only, lit only by shapes without emission
    /// textures and a constant environment, and with at least one plain diffuse shape; otherwise `None`.
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
