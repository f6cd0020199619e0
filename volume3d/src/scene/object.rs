//! What a scene is made of, by kind and index; and what of it moves as one.

use glam::DVec3;

use super::{Description, Environment, Instances, Light};

/// Something of a scene, by its index among those of its kind.
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
    /// What is seen where a ray leaves the scene.
    Environment,
    /// A medium.
    Medium(usize),
    /// A texture.
    Texture(usize),
    /// Several things with one name.
    Collection(Collection),
}

/// Several things that move as one.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub enum Collection {
    /// All shapes and implicit surfaces, those that emit among them.
    All,
    /// Everything that emits: shapes, lights without a surface, and the environment, which can only be
    /// turned.
    Lights,
    /// The copies of one instance, or of all instances of one group, by the index in
    /// [`Description::instances`].
    Instances(usize),
}

/// What of a scene moves with something.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct Parts {
    /// Shapes, by their index.
    pub shapes: Vec<usize>,
    /// Implicit surfaces, by theirs.
    pub implicits: Vec<usize>,
    /// Lights without a surface, by theirs.
    pub lights: Vec<usize>,
    /// Whether the environment turns with it.
    pub environment: bool,
}

impl Description {
    /// What moves with something: nothing with what has no place, such as a material. Of lights and
    /// environments only those are there that have a place or a direction.
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

    /// About what something is turned and scaled: the mean of all its vertices; without any, that of where
    /// its implicit surfaces and lights stand.
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
    /// Where it is, if it is in one point.
    #[must_use]
    pub fn position(&self) -> Option<DVec3> {
        match self {
            Self::Directional { .. } => None,
            Self::Point { position, .. } | Self::Spot { position, .. } | Self::Projector { position, .. } => {
                Some(*position)
            }
        }
    }

    /// Whether it has a direction: whether turning it about where it is changes anything.
    #[must_use]
    pub fn has_direction(&self) -> bool {
        !matches!(self, Self::Point { .. })
    }
}
