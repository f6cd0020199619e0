//! One parameter of a scene, by name.

use glam::DVec3;

use crate::gradient::ActiveParameters;
use crate::scene::{Emitter, NameError, Scene};

/// What a parameter is of, and which part of a scene has it.
///
/// Bounds are widened to include the values that a scene begins with. A shape called `camera` has no parameters: its name is the
/// camera's.
///
/// | name | values | default bounds |
/// |---|---|---|
/// | `SHAPE.vertex_positions` | 3 a vertex, scene units | none |
/// | `SHAPE.translation` | 3, scene units, from where the shape was | none |
/// | `SHAPE.rotation` | 3, a rotation vector in radians, about the moving centre | none |
/// | `SHAPE.scale` | 1, about the moving centre | at least 10⁻³ |
/// | `SHAPE.sdf` of an implicit surface | its parameters: node values of a grid, weights of a network | none |
/// | `SHAPE.translation` of an implicit surface | 3, scene units, from where it stood | none |
/// | `SHAPE.rotation` of an implicit surface | 3, a rotation vector in radians, about where it stands | none |
/// | `SHAPE.radiance`, `LIGHT.radiance` of a constant environment | 3, linear RGB | at least 0 |
/// | `LIGHT.intensity`, `LIGHT.irradiance` | 3, linear RGB | at least 0 |
/// | `MATERIAL.reflectance` | 3, linear RGB: of what [`Bsdf::reflectance`](crate::scene::Bsdf::reflectance) says | 0 to 1 |
/// | `MATERIAL.roughness` | 1, α, or of principled materials √α | 10⁻³ to 1 |
/// | `MATERIAL.texture` | 3 a texel, linear RGB | 0 to 1 |
/// | `camera.translation` | 3, scene units, from where it was | none |
/// | `camera.rotation` | 3, a rotation vector in radians, about its origin, or the middle of an orthographic sensor | none |
/// | `camera.fov` | 1, radians, horizontal, of a perspective camera | 0.01 to 3.1 |
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[expect(missing_docs, reason = "each is one row of the table, with the index of what has it")]
pub enum Quantity {
    VertexPositions { shape: usize },
    Translation { shape: usize },
    Rotation { shape: usize },
    Scale { shape: usize },
    Sdf { implicit: usize },
    ImplicitTranslation { implicit: usize },
    ImplicitRotation { implicit: usize },
    Radiance { shape: usize },
    EnvironmentRadiance,
    Intensity { light: usize },
    Reflectance { material: usize },
    Roughness { material: usize },
    Texture { material: usize, texture: usize },
    CameraTranslation,
    CameraRotation,
    FieldOfView,
}

/// A name of no parameter.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
#[non_exhaustive]
pub enum ParameterError {
    /// It is not made of what has the parameter, a dot, and a kind of parameter.
    #[error("`{name}` names no parameter; the nearest form is {nearest}, and all are: {}", FORMS.join(", "))]
    Form {
        /// The name.
        name: String,
        /// The form that is most alike.
        nearest: &'static str,
    },
    /// The scene has nothing of that name with that parameter.
    #[error("`{name}`: {source}")]
    Name {
        /// The name.
        name: String,
        /// What is wrong with it.
        source: NameError,
    },
    /// Its texture is an attribute of a mesh with texels out of range.
    #[error(
        "`{name}` is made of an attribute of a mesh, with four texels a triangle, and a fourth one that no triangle shows is \
         outside of 0 to 1; give the surface an image, whose texels can be fitted"
    )]
    Attribute {
        /// The name.
        name: String,
    },
    /// The field of view of an orthographic camera.
    #[error("`{name}`: the camera is orthographic, and has no field of view")]
    FieldOfView {
        /// The name.
        name: String,
    },
    /// A parameter is named twice, or two names are of one texture.
    #[error("`{name}` is the same parameter as `{other}`")]
    Twice {
        /// The second name.
        name: String,
        /// The first.
        other: String,
    },
}

/// How parameters are named.
const FORMS: [&str; 15] = [
    "SHAPE.vertex_positions",
    "SHAPE.translation",
    "SHAPE.rotation",
    "SHAPE.scale",
    "SHAPE.sdf",
    "SHAPE.radiance",
    "LIGHT.radiance",
    "LIGHT.intensity",
    "LIGHT.irradiance",
    "MATERIAL.reflectance",
    "MATERIAL.roughness",
    "MATERIAL.texture",
    "camera.translation",
    "camera.rotation",
    "camera.fov",
];

impl Quantity {
    /// Splits the name of a parameter into what has it and which of its parameters it is, for any scene.
    ///
    /// # Errors
    /// [`ParameterError::Form`] if it is no such name.
    pub fn split_name(name: &str) -> Result<(&str, &str), ParameterError> {
        let is_camera = |what: &str| what == "camera";
        let (what, kind) = name.rsplit_once('.').unwrap_or(("", name));
        let known = FORMS.map(|form| form.split_once('.').expect("forms have dots"));
        if !what.is_empty() && known.iter().any(|&(of, k)| k == kind && is_camera(of) == is_camera(what)) {
            return Ok((what, kind));
        }
        let distance = |i: &usize| {
            let (of, k) = known[*i];
            (strsim::osa_distance(kind, k), is_camera(of) != is_camera(what))
        };
        let nearest = (0..FORMS.len()).min_by_key(distance).expect("there are forms");
        Err(ParameterError::Form { name: name.to_owned(), nearest: FORMS[nearest] })
    }

