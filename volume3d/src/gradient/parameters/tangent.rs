//! Tangents: directions in the space of a scene's parameters; as the dual, gradients.

use glam::{DMat3, DVec3};

use crate::gradient::ImplicitTangent;
use crate::scene::{Blend, Light, Reflectance, Scene, Value};

/// Rates of the camera.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct CameraTangent {
    /// Velocity of its origin, scene units.
    pub translation: DVec3,
    /// Angular velocity about its origin or, for an orthographic camera, the centre of its sensor
    /// ([`Camera::pivot`](crate::scene::Camera::pivot)), radians.
    pub rotation: DVec3,
    /// Rate of the horizontal field of view, radians; not used by an orthographic camera.
    pub field_of_view: f64,
}

/// One rate for every parameter of a scene: the direction of a forward derivative. Reverse mode returns the
/// derivative by every parameter in the same type; [`dot`](Self::dot) pairs the two.
///
/// Build one by adding motions:
///
/// ```no_run
/// # use volume3d::{gradient::Tangent, scene::Scene};
/// # use glam::DVec3;
/// # fn f(scene: &Scene) {
/// let mut change = Tangent::still(scene);
/// change.translate(scene, 0, DVec3::X);
/// change.camera.rotation += DVec3::Y;
/// # }
/// ```
#[derive(Clone, Debug, PartialEq)]
pub struct Tangent {
    /// Velocity of every position, shape by shape.
    pub positions: Vec<DVec3>,
    /// Rates of all shading normals, in the same order. Normals computed from positions are not parameters:
    /// their rates are ignored, and zero in a gradient.
    pub normals: Vec<DVec3>,
    /// Rates of every implicit surface.
    pub implicits: Vec<ImplicitTangent>,
    /// Rate of every material's constant reflectance; unused if it is textured.
    pub reflectance: Vec<DVec3>,
    /// Rate of every material's roughness; unused if it has none.
    pub roughness: Vec<f64>,
    /// Rates of every texture's texels.
    pub texels: Vec<Vec<DVec3>>,
    /// Rate of every shape's radiance; unused if it emits none.
    pub radiance: Vec<DVec3>,
    /// Rate of every light's intensity or irradiance.
    pub intensity: Vec<DVec3>,
    /// Velocity of every point light's position; angular velocity of every directional light.
    pub pose: Vec<DVec3>,
    /// Angular velocity of every spot and projector about its position; unused for other lights.
    pub light_rotation: Vec<DVec3>,
    /// Rate of a constant environment's radiance.
    pub environment: DVec3,
    /// Angular velocity of an environment map.
    pub environment_rotation: DVec3,
    /// Rates of the camera.
    pub camera: CameraTangent,
}

impl Tangent {
    /// The zero tangent.
    #[must_use]
    pub fn still(scene: &Scene) -> Self {
        let d = scene.description();
        Self {
            positions: vec![DVec3::ZERO; scene.positions.len()],
            normals: vec![DVec3::ZERO; scene.normals.len()],
            implicits: d.implicits.iter().map(ImplicitTangent::still).collect(),
            reflectance: vec![DVec3::ZERO; d.materials.len()],
            roughness: vec![0.0; d.materials.len()],
            texels: d.textures.iter().map(|t| vec![DVec3::ZERO; t.texels.len()]).collect(),
            radiance: vec![DVec3::ZERO; d.shapes.len()],
            intensity: vec![DVec3::ZERO; d.lights.len()],
            pose: vec![DVec3::ZERO; d.lights.len()],
            light_rotation: vec![DVec3::ZERO; d.lights.len()],
            environment: DVec3::ZERO,
            environment_rotation: DVec3::ZERO,
            camera: CameraTangent::default(),
        }
    }

    /// Rates of one shape's positions, the parameter `SHAPE.vertex_positions`.
    #[must_use]
    pub fn positions_of(&self, scene: &Scene, shape: usize) -> &[DVec3] {
        &self.positions[scene.position_range(shape)]
    }

    /// Mutable rates of one shape's positions.
    pub fn positions_of_mut(&mut self, scene: &Scene, shape: usize) -> &mut [DVec3] {
        &mut self.positions[scene.position_range(shape)]
    }

    /// Adds a translation of a shape: ẋ = v.
    pub fn translate(&mut self, scene: &Scene, shape: usize, velocity: DVec3) {
        self.affine(scene, shape, DVec3::ZERO, DMat3::ZERO, velocity);
    }

