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
}

impl Material {
    /// A model alone, on both sides or on one.
    #[must_use]
    pub fn new(id: &str, bsdf: Bsdf, two_sided: bool) -> Self {
        Self { id: id.to_owned(), bsdf, two_sided, opacity: None, relief: None }
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
        let colours = [of(self.bsdf.reflectance()), self.opacity.as_ref().and_then(of), relief];
        colours.into_iter().chain(values).flatten()
    }
}
