//! Setting a scene to a parameter vector.

use glam::{DQuat, DVec3};

use super::super::pose::Rest;
use super::super::quantity::{Member, Quantity};
use super::{Parameters, values};
use crate::geometry::{Mesh, MeshError};
use crate::scene::{Collection, Description, Environment, Object, Reflectance, Scene, SceneError};

impl Parameters {
    /// Sets a scene to the values x. Everything that does not depend on them stays as it is; see
    /// [`Scene::set_meshes`] for the cost.
    ///
    /// # Errors
    /// A [`SceneError`]; the scene is then unchanged:
    ///
    /// - `Parameters` if x has another length,
    /// - `OtherScene` if the scene has other objects or another topology,
    /// - `Parameter` if a number is not finite, or outside of both [`Quantity::default_bounds`] and the
    ///   bounds of its group, and
    /// - those of the scene's updates, such as `Inside` if the camera would be inside an implicit surface.
    pub fn apply(&self, x: &[f64], scene: &mut Scene) -> Result<(), SceneError> {
        self.check(x, scene)?;
        let (saved, radiances) = saved(scene);
        let applied = self.apply_checked(x, scene);
        if applied.is_err() {
            scene.restore(saved, radiances);
        }
        applied
    }

    fn check(&self, x: &[f64], scene: &Scene) -> Result<(), SceneError> {
        if x.len() != self.len {
            return Err(SceneError::Parameters { found: x.len(), expected: self.len });
        }
        for group in &self.groups {
            if !group.members().all(|member| self.is_of(scene, member, group.range.len())) {
                return Err(SceneError::OtherScene { name: group.name.clone() });
            }
            let default = group.quantity.default_bounds();
            let bounds = [default[0].min(group.bounds[0]), default[1].max(group.bounds[1])];
            let within = |value: f64| value.is_finite() && bounds[0] <= value && value <= bounds[1];
            let numbers = &x[group.range.clone()];
            if let Some(index) = numbers.iter().position(|value| !within(*value)) {
                let name = group.name.clone();
                return Err(SceneError::Parameter { name, index, value: numbers[index], bounds });
            }
        }
        Ok(())
    }

    /// Whether a scene has a parameter with this number of numbers.
    fn is_of(&self, scene: &Scene, member: Member, numbers: usize) -> bool {
        let d = scene.description();
        let object = match member.quantity {
            Quantity::VertexPositions { shape } | Quantity::Radiance { shape } => Object::Shape(shape),
            Quantity::Sdf { implicit } => Object::Implicit(implicit),
            Quantity::Intensity { light } => Object::Light(light),
            Quantity::Reflectance { material } | Quantity::Roughness { material } => {
                Object::Material(material)
            }
            Quantity::Texture { texture, .. } => Object::Texture(texture),
            Quantity::Translation { of } | Quantity::Rotation { of } | Quantity::Scale { of } => of,
            Quantity::EnvironmentRadiance
            | Quantity::CameraTranslation
            | Quantity::CameraRotation
            | Quantity::FieldOfView => Object::Camera,
        };
        let exists = match object {
            Object::Shape(shape) => shape < d.shapes.len(),
            Object::Implicit(implicit) => implicit < d.implicits.len(),
            Object::Material(material) => material < d.materials.len(),
            Object::Light(light) => light < d.lights.len(),
            Object::Medium(medium) => medium < d.media.len(),
            Object::Texture(texture) => texture < d.textures.len(),
            Object::Collection(Collection::Instances(index)) => index < d.instances.len(),
            Object::Camera | Object::Environment | Object::Collection(_) => true,
        };
        let fits = |rest: &Rest| {
            let has = |(&shape, mesh): (&usize, &Mesh)| d.shapes[shape].mesh.has_topology_of(mesh);
            d.moved_with(object) == rest.parts && rest.parts.shapes.iter().zip(&rest.meshes).all(has)
        };
        exists
            && member.dimensions(scene).iter().product::<usize>() == numbers
            && member.quantity.posed().and_then(|object| self.rest(object)).is_none_or(fits)
    }

