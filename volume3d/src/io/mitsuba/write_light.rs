//! Light export.

use glam::DVec3;

use super::write::Writer;
use crate::scene::{Environment, Light};

impl Writer<'_> {
    /// Writes a light without a surface.
    pub(super) fn light(&mut self, id: &str, light: &Light) {
        match light {
            Light::Directional { direction, irradiance, kappa, .. } => {
                self.open("emitter", "directional", id);
                self.vector("direction", *direction);
                self.colour("irradiance", *irradiance);
                if kappa.is_finite() {
                    self.value("float", "kappa", kappa);
                }
            }
            Light::Point { position, intensity, .. } => {
                self.open("emitter", "point", id);
                self.vector("position", *position);
                self.colour("intensity", *intensity);
            }
            Light::Spot { position, to_world, intensity, cutoff, beam, texture, .. } => {
                self.open("emitter", "spot", id);
                self.world_transform(*to_world, *position);
                self.colour("intensity", *intensity);
                self.value("float", "cutoff_angle", cutoff.to_degrees());
                self.value("float", "beam_width", beam.to_degrees());
                texture.iter().for_each(|texture| self.texture_reference("texture", *texture));
            }
            Light::Projector { position, to_world, intensity, field_of_view, texture, .. } => {
                self.open("emitter", "projector", id);
                self.world_transform(*to_world, *position);
                self.value("float", "fov", field_of_view.to_degrees());
                match texture {
                    // The format has one factor for all channels; projectors from a file have one, too.
                    Some(texture) => {
                        self.value("float", "scale", intensity.x);
                        self.texture_reference("irradiance", *texture);
                    }
                    None => self.colour("irradiance", *intensity),
                }
            }
        }
        self.line("</emitter>");
    }

    /// Writes the environment.
    pub(super) fn environment(&mut self, environment: &Environment, files: &[String]) {
        let id = &self.ids.environment;
        match environment {
            Environment::Constant { radiance, .. } => {
                self.open("emitter", "constant", id);
                self.colour("radiance", *radiance);
            }
            Environment::Map { texture, scale, to_world, .. } => {
                self.open("emitter", "envmap", id);
                self.value("string", "filename", &files[*texture]);
                self.value("float", "scale", scale);
                self.world_transform(*to_world, DVec3::ZERO);
            }
        }
        self.line("</emitter>");
    }
}
