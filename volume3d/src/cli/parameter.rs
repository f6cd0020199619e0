//! `--wrt`: a parameter of a scene, in words; and its part of a gradient.

use std::str::FromStr;

use glam::DVec3;
use volume3d::gradient::{ActiveParameters, Tangent};
use volume3d::io::Array;
use volume3d::scene::{Reflectance, Scene};

use super::movement::{Emitter, directional, emitter, plain, point, rough, shape, textured};

/// A parameter, by the words for it.
#[derive(Clone, Debug, PartialEq, Eq)]
pub(super) struct Parameter {
    what: String,
    of: Of,
}

#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Of {
    Positions,
    Radiance,
    Intensity,
    Irradiance,
    Reflectance,
    Roughness,
    Texture,
    CameraTranslation,
    CameraRotation,
    CameraFieldOfView,
}

/// A parameter of a scene, by its place in a gradient.
#[derive(Clone, Copy, Debug)]
pub(super) enum Located {
    Positions { shape: usize },
    Radiance { shape: usize },
    Environment,
    Light { light: usize },
    Reflectance { material: usize },
    Roughness { material: usize },
    Texture { material: usize, texture: usize },
    CameraTranslation,
    CameraRotation,
    CameraFieldOfView,
}

const FORMS: &str = "SHAPE.vertex_positions, SHAPE.radiance, LIGHT.radiance, LIGHT.intensity, LIGHT.irradiance, MATERIAL.reflectance, MATERIAL.roughness, \
    MATERIAL.texture, camera.translation, camera.rotation or camera.fov";

impl FromStr for Parameter {
    type Err = String;

    fn from_str(text: &str) -> Result<Self, String> {
        let (what, name) = text.rsplit_once('.').ok_or_else(|| format!("expected {FORMS}"))?;
        let of = match (what, name) {
            ("camera", "translation") => Of::CameraTranslation,
            ("camera", "rotation") => Of::CameraRotation,
            ("camera", "fov") => Of::CameraFieldOfView,
            ("camera" | "", _) => return Err(format!("expected {FORMS}")),
            (_, "vertex_positions") => Of::Positions,
            (_, "radiance") => Of::Radiance,
            (_, "intensity") => Of::Intensity,
            (_, "irradiance") => Of::Irradiance,
            (_, "reflectance") => Of::Reflectance,
            (_, "roughness") => Of::Roughness,
            (_, "texture") => Of::Texture,
            _ => return Err(format!("expected {FORMS}")),
        };
        Ok(Self { what: what.to_owned(), of })
    }
}

impl Parameter {
    /// A file's name for it: what is neither letter nor digit becomes `_`, so that an id cannot lead out of a folder.
    pub(super) fn file_name(&self) -> String {
        let plain = |c: char| if c.is_alphanumeric() || c == '-' { c } else { '_' };
        let what: String = self.what.chars().map(plain).collect();
        let name = match self.of {
            Of::Positions => "vertex_positions",
            Of::Radiance => "radiance",
            Of::Intensity => "intensity",
            Of::Irradiance => "irradiance",
            Of::Reflectance => "reflectance",
            Of::Roughness => "roughness",
            Of::Texture => "texture",
            Of::CameraTranslation => "translation",
            Of::CameraRotation => "rotation",
            Of::CameraFieldOfView => "fov",
        };
        format!("{what}.{name}.npy")
    }

    /// Finds it in a scene.
    pub(super) fn locate(&self, scene: &Scene) -> anyhow::Result<Located> {
        let what = &self.what;
        Ok(match self.of {
            Of::Positions => Located::Positions { shape: shape(scene, what)? },
            Of::Radiance => match emitter(scene, what)? {
                Emitter::Shape(shape) => Located::Radiance { shape },
                Emitter::Environment => Located::Environment,
            },
            Of::Intensity => Located::Light { light: point(scene, what)? },
            Of::Irradiance => Located::Light { light: directional(scene, what)? },
            Of::Reflectance => Located::Reflectance { material: plain(scene, what)? },
            Of::Roughness => Located::Roughness { material: rough(scene, what)? },
            Of::Texture => {
                let material = textured(scene, what)?;
                match scene.description().materials[material].bsdf.reflectance() {
                    Reflectance::Texture(texture) => Located::Texture { material, texture: *texture },
                    Reflectance::Constant(_) => Located::Reflectance { material },
                }
            }
            Of::CameraTranslation => Located::CameraTranslation,
            Of::CameraRotation => Located::CameraRotation,
            Of::CameraFieldOfView => Located::CameraFieldOfView,
        })
    }
}

impl Located {
    /// Asks for it.
    pub(super) fn want(self, active: &mut ActiveParameters) {
        match self {
            Self::Positions { shape } => active.shapes[shape] = true,
            Self::Radiance { .. } | Self::Environment | Self::Light { .. } => active.lights = true,
            Self::Reflectance { material }
            | Self::Roughness { material }
            | Self::Texture { material, .. } => {
                active.materials[material] = true;
            }
            Self::CameraTranslation | Self::CameraRotation | Self::CameraFieldOfView => active.camera = true,
        }
    }

    /// Its part of a gradient. Of vertex positions, every vertex of the file has the derivative by the place it
    /// is at: where a file has several vertices at one place, they move together, and each has the whole.
    pub(super) fn pick(self, scene: &Scene, gradient: &Tangent) -> Array {
        let d = scene.description();
        let flat = |vectors: &[DVec3]| vectors.iter().flat_map(DVec3::to_array).collect::<Vec<f64>>();
        let vector = |v: DVec3| Array { shape: vec![3], values: flat(&[v]) };
        let number = |x: f64| Array { shape: vec![], values: vec![x] };
        match self {
            Self::Positions { shape } => {
                let sources = d.shapes[shape].mesh.sources();
                let places = gradient.positions_of(scene, shape);
                let values: Vec<DVec3> = sources.iter().map(|&s| places[s as usize]).collect();
                Array { shape: vec![sources.len(), 3], values: flat(&values) }
            }
            Self::Radiance { shape } => vector(gradient.radiance[shape]),
            Self::Environment => vector(gradient.environment),
            Self::Light { light } => vector(gradient.intensity[light]),
            Self::Reflectance { material } => vector(gradient.reflectance[material]),
            Self::Roughness { material } => number(gradient.roughness[material]),
            Self::Texture { texture, .. } => {
                let t = &d.textures[texture];
                Array { shape: vec![t.height, t.width, 3], values: flat(&gradient.texels[texture]) }
            }
            Self::CameraTranslation => vector(gradient.camera.translation),
            Self::CameraRotation => vector(gradient.camera.rotation),
            Self::CameraFieldOfView => number(gradient.camera.field_of_view),
        }
    }
}