    fn apply_checked(&self, x: &[f64], scene: &mut Scene) -> Result<(), SceneError> {
        // The camera may be inside an object that moves away, or the reverse: either order may fail.
        if self.apply_camera(x, scene).is_ok() {
            self.apply_implicits(x, scene)?;
        } else {
            self.apply_implicits(x, scene)?;
            self.apply_camera(x, scene)?;
        }
        self.apply_lights(x, scene)?;
        let is_texture = |quantity: &Quantity| matches!(quantity, Quantity::Texture { .. });
        let alone = self.quantities().into_iter().filter(|quantity| stands_alone(*quantity));
        let (textures, others): (Vec<_>, Vec<_>) = alone.partition(is_texture);
        self.apply_each(x, &others, scene)?;
        let meshes: Vec<(usize, Mesh)> =
            self.meshes(x, scene).map_err(|(id, error)| SceneError::Mesh { id, error })?;
        if !meshes.is_empty() {
            scene.set_meshes(meshes)?;
        }
        // Last, as they are not restored: finite texels are never refused.
        self.apply_each(x, &textures, scene)
    }

    fn apply_each(&self, x: &[f64], quantities: &[Quantity], scene: &mut Scene) -> Result<(), SceneError> {
        for &quantity in quantities {
            let Some(whole) = self.whole(x, quantity, || values(scene, quantity)) else { continue };
            apply_alone(quantity, &whole, scene)?;
        }
        Ok(())
    }

    fn apply_implicits(&self, x: &[f64], scene: &mut Scene) -> Result<(), SceneError> {
        for implicit in 0..scene.description().implicits.len() {
            let quantity = Quantity::Sdf { implicit };
            let surface = self.whole(x, quantity, || values(scene, quantity));
            let placed = self.rests.iter().find_map(|rest| {
                let at = rest.parts.implicits.iter().position(|&i| i == implicit)?;
                Some(self.pose(x, rest.object).placement(rest.centre, rest.placements[at]))
            });
            if surface.is_none() && placed.is_none() {
                continue;
            }
            let mut shape = scene.description().implicits[implicit].clone();
            if let Some(parameters) = surface {
                let made = shape.surface.with_parameters(&parameters);
                shape.surface = made.map_err(|error| SceneError::Implicit { id: shape.id.clone(), error })?;
            }
            shape.placement = placed.unwrap_or(shape.placement);
            scene.set_implicit(implicit, shape)?;
        }
        Ok(())
    }

    /// Places lights without a surface, and rotates the environment.
    fn apply_lights(&self, x: &[f64], scene: &mut Scene) -> Result<(), SceneError> {
        for rest in &self.rests {
            let Rest { object, centre, parts, lights, environment, .. } = rest;
            let pose = self.pose(x, *object);
            for (&index, at_rest) in parts.lights.iter().zip(lights) {
                let mut light = scene.description().lights[index].clone();
                pose.place(*centre, at_rest, &mut light);
                scene.set_light(index, light)?;
            }
            let Some(at_rest) = environment else { continue };
            let mut map = scene.description().environment.clone();
            if let Some(Environment::Map { to_world, .. }) = &mut map {
                *to_world = pose.turned(*at_rest);
            }
            scene.set_environment(map)?;
        }
        Ok(())
    }

    fn apply_camera(&self, x: &[f64], scene: &mut Scene) -> Result<(), SceneError> {
        let (rest, mut camera) = (&self.camera, scene.description().camera.clone());
        let shift = self.vector(x, Quantity::CameraTranslation);
        let pivot = shift.map_or_else(|| camera.pivot(), |shift| rest.pivot() + shift);
        if let Some(turn) = self.vector(x, Quantity::CameraRotation) {
            let turn = DQuat::from_scaled_axis(turn);
            [camera.right, camera.up, camera.forward] =
                [rest.right, rest.up, rest.forward].map(|axis| turn * axis);
        }
        // A perspective camera rotates in place.
        camera.origin = pivot - camera.orthographic.unwrap_or(0.0) * camera.forward;
        if let Some(angle) = self.whole(x, Quantity::FieldOfView, || vec![camera.field_of_view]) {
            camera.field_of_view = angle[0];
        }
        scene.set_camera(camera)
    }

