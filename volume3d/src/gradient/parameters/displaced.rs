//! A scene displaced along a tangent.

use glam::{DMat3, DQuat, DVec3};

use crate::geometry::Normals;
use crate::gradient::{ImplicitTangent, Tangent};
use crate::scene::{Description, Environment, ImplicitShape, Light, Reflectance, Scene, SceneError};

impl Tangent {
    /// The scene at parameters θ + `step` · change. Positions move along straight lines; rotations are
    /// applied as rotations.
    ///
    /// # Errors
    /// [`SceneError`] if a parameter leaves its range, such as a radiance that becomes negative.
    pub fn displaced(&self, scene: &Scene, step: f64) -> Result<Scene, SceneError> {
        let mut d: Description = scene.description().clone();
        for (s, shape) in d.shapes.iter_mut().enumerate() {
            shape.mesh.displace(&self.positions[scene.position_range(s)], step);
            if let Normals::Given(normals) = shape.mesh.normals() {
                let mut normals = normals.clone();
                for (n, rate) in normals.values.iter_mut().zip(&self.normals[scene.normal_range(s)]) {
                    *n = n.normalize_or_zero() + step * *rate;
                }
                shape.mesh.replace_given_normals(normals);
            }
            if let Some(radiance) = &mut shape.radiance {
                *radiance += step * self.radiance[s];
            }
        }
        for (shape, rates) in d.implicits.iter_mut().zip(&self.implicits) {
            *shape = rates.displaced(shape, step)?;
        }
        for (m, material) in d.materials.iter_mut().enumerate() {
            if let Reflectance::Constant(c) = material.bsdf.reflectance_mut() {
                *c += step * self.reflectance[m];
            }
            if let Some(alpha) = material.bsdf.roughness_mut() {
                *alpha += step * self.roughness[m];
            }
        }
        for (texture, rates) in d.textures.iter_mut().zip(&self.texels) {
            texture.texels.iter_mut().zip(rates).for_each(|(t, r)| *t += step * *r);
        }
        for (l, light) in d.lights.iter_mut().enumerate() {
            *light.power_mut() += step * self.intensity[l];
            match light {
                Light::Point { position, .. } => *position += step * self.pose[l],
                Light::Spot { position, to_world, .. } | Light::Projector { position, to_world, .. } => {
                    *position += step * self.pose[l];
                    *to_world = DMat3::from_quat(turn(step * self.light_rotation[l])) * *to_world;
                }
                Light::Directional { direction, .. } => {
                    *direction = turn(step * self.pose[l]) * *direction;
                }
            }
        }
        match &mut d.environment {
            Some(Environment::Constant { radiance, .. }) => *radiance += step * self.environment,
            Some(Environment::Map { to_world, .. }) => {
                *to_world = DMat3::from_quat(turn(step * self.environment_rotation)) * *to_world;
            }
            None => {}
        }
        let camera = &mut d.camera;
        *camera = camera.turned(turn(step * self.camera.rotation));
        camera.origin += step * self.camera.translation;
        if camera.orthographic.is_some() && self.camera.field_of_view != 0.0 {
            return Err(SceneError::FieldOfView);
        }
        camera.field_of_view += step * self.camera.field_of_view;
        Scene::new(d)
    }
}

impl ImplicitTangent {
    /// The implicit surface displaced by `step` · change.
    pub(in crate::gradient) fn displaced(
        &self,
        shape: &ImplicitShape,
        step: f64,
    ) -> Result<ImplicitShape, SceneError> {
        let mut displaced = shape.clone();
        if self.parameters.iter().any(|rate| *rate != 0.0) {
            let rates = shape.surface.parameters().into_iter().zip(&self.parameters);
            let parameters: Vec<f64> = rates.map(|(p, rate)| p + step * rate).collect();
            let surface = shape.surface.with_parameters(&parameters);
            displaced.surface =
                surface.map_err(|error| SceneError::Implicit { id: shape.id.clone(), error })?;
        }
        let placement = &mut displaced.placement;
        placement.translation += step * self.translation;
        placement.rotation = DMat3::from_quat(turn(step * self.rotation)) * placement.rotation;
        Ok(displaced)
    }
}

fn turn(angle: DVec3) -> DQuat {
    DQuat::from_scaled_axis(angle)
}