    /// Adds a rotation of a shape about an axis through `centre`, right-handed, by |ω| radians:
    /// ẋ = ω × (x − c). Given normals rotate with it.
    pub fn rotate(&mut self, scene: &Scene, shape: usize, centre: DVec3, angular_velocity: DVec3) {
        let w = angular_velocity;
        let skew = DMat3::from_cols(w.cross(DVec3::X), w.cross(DVec3::Y), w.cross(DVec3::Z));
        self.affine(scene, shape, centre, skew, DVec3::ZERO);
        let range = scene.normal_range(shape);
        for (rate, normal) in self.normals[range.clone()].iter_mut().zip(&scene.normals[range]) {
            *rate += w.cross(*normal);
        }
    }

    /// Adds a scaling of a shape about `centre`: ẋ = s (x − c).
    pub fn scale(&mut self, scene: &Scene, shape: usize, centre: DVec3, rate: f64) {
        self.affine(scene, shape, centre, DMat3::from_diagonal(DVec3::splat(rate)), DVec3::ZERO);
    }

    fn affine(&mut self, scene: &Scene, shape: usize, centre: DVec3, matrix: DMat3, velocity: DVec3) {
        let (range, centre) = (scene.position_range(shape), centre - scene.offset());
        for (rate, x) in self.positions[range.clone()].iter_mut().zip(&scene.positions[range]) {
            *rate += matrix * (*x - centre) + velocity;
        }
    }

    /// Sum of products of all rates: from a gradient, the derivative along a tangent.
    #[must_use]
    pub fn dot(&self, other: &Self) -> f64 {
        let sum = |a: &[DVec3], b: &[DVec3]| a.iter().zip(b).map(|(a, b)| a.dot(*b)).sum::<f64>();
        sum(&self.positions, &other.positions)
            + sum(&self.normals, &other.normals)
            + self.implicits.iter().zip(&other.implicits).map(|(a, b)| a.dot(b)).sum::<f64>()
            + sum(&self.reflectance, &other.reflectance)
            + self.roughness.iter().zip(&other.roughness).map(|(a, b)| a * b).sum::<f64>()
            + self.texels.iter().zip(&other.texels).map(|(a, b)| sum(a, b)).sum::<f64>()
            + sum(&self.radiance, &other.radiance)
            + sum(&self.intensity, &other.intensity)
            + sum(&self.pose, &other.pose)
            + sum(&self.light_rotation, &other.light_rotation)
            + self.environment.dot(other.environment)
            + self.environment_rotation.dot(other.environment_rotation)
            + self.camera.translation.dot(other.camera.translation)
            + self.camera.rotation.dot(other.camera.rotation)
            + self.camera.field_of_view * other.camera.field_of_view
    }

    /// Whether the tables have the sizes of the scene's.
    #[must_use]
    pub fn fits(&self, scene: &Scene) -> bool {
        let still = Self::still(scene);
        self.positions.len() == still.positions.len()
            && self.normals.len() == still.normals.len()
            && self
                .implicits
                .iter()
                .map(|i| i.parameters.len())
                .eq(still.implicits.iter().map(|i| i.parameters.len()))
            && self.reflectance.len() == still.reflectance.len()
            && self.roughness.len() == still.roughness.len()
            && self.texels.iter().map(Vec::len).eq(still.texels.iter().map(Vec::len))
            && self.radiance.len() == still.radiance.len()
            && self.intensity.len() == still.intensity.len()
            && self.pose.len() == still.pose.len()
            && self.light_rotation.len() == still.light_rotation.len()
    }

    /// Adds another tangent.
    pub(crate) fn add(&mut self, other: &Self) {
        let sum = |a: &mut [DVec3], b: &[DVec3]| a.iter_mut().zip(b).for_each(|(a, b)| *a += *b);
        sum(&mut self.positions, &other.positions);
        sum(&mut self.normals, &other.normals);
        self.implicits.iter_mut().zip(&other.implicits).for_each(|(a, b)| a.add(b));
        sum(&mut self.reflectance, &other.reflectance);
        self.roughness.iter_mut().zip(&other.roughness).for_each(|(a, b)| *a += b);
        self.texels.iter_mut().zip(&other.texels).for_each(|(a, b)| sum(a, b));
        sum(&mut self.radiance, &other.radiance);
        sum(&mut self.intensity, &other.intensity);
        sum(&mut self.pose, &other.pose);
        sum(&mut self.light_rotation, &other.light_rotation);
        self.environment += other.environment;
        self.environment_rotation += other.environment_rotation;
        self.camera.translation += other.camera.translation;
        self.camera.rotation += other.camera.rotation;
        self.camera.field_of_view += other.camera.field_of_view;
    }

    /// Propagates covectors of computed normals to positions.
    pub(crate) fn pull_normals(&mut self, scene: &Scene, active: &ActiveParameters) {
        scene.vertex_normals.transpose(&scene.positions, &self.normals, &mut self.positions);
        for (shape, description) in scene.description.shapes.iter().enumerate() {
            let given = matches!(description.mesh.normals(), crate::geometry::Normals::Given(_));
            if !given {
                self.normals[scene.normal_range(shape)].fill(DVec3::ZERO);
            }
            debug_assert!(
                active.shapes[shape] || self.positions_of(scene, shape).iter().all(|p| *p == DVec3::ZERO)
            );
        }
    }

