//! How surfaces reflect.

use glam::DVec3;

/// A surface's reflectance, linear RGB.
#[derive(Clone, Debug, PartialEq)]
pub enum Reflectance {
    /// The same everywhere.
    Constant(DVec3),
    /// A texture, by its index in the scene.
    Texture(usize),
}

/// The distribution of the normals of a rough conductor's facets.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Microfacets {
    /// Beckmann and Spizzichino (1963).
    #[default]
    Beckmann,
    /// Trowbridge and Reitz (1975); GGX.
    Ggx,
}

/// A reflection model. Light arrives and leaves on the side the shading normal points to.
#[derive(Clone, Debug, PartialEq)]
pub enum Bsdf {
    /// Lambert: ρ/π.
    Diffuse {
        /// ρ, in [0, 1].
        reflectance: Reflectance,
    },
    /// Cook–Torrance with Smith's separable masking: F D G / (4 cos cos).
    RoughConductor {
        /// D.
        distribution: Microfacets,
        /// The roughness α.
        alpha: f64,
        /// Real part of the index of refraction.
        eta: DVec3,
        /// Imaginary part. With `eta` zero and this one, F = 1 (Mitsuba's material "none").
        k: DVec3,
        /// A factor on the whole.
        specular_reflectance: Reflectance,
    },
    /// An ideal mirror of metal.
    Conductor {
        /// Real part of the index of refraction.
        eta: DVec3,
        /// Imaginary part.
        k: DVec3,
        /// A factor on the whole.
        specular_reflectance: Reflectance,
    },
}

impl Bsdf {
    /// The factor on the whole that may be textured.
    #[must_use]
    pub fn reflectance(&self) -> &Reflectance {
        match self {
            Self::Diffuse { reflectance } => reflectance,
            Self::RoughConductor { specular_reflectance, .. }
            | Self::Conductor { specular_reflectance, .. } => specular_reflectance,
        }
    }

    /// α, if it has a lobe.
    #[must_use]
    pub fn roughness(&self) -> Option<f64> {
        match self {
            Self::RoughConductor { alpha, .. } => Some(*alpha),
            Self::Diffuse { .. } | Self::Conductor { .. } => None,
        }
    }

    /// The same, to be changed.
    pub(crate) fn roughness_mut(&mut self) -> Option<&mut f64> {
        match self {
            Self::RoughConductor { alpha, .. } => Some(alpha),
            Self::Diffuse { .. } | Self::Conductor { .. } => None,
        }
    }

    /// η and k, if it is of metal.
    #[must_use]
    pub fn index_of_refraction(&self) -> Option<[DVec3; 2]> {
        match self {
            Self::RoughConductor { eta, k, .. } | Self::Conductor { eta, k, .. } => Some([*eta, *k]),
            Self::Diffuse { .. } => None,
        }
    }

    /// Whether it reflects one direction into one direction: what moves in its image jumps where no warp sees it.
    #[must_use]
    pub fn is_mirror(&self) -> bool {
        matches!(self, Self::Conductor { .. })
    }

    /// The model in words.
    #[must_use]
    pub fn name(&self) -> &'static str {
        match self {
            Self::Diffuse { .. } => "diffuse",
            Self::RoughConductor { .. } => "rough conductor",
            Self::Conductor { .. } => "ideal mirror",
        }
    }

    /// The factor on the whole, to be changed.
    pub(crate) fn reflectance_mut(&mut self) -> &mut Reflectance {
        match self {
            Self::Diffuse { reflectance } => reflectance,
            Self::RoughConductor { specular_reflectance, .. }
            | Self::Conductor { specular_reflectance, .. } => specular_reflectance,
        }
    }
}

/// A reflection model and which sides have it.
#[derive(Clone, Debug, PartialEq)]
pub struct Material {
    /// Its name in messages and requests.
    pub id: String,
    /// The model.
    pub bsdf: Bsdf,
    /// Whether the back reflects as the front. A back that does not is black.
    pub two_sided: bool,
}

impl Material {
    /// A Lambertian surface, both sides alike.
    #[must_use]
    pub fn diffuse(id: &str, reflectance: DVec3) -> Self {
        let reflectance = Reflectance::Constant(reflectance);
        Self { id: id.to_owned(), bsdf: Bsdf::Diffuse { reflectance }, two_sided: true }
    }
}
