//! What surfaces are made of.

use glam::DVec3;

use super::bsdf::Bsdf;
use super::value::{Reflectance, Value};

/// A texture that tilts the shading normal. It has no derivative by moving geometry, which is refused: where the tilted normal
/// turns away from the viewer, and, of a bump map, at every border of texels, the image jumps, and no warp follows.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Relief {
    /// Heights, of which the gradient by texture coordinates displaces: n ∝ ∂u p × ∂v p with ∂u p + n (s ∂u h − n·∂u p) in
    /// the place of ∂u p, and ∂v p likewise (Blinn 1978).
    Bump {
        /// The texture's index in the scene; its luminance is the height.
        texture: usize,
        /// s.
        scale: f64,
    },
    /// Normals in the frame of the surface, (n + 1)/2, with x along ∂u p.
    Normals {
        /// The texture's index in the scene.
        texture: usize,
    },
}

/// A reflection model and which sides have it.
#[derive(Clone, Debug, PartialEq)]
pub struct Material {
    /// Its name in messages and requests.
    pub id: String,
    /// The model.
    pub bsdf: Bsdf,
    /// Whether the back reflects as the front. A back that does not is black, unless light passes the surface.
    pub two_sided: bool,
    /// How much of the surface is there, in [0, 1]: the luminance of a colour. Light passes the rest in a straight line.
    /// Nothing is all of it.
    pub opacity: Option<Reflectance>,
    /// What tilts the normal, if anything does.
    pub relief: Option<Relief>,
    /// Textures by whose luminance the roughness α is multiplied, along u and across it, by their indices in
    /// the scene; α is at least 10⁻⁴ all the same. Rough conductors and dielectrics, and plastic whose light
    /// is scattered once, may have some.
    pub roughness_textures: [Option<usize>; 2],
    /// Another material that it is mixed with, if it is.
    pub blend: Option<Blend>,
    /// The material of its back, by its index in the scene, if that is another one. It must stand before this one.
    pub back: Option<usize>,
}

/// A second material of a mixture: f = (1 − w) f₀ + w f₁.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Blend {
    /// The material of f₁, by its index in the scene. It must stand before that of f₀, and neither may have an opacity
    /// or a relief of its own.
    pub other: usize,
    /// w, in [0, 1].
    pub weight: Value,
}

impl Material {
    /// A model alone, on both sides or on one.
    #[must_use]
    pub fn new(id: &str, bsdf: Bsdf, two_sided: bool) -> Self {
        let (opacity, relief, roughness_textures, blend, back) = (None, None, [None; 2], None, None);
        Self { id: id.to_owned(), bsdf, two_sided, opacity, relief, roughness_textures, blend, back }
    }

    /// A Lambertian surface, both sides alike.
    #[must_use]
    pub fn diffuse(id: &str, reflectance: DVec3) -> Self {
        Self::new(id, Bsdf::Diffuse { reflectance: Reflectance::Constant(reflectance) }, true)
    }

    /// The textures that it looks up, by their index in the scene.
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

    /// Whether it reflects in another way along u, the first texture coordinate, than across it.
    pub(crate) fn is_anisotropic(&self) -> bool {
        let [along, across] = self.roughness_textures;
        along != across || self.bsdf.is_anisotropic()
    }

    /// The materials that this one refers to, by their index in the scene.
    pub(crate) fn others(&self) -> impl Iterator<Item = usize> + use<> {
        self.blend.map(|blend| blend.other).into_iter().chain(self.back)
    }
}

/// A material and all that it refers to, by their index. Those stand before it.
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