    /// Whether any parameter other than geometry and camera changes: materials, textures, lights or the
    /// environment.
    pub(crate) fn is_more_than_geometric(&self) -> bool {
        let any = |rates: &[DVec3]| rates.iter().any(|r| *r != DVec3::ZERO);
        any(&self.reflectance)
            || self.roughness.iter().any(|r| *r != 0.0)
            || self.texels.iter().any(|rates| any(rates))
            || any(&self.radiance)
            || any(&self.intensity)
            || self.moves_lights()
            || any(&[self.environment, self.environment_rotation])
    }

    /// Whether any light without extent is translated or rotated, so that shadows without penumbra may move.
    #[must_use]
    pub fn moves_lights(&self) -> bool {
        self.pose.iter().chain(&self.light_rotation).any(|rate| *rate != DVec3::ZERO)
    }

    /// Whether any position, normal or the camera changes, so that discontinuities may move.
    #[must_use]
    pub fn is_geometric(&self) -> bool {
        let any = |rates: &[DVec3]| rates.iter().any(|r| *r != DVec3::ZERO);
        let implicit = self.implicits.iter().any(|rates| !rates.is_still());
        any(&self.positions) || any(&self.normals) || implicit || self.camera != CameraTangent::default()
    }
}

/// Parameters that a reverse pass differentiates.
#[derive(Clone, Debug, PartialEq)]
pub struct ActiveParameters {
    /// Whether each shape's positions and given normals are active.
    pub shapes: Vec<bool>,
    /// Whether each implicit surface's parameters and placement are active.
    pub implicits: Vec<bool>,
    /// Whether each material's reflectance, texture and roughness are active.
    pub materials: Vec<bool>,
    /// Whether the radiance of shapes and environment and the intensity of lights are active.
    pub lights: bool,
    /// Whether the position and rotation of each light without extent are active.
    pub poses: Vec<bool>,
    /// Whether the rotation of the environment is active.
    pub environment_rotation: bool,
    /// Whether the camera's position, rotation and field of view are active.
    pub camera: bool,
}

impl ActiveParameters {
    /// No parameter.
    #[must_use]
    pub fn nothing(scene: &Scene) -> Self {
        let d = scene.description();
        Self {
            shapes: vec![false; d.shapes.len()],
            implicits: vec![false; d.implicits.len()],
            materials: vec![false; d.materials.len()],
            lights: false,
            poses: vec![false; d.lights.len()],
            environment_rotation: false,
            camera: false,
        }
    }

    /// Every parameter.
    #[must_use]
    pub fn everything(scene: &Scene) -> Self {
        let d = scene.description();
        Self {
            shapes: vec![true; d.shapes.len()],
            implicits: vec![true; d.implicits.len()],
            materials: vec![true; d.materials.len()],
            lights: true,
            poses: vec![true; d.lights.len()],
            environment_rotation: true,
            camera: true,
        }
    }

    /// Whether any light without extent may be translated or rotated.
    #[must_use]
    pub fn moves_lights(&self) -> bool {
        self.poses.contains(&true)
    }

    /// Whether any active parameter moves geometry or the camera.
    #[must_use]
    pub fn is_geometric(&self) -> bool {
        self.camera || self.shapes.iter().chain(&self.implicits).any(|&s| s)
    }

    /// Whether each texture's texels are active.
    pub(crate) fn textures(&self, scene: &Scene) -> Vec<bool> {
        let d = scene.description();
        let mut active = vec![false; d.textures.len()];
        for (material, _) in d.materials.iter().zip(&self.materials).filter(|(_, w)| **w) {
            if let Reflectance::Texture(texture) = material.bsdf.reflectance() {
                active[*texture] = true;
            }
            for (_, value, _) in material.bsdf.values() {
                if let Value::Texture(texture) = value {
                    active[texture] = true;
                }
            }
            for texture in material.roughness_textures.into_iter().flatten() {
                active[texture] = true;
            }
            if let Some(Blend { weight: Value::Texture(texture), .. }) = material.blend {
                active[texture] = true;
            }
        }
        if self.lights {
            let shapes = d.shapes.iter().filter_map(|shape| shape.radiance_texture);
            shapes
                .chain(d.lights.iter().filter_map(Light::texture))
                .for_each(|texture| active[texture] = true);
        }
        if self.lights
            && let Some(crate::scene::Environment::Map { texture, .. }) = d.environment
        {
            active[texture] = true;
        }
        active
    }
}
