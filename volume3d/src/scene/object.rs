//! Objects of a scene, by kind and index, and collections of objects that move together.

use glam::DVec3;

use super::{Description, Environment, Instances, Light};

/// An object of a scene, by its index among objects of its kind.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub enum Object {
    /// The camera.
    Camera,
    /// A mesh.
    Shape(usize),
    /// An implicit surface.
    Implicit(usize),
    /// A material.
    Material(usize),
    /// A light without a surface.
    Light(usize),
    /// Emission of rays that leave the scene.
    Environment,
    /// A medium.
    Medium(usize),
    /// A texture.
    Texture(usize),
    /// Several objects with one name.
    Collection(Collection),
}

/// Several objects that move together.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub enum Collection {
    /// All shapes and implicit surfaces, emitters included.
    All,
    /// Everything that emits: shapes, lights without a surface, and the environment, which only rotates.
    Lights,
    /// The copies of one instance, or of all instances of one group, by the index in
    /// [`Description::instances`].
    Instances(usize),
}

/// Parts of a scene that move with an object.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct Parts {
    /// Indices of shapes.
    pub shapes: Vec<usize>,
    /// Indices of implicit surfaces, among implicit surfaces.
    pub implicits: Vec<usize>,
    /// Indices of lights without a surface.
    pub lights: Vec<usize>,
    /// Whether the environment rotates with it.
    pub environment: bool,
}

impl Description {
    /// Parts that move with an object: none with an object that has no position, such as a material. Lights
    /// and environments are included only if they have a position or a direction.
    #[must_use]
    pub fn moved_with(&self, object: Object) -> Parts {
        let has_map = matches!(self.environment, Some(Environment::Map { .. }));
        match object {
            Object::Shape(shape) => Parts { shapes: vec![shape], ..Parts::default() },
            Object::Implicit(implicit) => Parts { implicits: vec![implicit], ..Parts::default() },
            Object::Light(light) => Parts { lights: vec![light], ..Parts::default() },
            Object::Environment => Parts { environment: has_map, ..Parts::default() },
            Object::Collection(Collection::All) => Parts {
                shapes: (0..self.shapes.len()).collect(),
                implicits: (0..self.implicits.len()).collect(),
                ..Parts::default()
            },
            Object::Collection(Collection::Lights) => Parts {
                shapes: (0..self.shapes.len()).filter(|&s| self.shapes[s].radiance.is_some()).collect(),
                implicits: vec![],
                lights: (0..self.lights.len()).collect(),
                environment: has_map,
            },
            Object::Collection(Collection::Instances(index)) => {
                let Instances { shapes, implicits, .. } = &self.instances[index];
                Parts { shapes: shapes.clone(), implicits: implicits.clone(), ..Parts::default() }
            }
            Object::Camera | Object::Material(_) | Object::Medium(_) | Object::Texture(_) => Parts::default(),
        }
    }

    /// Pivot of rotation and scaling: the mean of all vertices or, without vertices, the mean position of
    /// implicit surfaces and lights.
    #[must_use]
    pub fn centre_of(&self, parts: &Parts) -> DVec3 {
        let mean = |points: &mut dyn Iterator<Item = DVec3>| {
            let (sum, count) = points.fold((DVec3::ZERO, 0), |(sum, count), p| (sum + p, count + 1));
            (count > 0).then(|| sum / f64::from(count))
        };
        let vertices = parts.shapes.iter().flat_map(|&s| self.shapes[s].mesh.positions());
        let implicits = parts.implicits.iter().map(|&i| self.implicits[i].placement.translation);
        let lights = parts.lights.iter().filter_map(|&l| self.lights[l].position());
        let places = &mut implicits.chain(lights);
        mean(&mut vertices.copied()).or_else(|| mean(places)).unwrap_or(DVec3::ZERO)
    }
}

impl Light {
    /// Position of the light; `None` for a directional one.
    #[must_use]
    pub fn position(&self) -> Option<DVec3> {
        match self {
            Self::Directional { .. } => None,
            Self::Point { position, .. } | Self::Spot { position, .. } | Self::Projector { position, .. } => {
                Some(*position)
            }
        }
    }

    /// Whether it has a direction, so that a rotation about its own position changes its light.
    #[must_use]
    pub fn has_direction(&self) -> bool {
        !matches!(self, Self::Point { .. })
    }
}
