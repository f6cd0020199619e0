//! Things of a scene that move as a whole.

use glam::DVec3;

use crate::gradient::Tangent;
use crate::scene::{Light, Object, Scene};

impl Tangent {
    /// Moves all that is [moved with](crate::scene::Description::moved_with) something along `velocity`: ẋ =
    /// v. Directional lights and the environment have no place.
    pub fn translate_object(&mut self, scene: &Scene, object: Object, velocity: DVec3) {
        let d = scene.description();
        let parts = d.moved_with(object);
        parts.shapes.iter().for_each(|&shape| self.translate(scene, shape, velocity));
        parts.implicits.iter().for_each(|&implicit| self.implicits[implicit].translation += velocity);
        for &light in parts.lights.iter().filter(|&&light| d.lights[light].position().is_some()) {
            self.pose[light] += velocity;
        }
    }

    /// Turns all of it about an axis through `centre`, right-handed, by |ω| radians: ẋ = ω × (x − c).
    /// Directions turn with it.
    pub fn rotate_object(&mut self, scene: &Scene, object: Object, centre: DVec3, angular_velocity: DVec3) {
        let (d, w) = (scene.description(), angular_velocity);
        let parts = d.moved_with(object);
        parts.shapes.iter().for_each(|&shape| self.rotate(scene, shape, centre, w));
        for &implicit in &parts.implicits {
            self.implicits[implicit].rotate(&d.implicits[implicit], centre, w);
        }
        for &light in &parts.lights {
            match &d.lights[light] {
                Light::Directional { .. } => self.pose[light] += w,
                Light::Point { position, .. } => self.pose[light] += w.cross(*position - centre),
                Light::Spot { position, .. } | Light::Projector { position, .. } => {
                    self.pose[light] += w.cross(*position - centre);
                    self.light_rotation[light] += w;
                }
            }
        }
        if parts.environment {
            self.environment_rotation += w;
        }
    }

    /// Scales all shapes of it about `centre`: ẋ = s (x − c).
    pub fn scale_object(&mut self, scene: &Scene, object: Object, centre: DVec3, rate: f64) {
        let parts = scene.description().moved_with(object);
        parts.shapes.iter().for_each(|&shape| self.scale(scene, shape, centre, rate));
    }
}
