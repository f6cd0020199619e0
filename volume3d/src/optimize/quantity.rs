//! Quantities: kinds of scene parameters, with their sizes and bounds.

use glam::DVec3;

use crate::gradient::ActiveParameters;
use crate::scene::{Bsdf, Environment, Light, Material, Object, Reflectance, Scene, Value};

/// Kind of a parameter and the object of the scene that has it.
///
/// Bounds are widened to include the initial values of a scene. A shape called `camera` has no parameters:
/// its name is the camera's. One component of a vector or colour is a parameter as well:
/// `bunny.translation.x`, `lamp.radiance.r`, `bunny.vertex_positions.y` (one a vertex).
///
/// | name | values | default bounds |
/// |---|---|---|
/// | `SHAPE.vertex_positions` | 3 a vertex, scene units | none |
/// | `THING.translation` of a shape, an implicit surface, a point light, spot or projector, or a collection | 3, scene units, from where it was | none |
/// | `THING.rotation` of the same, but for point lights, and of directional lights and environment maps | 3, a rotation vector in radians, about the moving centre | none |
/// | `THING.scale` of a shape or a collection of shapes | 1, about the moving centre | at least 10⁻³ |
/// | `SHAPE.sdf` of an implicit surface | its parameters: node values of a grid, weights of a network | none |
/// | `SHAPE.radiance`, `LIGHT.radiance` of a constant environment | 3, linear RGB | at least 0 |
/// | `SHAPE.radiance_texture` of a shape that emits | 3 a texel, by which the radiance is multiplied | at least 0 |
/// | `LIGHT.intensity`, `LIGHT.irradiance` | 3, linear RGB | at least 0 |
/// | `LIGHT.texture` of a spot, a projector or an environment map | 3 a texel, linear RGB | at least 0 |
/// | `MATERIAL.reflectance` | 3, linear RGB: of what [`Bsdf::reflectance`](crate::scene::Bsdf::reflectance) says | 0 to 1 |
/// | `MATERIAL.roughness` | 1, α, or of principled materials √α | 10⁻³ to 1 |
/// | `MATERIAL.texture` | 3 a texel of the reflectance, linear RGB | 0 to 1 |
/// | `MATERIAL.roughness_texture` | 3 a texel, of which the luminance counts | 10⁻³ to 1 |
/// | `MATERIAL.metallic_texture` | 3 a texel, of which the luminance counts | 0 to 1 |
/// | `camera.translation` | 3, scene units, from where it was | none |
/// | `camera.rotation` | 3, a rotation vector in radians, about its origin, or the middle of an orthographic sensor | none |
/// | `camera.fov` | 1, radians, horizontal, of a perspective camera | 0.01 to 3.1 |
///
/// A collection is `all`, all shapes and implicit surfaces; `lights`, everything that emits; or the name of
/// an instance, or of a group of shapes with all its instances. Its centre is the mean of all its vertices,
/// that of a shape the mean of its own, that of a light or implicit surface its position.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[expect(missing_docs, reason = "each is one row of the table, with the index of what has it")]
pub enum Quantity {
    VertexPositions { shape: usize },
    Translation { of: Object },
    Rotation { of: Object },
    Scale { of: Object },
    Sdf { implicit: usize },
    Radiance { shape: usize },
    EnvironmentRadiance,
    Intensity { light: usize },
    Reflectance { material: usize },
    Roughness { material: usize },
    Texture { texture: usize, of: TextureUse },
    CameraTranslation,
    CameraRotation,
    FieldOfView,
}

/// The use of a texture.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[expect(missing_docs, reason = "each has the index of what looks it up")]
pub enum TextureUse {
    Reflectance { material: usize },
    Roughness { material: usize },
    Metallic { material: usize },
    Radiance { shape: usize },
    Beam { light: usize },
    Environment,
}

/// A parameter, or one component of each of its vectors.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Member {
    /// The quantity.
    pub quantity: Quantity,
    /// The component of each vector or colour, if not all three.
    pub component: Option<usize>,
}