    /// Finds a parameter of a scene by its name.
    ///
    /// # Errors
    /// A [`ParameterError`] that suggests what may have been meant.
    pub fn find(scene: &Scene, name: &str) -> Result<Self, ParameterError> {
        let (what, kind) = Self::split_name(name)?;
        let shape = || scene.find_shape(what);
        let implicit = || scene.find_implicit(what);
        let found = match (what, kind) {
            ("camera", "translation") => Ok(Self::CameraTranslation),
            ("camera", "rotation") => Ok(Self::CameraRotation),
            ("camera", _) if scene.description().camera.orthographic.is_some() => {
                return Err(ParameterError::FieldOfView { name: name.to_owned() });
            }
            ("camera", _) => Ok(Self::FieldOfView),
            (_, "vertex_positions") => shape().map(|shape| Self::VertexPositions { shape }),
            (_, "sdf") => implicit().map(|implicit| Self::Sdf { implicit }),
            (_, "translation") if scene.implicit(what).is_some() => {
                implicit().map(|implicit| Self::ImplicitTranslation { implicit })
            }
            (_, "rotation") if scene.implicit(what).is_some() => {
                implicit().map(|implicit| Self::ImplicitRotation { implicit })
            }
            (_, "translation") => shape().map(|shape| Self::Translation { shape }),
            (_, "rotation") => shape().map(|shape| Self::Rotation { shape }),
            (_, "scale") => shape().map(|shape| Self::Scale { shape }),
            (_, "radiance") => scene.find_emitter(what).map(|emitter| match emitter {
                Emitter::Shape(shape) => Self::Radiance { shape },
                Emitter::Environment => Self::EnvironmentRadiance,
            }),
            (_, "intensity") => scene.find_point_light(what).map(|light| Self::Intensity { light }),
            (_, "irradiance") => scene.find_directional_light(what).map(|light| Self::Intensity { light }),
            (_, "reflectance") => scene.find_plain(what).map(|material| Self::Reflectance { material }),
            (_, "roughness") => scene.find_rough(what).map(|material| Self::Roughness { material }),
            _ => scene.find_textured(what).map(|(material, texture)| Self::Texture { material, texture }),
        };
        let found = found.map_err(|source| ParameterError::Name { name: name.to_owned(), source })?;
        if let Self::Texture { texture, .. } = found {
            let texture = &scene.description().textures[texture];
            let is_out = |c: &DVec3| c.min_element() < 0.0 || c.max_element() > 1.0;
            if texture.texels.iter().any(is_out) && texture.is_of_triangles() {
                return Err(ParameterError::Attribute { name: name.to_owned() });
            }
        }
        Ok(found)
    }

    /// The sizes of its array: nothing for a number, (3) for a vector or colour, (vertices, 3) for positions, (height, width,
    /// 3) for a texture.
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

    /// The least and the greatest value of each of its numbers, unless one says otherwise.
    #[must_use]
    pub fn default_bounds(self) -> [f64; 2] {
        match self {
            Self::Scale { .. } => [1e-3, f64::INFINITY],
            Self::Radiance { .. } | Self::EnvironmentRadiance | Self::Intensity { .. } => {
                [0.0, f64::INFINITY]
            }
            Self::Reflectance { .. } | Self::Texture { .. } => [0.0, 1.0],
            Self::Roughness { .. } => [1e-3, 1.0],
            Self::FieldOfView => [0.01, 3.1],
            _ => [f64::NEG_INFINITY, f64::INFINITY],
        }
    }

    /// Makes it active.
    pub fn activate(self, active: &mut ActiveParameters) {
        match self {
            Self::VertexPositions { shape }
            | Self::Translation { shape }
            | Self::Rotation { shape }
            | Self::Scale { shape } => active.shapes[shape] = true,
            Self::Sdf { implicit }
            | Self::ImplicitTranslation { implicit }
            | Self::ImplicitRotation { implicit } => active.implicits[implicit] = true,
            Self::Radiance { .. } | Self::EnvironmentRadiance | Self::Intensity { .. } => {
                active.lights = true;
            }
            Self::Reflectance { material }
            | Self::Roughness { material }
            | Self::Texture { material, .. } => active.materials[material] = true,
            Self::CameraTranslation | Self::CameraRotation | Self::FieldOfView => active.camera = true,
        }
    }

    /// Whether two are the same values: two materials may share a texture.
    pub(crate) fn is(self, other: Self) -> bool {
        match (self, other) {
            (Self::Texture { texture: a, .. }, Self::Texture { texture: b, .. }) => a == b,
            _ => self == other,
        }
    }

    /// Whether it is a rotation, whose steps are composed.
    pub(crate) fn turns(self) -> bool {
        matches!(self, Self::Rotation { .. } | Self::ImplicitRotation { .. } | Self::CameraRotation)
    }

    /// The shape that it places as a whole.
    pub(crate) fn posed(self) -> Option<usize> {
        match self {
            Self::Translation { shape } | Self::Rotation { shape } | Self::Scale { shape } => Some(shape),
            _ => None,
        }
    }
}
