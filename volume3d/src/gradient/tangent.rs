//! A direction in the space of a scene's parameters; and, as its dual, a gradient.

use glam::{DMat3, DVec3};

use super::ImplicitTangent;
use crate::scene::{Blend, Light, Reflectance, Scene, Value};

/// Rates of the camera.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct CameraTangent {
    /// Of its origin, scene units.
    pub translation: DVec3,
    /// Angular velocity about its origin, or the middle of an orthographic sensor
    /// ([`Camera::pivot`](crate::scene::Camera::pivot)), radians.
    pub rotation: DVec3,
    /// Of the horizontal field of view, radians; an orthographic camera has none.
    pub field_of_view: f64,
}

/// One rate for every parameter of a scene: the direction of a forward derivative. The same type holds the
/// derivative by every parameter, which is what reverse mode returns: [`dot`](Self::dot) pairs the two.
///
/// Built by adding up motions:
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
    /// Of every position of every shape, one shape after the other.
    pub positions: Vec<DVec3>,
    /// Of every shading normal, in the same order. Those that follow from positions are not parameters: theirs
    /// are ignored, and zero in a gradient.
    pub normals: Vec<DVec3>,
    /// Of every implicit surface.
    pub implicits: Vec<ImplicitTangent>,
    /// Of every material's constant reflectance; nothing where it is a texture.
    pub reflectance: Vec<DVec3>,
    /// Of every material's roughness; nothing where it has none.
    pub roughness: Vec<f64>,
    /// Of every texture's texels.
    pub texels: Vec<Vec<DVec3>>,
    /// Of every shape's radiance; nothing where it emits none.
    pub radiance: Vec<DVec3>,
    /// Of the intensity or irradiance of every light.
    pub intensity: Vec<DVec3>,
    /// Of every point light's position, or the angular velocity of every directional light.
    pub pose: Vec<DVec3>,
    /// The angular velocity of every spot and projector about its position; nothing for other lights.
    pub light_rotation: Vec<DVec3>,
    /// Of a constant environment's radiance.
    pub environment: DVec3,
    /// The angular velocity of an environment map.
    pub environment_rotation: DVec3,
    /// Of the camera.
    pub camera: CameraTangent,
}

impl Tangent {
    /// No change at all.
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

    /// The rates of one shape's positions: what `SHAPE.vertex_positions` means.
    #[must_use]
    pub fn positions_of(&self, scene: &Scene, shape: usize) -> &[DVec3] {
        &self.positions[scene.position_range(shape)]
    }

    /// The same, to be changed.
    pub fn positions_of_mut(&mut self, scene: &Scene, shape: usize) -> &mut [DVec3] {
        &mut self.positions[scene.position_range(shape)]
    }

    /// Moves a shape along `velocity`: ẋ = v.
    pub fn translate(&mut self, scene: &Scene, shape: usize, velocity: DVec3) {
        self.affine(scene, shape, DVec3::ZERO, DMat3::ZERO, velocity);
    }

    /// Turns a shape about an axis through `centre`, right-handed, by |ω| radians: ẋ = ω × (x − c). Given normals
    /// turn with it.
    pub fn rotate(&mut self, scene: &Scene, shape: usize, centre: DVec3, angular_velocity: DVec3) {
        let w = angular_velocity;
        let skew = DMat3::from_cols(w.cross(DVec3::X), w.cross(DVec3::Y), w.cross(DVec3::Z));
        self.affine(scene, shape, centre, skew, DVec3::ZERO);
        let range = scene.normal_range(shape);
        for (rate, normal) in self.normals[range.clone()].iter_mut().zip(&scene.normals[range]) {
            *rate += w.cross(*normal);
        }
    }

    /// Scales a shape about `centre`: ẋ = s (x − c).
    pub fn scale(&mut self, scene: &Scene, shape: usize, centre: DVec3, rate: f64) {
        self.affine(scene, shape, centre, DMat3::from_diagonal(DVec3::splat(rate)), DVec3::ZERO);
    }

    fn affine(&mut self, scene: &Scene, shape: usize, centre: DVec3, matrix: DMat3, velocity: DVec3) {
        let (range, centre) = (scene.position_range(shape), centre - scene.offset());
        for (rate, x) in self.positions[range.clone()].iter_mut().zip(&scene.positions[range]) {
            *rate += matrix * (*x - centre) + velocity;
        }
    }

    /// The sum of products of all rates: a derivative along a direction from a gradient.
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

    /// Whether its tables have the sizes of the scene's.
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

    /// Adds another, rate by rate.
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

    /// Hands the covectors of computed normals on to the positions they follow from.
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

    /// Whether anything changes besides: materials, textures, lights, and what surrounds all.
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

    /// Whether any light without a surface is shifted or turned: whether shadows without width may move.
    #[must_use]
    pub fn moves_lights(&self) -> bool {
        self.pose.iter().chain(&self.light_rotation).any(|rate| *rate != DVec3::ZERO)
    }

    /// Whether any position or normal changes, or the camera: whether jumps may move.
    #[must_use]
    pub fn is_geometric(&self) -> bool {
        let any = |rates: &[DVec3]| rates.iter().any(|r| *r != DVec3::ZERO);
        let implicit = self.implicits.iter().any(|rates| !rates.is_still());
        any(&self.positions) || any(&self.normals) || implicit || self.camera != CameraTangent::default()
    }
}

/// Which parameters a reverse sweep must report.
#[derive(Clone, Debug, PartialEq)]
pub struct ActiveParameters {
    /// Whether each shape's positions, and its given normals, are active.
    pub shapes: Vec<bool>,
    /// Whether each implicit surface's parameters and place are active.
    pub implicits: Vec<bool>,
    /// Whether each material's reflectance, texture and roughness are.
    pub materials: Vec<bool>,
    /// Whether the radiance of shapes and of the environment, and the intensity of lights, are.
    pub lights: bool,
    /// Whether the place and turn of each light without a surface are.
    pub poses: Vec<bool>,
    /// Whether the turn of the environment is.
    pub environment_rotation: bool,
    /// Whether the camera's place, turn and field of view are.
    pub camera: bool,
}

impl ActiveParameters {
    /// Nothing yet.
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

    /// Whether any light without a surface may be shifted or turned.
    #[must_use]
    pub fn moves_lights(&self) -> bool {
        self.poses.contains(&true)
    }

    /// Whether anything active moves geometry.
    #[must_use]
    pub fn is_geometric(&self) -> bool {
        self.camera || self.shapes.iter().chain(&self.implicits).any(|&s| s)
    }

    /// For every texture, whether its texels are active.
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
            if let Some(texture) = material.roughness_texture {
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
