//! Materials.

use glam::DVec3;

use super::bsdf::Bsdf;
use super::value::{Reflectance, Value};

/// Bump or normal map. Derivatives by moving geometry are refused: the image is discontinuous, and not
/// followed by any warp, where the mapped normal turns away from the viewer and, for a bump map, at every
/// border of texels.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Relief {
    /// Bump map of heights h: n ∝ ∂u p × ∂v p with ∂u p replaced by ∂u p + n (s ∂u h − n·∂u p), and the same
    /// for ∂v p (Blinn 1978).
    Bump {
        /// Index of the texture; its luminance is the height.
        texture: usize,
        /// s.
        scale: f64,
    },
    /// Normal map in the surface frame, (n + 1)/2, with x along ∂u p.
    Normals {
        /// Index of the texture.
        texture: usize,
    },
}

/// A BSDF and the sides that have it.
#[derive(Clone, Debug, PartialEq)]
pub struct Material {
    /// Name in messages and queries.
    pub id: String,
    /// The BSDF.
    pub bsdf: Bsdf,
    /// Whether the back reflects like the front. Otherwise the back is black, unless the BSDF is
    /// transmissive.
    pub two_sided: bool,
    /// Opacity in [0, 1], the luminance of a colour: the remaining light passes straight through. `None` for
    /// 1.
    pub opacity: Option<Reflectance>,
    /// Bump or normal map, if any.
    pub relief: Option<Relief>,
    /// Indices of textures whose luminance multiplies the roughness α, along u and orthogonally, with a
    /// minimum of 10⁻⁴. Supported by rough conductors and dielectrics, and by plastic of single scattering.
    pub roughness_textures: [Option<usize>; 2],
    /// The material it is mixed with, if any.
    pub blend: Option<Blend>,
    /// Index of the material of its back, if different; must be less than its own.
    pub back: Option<usize>,
}

/// Second material of a mixture: f = (1 − w) f₀ + w f₁.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Blend {
    /// Index of the material f₁; must be less than the index of f₀. It may have no opacity, mixture or back
    /// of its own, and neither part may have a bump or normal map.
    pub other: usize,
    /// w, in [0, 1].
    pub weight: Value,
}

impl Material {
    /// A material with only a BSDF, on one or both sides.
    #[must_use]
    pub fn new(id: &str, bsdf: Bsdf, two_sided: bool) -> Self {
        let (opacity, relief, roughness_textures, blend, back) = (None, None, [None; 2], None, None);
        Self { id: id.to_owned(), bsdf, two_sided, opacity, relief, roughness_textures, blend, back }
    }

    /// A two-sided Lambertian material.
    #[must_use]
    pub fn diffuse(id: &str, reflectance: DVec3) -> Self {
        Self::new(id, Bsdf::Diffuse { reflectance: Reflectance::Constant(reflectance) }, true)
    }

    /// Indices of its textures.
    pub(crate) fn textures(&self) -> impl Iterator<Item = usize> {
        let of = |reflectance: &Reflectance| match reflectance {
            Reflectance::Texture(texture) => Some(*texture),
            Reflectance::Constant(_) => None,
        };
        let relief = self.relief.map(|relief| match relief {
            Relief::Bump { texture, .. } | Relief::Normals { texture } => texture,
        });
        let values = self.bsdf.values().into_iter().map(|(_, value, _)| match value {
            Value::Texture(texture) => Some(texture),
            Value::Constant(_) => None,
        });
        let weight = self.blend.and_then(|blend| match blend.weight {
            Value::Texture(texture) => Some(texture),
            Value::Constant(_) => None,
        });
        let colours = [of(self.bsdf.reflectance()), self.opacity.as_ref().and_then(of), relief, weight];
        colours.into_iter().chain(values).chain(self.roughness_textures).flatten()
    }

    /// Whether it is anisotropic, with axes along and orthogonal to u, the first texture coordinate.
    pub(crate) fn is_anisotropic(&self) -> bool {
        let [along, across] = self.roughness_textures;
        along != across || self.bsdf.is_anisotropic()
    }

    /// Indices of the materials that it refers to.
    pub(crate) fn others(&self) -> impl Iterator<Item = usize> + use<> {
        self.blend.map(|blend| blend.other).into_iter().chain(self.back)
    }
}

/// Indices of a material and of all that it refers to, directly or not; the latter come before it.
pub(crate) fn parts(materials: &[Material], index: usize) -> Vec<usize> {
    let mut found = vec![index];
    let mut next = 0;
    while let Some(&part) = found.get(next) {
        let others = materials.get(part).into_iter().flat_map(Material::others);
        found.extend(others.filter(|&other| other < part));
        next += 1;
    }
    found
}