impl Quantity {
    /// The parameters of an object, with the part of their names after the dot.
    #[must_use]
    pub fn of(scene: &Scene, object: Object) -> Vec<(&'static str, Self)> {
        let d = scene.description();
        let mut found = vec![];
        match object {
            Object::Camera => {
                found.extend([("translation", Self::CameraTranslation), ("rotation", Self::CameraRotation)]);
                found.extend(d.camera.orthographic.is_none().then_some(("fov", Self::FieldOfView)));
            }
            Object::Shape(shape) => found.push(("vertex_positions", Self::VertexPositions { shape })),
            Object::Implicit(implicit) => found.push(("sdf", Self::Sdf { implicit })),
            Object::Material(material) => found.extend(of_material(&d.materials[material], material)),
            Object::Light(light) => {
                let name = match d.lights[light] {
                    Light::Directional { .. } => "irradiance",
                    _ => "intensity",
                };
                found.push((name, Self::Intensity { light }));
                let of = TextureUse::Beam { light };
                found.extend(
                    d.lights[light].texture().map(|texture| ("texture", Self::Texture { texture, of })),
                );
            }
            Object::Environment => found.push(match d.environment {
                Some(Environment::Map { texture, .. }) => {
                    ("texture", Self::Texture { texture, of: TextureUse::Environment })
                }
                _ => ("radiance", Self::EnvironmentRadiance),
            }),
            Object::Medium(_) | Object::Texture(_) | Object::Collection(_) => {}
        }
        let parts = d.moved_with(object);
        let has_bodies = !(parts.shapes.is_empty() && parts.implicits.is_empty());
        let has_place = has_bodies || parts.lights.iter().any(|&l| d.lights[l].position().is_some());
        // Several point lights are rotated about their mean.
        let points = parts.lights.len() > 1 && has_place;
        let turns = has_bodies
            || points
            || parts.environment
            || parts.lights.iter().any(|&l| d.lights[l].has_direction());
        found.extend(has_place.then_some(("translation", Self::Translation { of: object })));
        found.extend(turns.then_some(("rotation", Self::Rotation { of: object })));
        let scales = !parts.shapes.is_empty()
            && parts.implicits.is_empty()
            && parts.lights.is_empty()
            && !parts.environment;
        found.extend(scales.then_some(("scale", Self::Scale { of: object })));
        if let Object::Shape(shape) = object
            && d.shapes[shape].radiance.is_some()
        {
            found.push(("radiance", Self::Radiance { shape }));
            let of = TextureUse::Radiance { shape };
            let texture = d.shapes[shape].radiance_texture;
            found.extend(texture.map(|texture| ("radiance_texture", Self::Texture { texture, of })));
        }
        found
    }

    /// The dimensions of its array: () for a number, (3) for a vector or colour, (vertices, 3) for positions,
    /// (height, width, 3) for a texture.
    #[must_use]
    pub fn dimensions(self, scene: &Scene) -> Vec<usize> {
        let d = scene.description();
        match self {
            Self::VertexPositions { shape } => vec![d.shapes[shape].mesh.positions().len(), 3],
            Self::Sdf { implicit } => vec![d.implicits[implicit].surface.dimension()],
            Self::Texture { texture, .. } => vec![d.textures[texture].height, d.textures[texture].width, 3],
            Self::Scale { .. } | Self::Roughness { .. } | Self::FieldOfView => vec![],
            _ => vec![3],
        }
    }

    /// Default lower and upper bound of each of its numbers.
    #[must_use]
    pub fn default_bounds(self) -> [f64; 2] {
        match self {
            Self::Scale { .. } => [1e-3, f64::INFINITY],
            Self::Radiance { .. } | Self::EnvironmentRadiance | Self::Intensity { .. } => {
                [0.0, f64::INFINITY]
            }
            Self::Texture { of, .. } => match of {
                TextureUse::Reflectance { .. } | TextureUse::Metallic { .. } => [0.0, 1.0],
                TextureUse::Roughness { .. } => [1e-3, 1.0],
                TextureUse::Radiance { .. } | TextureUse::Beam { .. } | TextureUse::Environment => {
                    [0.0, f64::INFINITY]
                }
            },
            Self::Reflectance { .. } => [0.0, 1.0],
            Self::Roughness { .. } => [1e-3, 1.0],
            Self::FieldOfView => [0.01, 3.1],
            _ => [f64::NEG_INFINITY, f64::INFINITY],
        }
    }

    /// The component names of its vectors; `None` if it has none.
    #[must_use]
    pub fn components(self) -> Option<[&'static str; 3]> {
        match self {
            Self::VertexPositions { .. }
            | Self::Translation { .. }
            | Self::Rotation { .. }
            | Self::CameraTranslation
            | Self::CameraRotation => Some(["x", "y", "z"]),
            Self::Radiance { .. }
            | Self::EnvironmentRadiance
            | Self::Intensity { .. }
            | Self::Reflectance { .. }
            | Self::Texture { .. } => Some(["r", "g", "b"]),
            Self::Scale { .. } | Self::Sdf { .. } | Self::Roughness { .. } | Self::FieldOfView => None,
        }
    }