    /// The moved meshes with the indices of their shapes; or the name of a shape whose mesh is invalid.
    fn meshes(&self, x: &[f64], scene: &Scene) -> Result<Vec<(usize, Mesh)>, (String, MeshError)> {
        let mut moved = vec![];
        for (index, shape) in scene.description().shapes.iter().enumerate() {
            let rest = self.rests.iter().find_map(|rest| {
                let at = rest.parts.shapes.iter().position(|&s| s == index)?;
                Some((rest, &rest.meshes[at]))
            });
            let mut mesh = rest.map_or(&shape.mesh, |(_, mesh)| mesh).clone();
            let flat = || mesh.positions().iter().flat_map(DVec3::to_array).collect();
            let own = self.whole(x, Quantity::VertexPositions { shape: index }, flat);
            if own.is_none() && rest.is_none() {
                continue;
            }
            if let Some(positions) = own {
                let positions = positions.chunks_exact(3).map(DVec3::from_slice).collect();
                mesh = mesh.with_positions(positions).map_err(|error| (shape.id.clone(), error))?;
            }
            if let Some((rest, _)) = rest {
                mesh = mesh.transformed(&self.pose(x, rest.object).map(rest.centre));
            }
            moved.push((index, mesh));
        }
        Ok(moved)
    }
}

/// Everything that `apply` may set before it fails: a description without meshes and textures, and the
/// radiance of each shape.
fn saved(scene: &Scene) -> (Description, Vec<Option<DVec3>>) {
    let d = scene.description();
    let mut saved = Description::new(d.camera.clone(), d.film);
    (saved.implicits, saved.lights) = (d.implicits.clone(), d.lights.clone());
    (saved.environment, saved.materials) = (d.environment.clone(), d.materials.clone());
    (saved, d.shapes.iter().map(|shape| shape.radiance).collect())
}

/// Whether a quantity belongs to a material, a texture or emission, and is applied independently of all
/// others.
fn stands_alone(quantity: Quantity) -> bool {
    match quantity {
        Quantity::Radiance { .. }
        | Quantity::EnvironmentRadiance
        | Quantity::Intensity { .. }
        | Quantity::Reflectance { .. }
        | Quantity::Roughness { .. }
        | Quantity::Texture { .. } => true,
        Quantity::VertexPositions { .. }
        | Quantity::Translation { .. }
        | Quantity::Rotation { .. }
        | Quantity::Scale { .. }
        | Quantity::Sdf { .. }
        | Quantity::CameraTranslation
        | Quantity::CameraRotation
        | Quantity::FieldOfView => false,
    }
}

/// Applies an independent quantity.
fn apply_alone(quantity: Quantity, whole: &[f64], scene: &mut Scene) -> Result<(), SceneError> {
    let vector = || DVec3::from_slice(whole);
    match quantity {
        Quantity::Radiance { shape } => scene.set_radiance(shape, Some(vector())),
        Quantity::EnvironmentRadiance => {
            let mut environment = scene.description().environment.clone();
            if let Some(Environment::Constant { radiance, .. }) = &mut environment {
                *radiance = vector();
            }
            scene.set_environment(environment)
        }
        Quantity::Intensity { light: index } => {
            let mut light = scene.description().lights[index].clone();
            *light.power_mut() = vector();
            scene.set_light(index, light)
        }
        Quantity::Reflectance { material: index } => {
            let mut material = scene.description().materials[index].clone();
            *material.bsdf.reflectance_mut() = Reflectance::Constant(vector());
            scene.set_material(index, material)
        }
        Quantity::Roughness { material: index } => {
            let mut material = scene.description().materials[index].clone();
            if let Some(alpha) = material.bsdf.roughness_mut() {
                *alpha = whole[0];
            }
            scene.set_material(index, material)
        }
        Quantity::Texture { texture: index, .. } => {
            let mut texture = scene.description().textures[index].clone();
            texture.texels = whole.chunks_exact(3).map(DVec3::from_slice).collect();
            scene.set_texture(index, texture)
        }
        _ => Ok(()),
    }
}