    /// Marks it as active.
    pub fn activate(self, scene: &Scene, active: &mut ActiveParameters) {
        match self {
            Self::VertexPositions { shape } => active.shapes[shape] = true,
            Self::Translation { of } | Self::Rotation { of } | Self::Scale { of } => {
                let parts = scene.description().moved_with(of);
                parts.shapes.into_iter().for_each(|shape| active.shapes[shape] = true);
                parts.implicits.into_iter().for_each(|implicit| active.implicits[implicit] = true);
                for light in parts.lights {
                    // Directional light does not depend on the position of its source, nor a point light's on
                    // its rotation.
                    let shifts = scene.description().lights[light].position().is_some();
                    active.poses[light] |= shifts || matches!(self, Self::Rotation { .. });
                }
                active.environment_rotation |= parts.environment && matches!(self, Self::Rotation { .. });
            }
            Self::Sdf { implicit } => active.implicits[implicit] = true,
            Self::Radiance { .. } | Self::EnvironmentRadiance | Self::Intensity { .. } => {
                active.lights = true;
            }
            Self::Texture { of, .. } => match of {
                TextureUse::Reflectance { material }
                | TextureUse::Roughness { material }
                | TextureUse::Metallic { material } => active.materials[material] = true,
                TextureUse::Radiance { .. } | TextureUse::Beam { .. } | TextureUse::Environment => {
                    active.lights = true;
                }
            },
            Self::Reflectance { material } | Self::Roughness { material } => {
                active.materials[material] = true;
            }
            Self::CameraTranslation | Self::CameraRotation | Self::FieldOfView => active.camera = true,
        }
    }

    /// Whether two quantities have the same values: two materials may share a texture.
    pub(crate) fn is(self, other: Self) -> bool {
        match (self, other) {
            (Self::Texture { texture: a, .. }, Self::Texture { texture: b, .. }) => a == b,
            _ => self == other,
        }
    }

    /// Whether it is a rotation, whose steps are composed.
    pub(crate) fn turns(self) -> bool {
        matches!(self, Self::Rotation { .. } | Self::CameraRotation)
    }

    /// The object that it places as a whole.
    pub(crate) fn posed(self) -> Option<Object> {
        match self {
            Self::Translation { of } | Self::Rotation { of } | Self::Scale { of } => Some(of),
            _ => None,
        }
    }

    /// Whether its texture is a mesh attribute with texels out of range.
    pub(super) fn is_attribute_out_of_range(self, scene: &Scene) -> bool {
        let Self::Texture { texture, .. } = self else { return false };
        let [low, high] = self.default_bounds();
        let texture = &scene.description().textures[texture];
        let is_out = |c: &DVec3| c.min_element() < low || c.max_element() > high;
        texture.texels.iter().any(is_out) && texture.is_of_triangles()
    }
}

impl From<Quantity> for Member {
    fn from(quantity: Quantity) -> Self {
        Self { quantity, component: None }
    }
}

impl Member {
    /// Whether two members have a number in common.
    pub(super) fn overlaps(self, other: Self) -> bool {
        let differ = matches!((self.component, other.component), (Some(a), Some(b)) if a != b);
        self.quantity.is(other.quantity) && !differ
    }

    /// Selects its numbers from all of the quantity.
    pub(super) fn select(self, whole: Vec<f64>) -> Vec<f64> {
        match self.component {
            None => whole,
            Some(component) => whole.into_iter().skip(component).step_by(3).collect(),
        }
    }

    /// Writes its numbers into all of the quantity.
    pub(super) fn put(self, numbers: &[f64], whole: &mut [f64]) {
        match self.component {
            None => whole.copy_from_slice(numbers),
            Some(component) => {
                let places = whole.iter_mut().skip(component).step_by(3);
                places.zip(numbers).for_each(|(place, number)| *place = *number);
            }
        }
    }

    /// The dimensions of its array: those of the quantity, without the last if it is one component of each
    /// vector.
    #[must_use]
    pub fn dimensions(self, scene: &Scene) -> Vec<usize> {
        let mut dimensions = self.quantity.dimensions(scene);
        if self.component.is_some() {
            dimensions.pop();
        }
        dimensions
    }
}

fn of_material(m: &Material, material: usize) -> Vec<(&'static str, Quantity)> {
    let texture = |name, texture, of| (name, Quantity::Texture { texture, of });
    let mut found = vec![match m.bsdf.reflectance() {
        Reflectance::Constant(_) => ("reflectance", Quantity::Reflectance { material }),
        Reflectance::Texture(index) => texture("texture", *index, TextureUse::Reflectance { material }),
    }];
    found.extend(m.bsdf.roughness().map(|_| ("roughness", Quantity::Roughness { material })));
    let (roughness, metallic) = match &m.bsdf {
        Bsdf::Principled(principled) => (Some(principled.roughness), Some(principled.metallic)),
        Bsdf::PrincipledThin(thin) => (Some(thin.roughness), None),
        _ => {
            // One texture for both axes: two would be two parameters of the same name.
            let [along, across] = m.roughness_textures;
            (along.filter(|_| along == across).map(Value::Texture), None)
        }
    };
    for (name, value, of) in [
        ("roughness_texture", roughness, TextureUse::Roughness { material }),
        ("metallic_texture", metallic, TextureUse::Metallic { material }),
    ] {
        if let Some(Value::Texture(index)) = value {
            found.push(texture(name, index, of));
        }
    }
    found
}
