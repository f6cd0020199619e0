//! Reflection models and their parameters.

use glam::DVec3;

use super::principled::{Principled, PrincipledThin};
use super::value::{Reflectance, Value};
use crate::optics::{Coating, Microfacets};

/// A reflection model. Light arrives and leaves on the side the shading normal points to, unless light passes the surface.
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
        /// The roughness α, along u, the first texture coordinate.
        alpha: f64,
        /// α across u over α along it: 1 for the same in all directions. Without texture coordinates it is 1.
        stretch: f64,
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
    /// A diffuse base below a dielectric coating.
    Plastic(Plastic),
    /// The boundary of a transparent medium: what is behind the front is within.
    Dielectric(Dielectric),
    /// A transparent plate so thin that what passes is not shifted, with all reflections within; it is always smooth.
    ThinDielectric(Dielectric),
    /// The principled model of a solid.
    Principled(Principled),
    /// The principled model of a sheet without thickness.
    PrincipledThin(PrincipledThin),
}

/// Facets of a rough surface.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Roughness {
    /// D.
    pub distribution: Microfacets,
    /// The roughness α, in [10⁻⁴, 1], along u, the first texture coordinate.
    pub alpha: f64,
    /// α across u over α along it: 1 for the same in all directions. Without texture coordinates it is 1, and
    /// so it is of plastic, but for that whose light is scattered once.
    pub stretch: f64,
}

impl Roughness {
    /// Facets that are the same in all directions.
    #[must_use]
    pub fn new(distribution: Microfacets, alpha: f64) -> Self {
        Self { distribution, alpha, stretch: 1.0 }
    }
}

/// A diffuse base below a dielectric coating. With ρ the base's reflectance, η the relative index of refraction, T what the coating lets
/// through, Rᵢ what it throws back of diffuse light from within, and Fresnel's F,
///
/// ```text
/// f = s F D G/(4 cos θᵢ cos θₒ) + ρ/(1 − ρ′ Rᵢ) T(θᵢ) T(θₒ)/(π η²);
/// ```
///
/// if it is smooth, the first term is an ideal mirror s F(θᵢ).
#[derive(Clone, Debug, PartialEq)]
pub struct Plastic {
    /// η, the coating's over that of the outside; not 1, which is no coating.
    pub eta: f64,
    /// The coating's facets; nothing if it is smooth.
    pub facets: Option<Roughness>,
    /// ρ.
    pub diffuse_reflectance: Reflectance,
    /// s, a factor on what the coating reflects.
    pub specular_reflectance: DVec3,
    /// What becomes of light that the coating throws back.
    pub scattering: Scattering,
}

/// What becomes of light in a diffuse base that the coating throws back.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Scattering {
    /// It is scattered again, without loss: ρ′ is 1.
    #[default]
    Linear,
    /// It is scattered again, so that colours saturate: ρ′ is ρ.
    Nonlinear,
    /// It is lost, and the base is below a smooth boundary whatever the facets: ρ T(θᵢ) T(θₒ)/π (Baek and others 2018).
    Once,
}

/// A boundary between two transparent media. Radiance that passes it is scaled by the square of the ratio of indices, as is
/// right for paths from the camera.
#[derive(Clone, Debug, PartialEq)]
pub struct Dielectric {
    /// The index of refraction behind the front over that before it; not 1 if it is rough.
    pub eta: f64,
    /// Its facets; nothing if it is smooth.
    pub facets: Option<Roughness>,
    /// A factor on what is reflected.
    pub specular_reflectance: DVec3,
    /// A factor on what passes.
    pub specular_transmittance: Reflectance,
}

impl Bsdf {
    /// The colour that may be textured: a factor on all that diffuse surfaces and conductors reflect, the base's of plastic and
    /// the principled models, and a factor on what passes a dielectric.
    #[must_use]
    pub fn reflectance(&self) -> &Reflectance {
        match self {
            Self::Diffuse { reflectance } => reflectance,
            Self::RoughConductor { specular_reflectance, .. }
            | Self::Conductor { specular_reflectance, .. } => specular_reflectance,
            Self::Plastic(plastic) => &plastic.diffuse_reflectance,
            Self::Dielectric(dielectric) | Self::ThinDielectric(dielectric) => {
                &dielectric.specular_transmittance
            }
            Self::Principled(principled) => &principled.base_color,
            Self::PrincipledThin(thin) => &thin.base_color,
        }
    }

    /// The same, to be changed.
    pub(crate) fn reflectance_mut(&mut self) -> &mut Reflectance {
        match self {
            Self::Diffuse { reflectance } => reflectance,
            Self::RoughConductor { specular_reflectance, .. }
            | Self::Conductor { specular_reflectance, .. } => specular_reflectance,
            Self::Plastic(plastic) => &mut plastic.diffuse_reflectance,
            Self::Dielectric(dielectric) | Self::ThinDielectric(dielectric) => {
                &mut dielectric.specular_transmittance
            }
            Self::Principled(principled) => &mut principled.base_color,
            Self::PrincipledThin(thin) => &mut thin.base_color,
        }
    }

    /// The roughness, if it has a lobe, and the same everywhere: α, or of the principled models r.
    #[must_use]
    pub fn roughness(&self) -> Option<f64> {
        match self {
            Self::Principled(principled) => principled.roughness.constant(),
            Self::PrincipledThin(thin) => thin.roughness.constant(),
            _ => self.facets().map(|facets| facets.alpha),
        }
    }

    /// The same, to be changed.
    pub(crate) fn roughness_mut(&mut self) -> Option<&mut f64> {
        match self {
            Self::RoughConductor { alpha, .. } => Some(alpha),
            Self::Principled(principled) => principled.roughness.constant_mut(),
            Self::PrincipledThin(thin) => thin.roughness.constant_mut(),
            Self::Plastic(Plastic { facets, .. }) | Self::Dielectric(Dielectric { facets, .. }) => {
                facets.as_mut().map(|facets| &mut facets.alpha)
            }
            Self::Diffuse { .. } | Self::Conductor { .. } | Self::ThinDielectric(_) => None,
        }
    }

    /// Its facets, if it has any with an α of their own.
    #[must_use]
    pub fn facets(&self) -> Option<Roughness> {
        match *self {
            Self::RoughConductor { distribution, alpha, stretch, .. } => {
                Some(Roughness { distribution, alpha, stretch })
            }
            Self::Plastic(Plastic { facets, .. }) | Self::Dielectric(Dielectric { facets, .. }) => facets,
            _ => None,
        }
    }

    /// Numbers that may be textures, by their names, and the most that each may be.
    pub(crate) fn values(&self) -> Vec<(&'static str, Value, f64)> {
        match self {
            Self::Principled(principled) => principled.values(),
            Self::PrincipledThin(thin) => thin.values(),
            _ => vec![],
        }
    }

    /// Whether it reflects in another way along u, the first texture coordinate, than across it.
    pub(crate) fn is_anisotropic(&self) -> bool {
        match self {
            Self::Principled(principled) => principled.anisotropic.may_differ_from(0.0),
            Self::PrincipledThin(thin) => thin.anisotropic.may_differ_from(0.0),
            _ => self.facets().is_some_and(|facets| facets.stretch != 1.0),
        }
    }

    /// η and k, if it is of metal.
    #[must_use]
    pub fn index_of_refraction(&self) -> Option<[DVec3; 2]> {
        match self {
            Self::RoughConductor { eta, k, .. } | Self::Conductor { eta, k, .. } => Some([*eta, *k]),
            _ => None,
        }
    }

    /// The index of refraction behind its front over that before it, if it is no metal and has one.
    #[must_use]
    pub fn relative_index(&self) -> Option<f64> {
        match self {
            Self::Plastic(plastic) => Some(plastic.eta),
            Self::Dielectric(dielectric) | Self::ThinDielectric(dielectric) => Some(dielectric.eta),
            Self::Principled(principled) => Some(principled.eta),
            Self::PrincipledThin(thin) => Some(thin.eta),
            Self::Diffuse { .. } | Self::RoughConductor { .. } | Self::Conductor { .. } => None,
        }
    }

    /// Whether it reflects one direction into one direction, be it a part of the light: what moves in its image jumps where no
    /// warp sees it.
    #[must_use]
    pub fn is_mirror(&self) -> bool {
        match self {
            Self::Conductor { .. } | Self::ThinDielectric(_) => true,
            Self::Plastic(Plastic { facets, .. }) | Self::Dielectric(Dielectric { facets, .. }) => {
                facets.is_none()
            }
            _ => false,
        }
    }

    /// Whether light passes it: what moves behind it jumps where no warp sees it.
    #[must_use]
    pub fn transmits(&self) -> bool {
        match self {
            Self::Dielectric(_) | Self::ThinDielectric(_) => true,
            Self::Principled(p) => p.metallic.may_differ_from(1.0) && p.spec_trans.may_differ_from(0.0),
            Self::PrincipledThin(thin) => {
                thin.spec_trans.may_differ_from(0.0) || thin.diff_trans.may_differ_from(0.0)
            }
            _ => false,
        }
    }

    /// Whether it reflects nothing where its [`reflectance`](Self::reflectance) is 0.
    pub(crate) fn is_scaled(&self) -> bool {
        matches!(self, Self::Diffuse { .. } | Self::RoughConductor { .. } | Self::Conductor { .. })
    }

    /// What its coating lets through, if it has one.
    pub(crate) fn coating(&self) -> Option<Coating> {
        let Self::Plastic(plastic) = self else { return None };
        Some(match plastic.facets {
            Some(Roughness { distribution, alpha, .. }) if plastic.scattering != Scattering::Once => {
                Coating::rough(distribution, alpha, plastic.eta)
            }
            _ => Coating::smooth(plastic.eta),
        })
    }

    /// The model in words.
    #[must_use]
    pub fn name(&self) -> &'static str {
        match self {
            Self::Diffuse { .. } => "diffuse",
            Self::RoughConductor { .. } => "rough conductor",
            Self::Conductor { .. } => "ideal mirror",
            Self::Plastic(Plastic { facets: Some(_), .. }) => "rough plastic",
            Self::Plastic(_) => "smooth plastic",
            Self::Dielectric(Dielectric { facets: Some(_), .. }) => "rough dielectric",
            Self::Dielectric(_) => "smooth dielectric",
            Self::ThinDielectric(_) => "thin dielectric",
            Self::Principled(_) => "principled",
            Self::PrincipledThin(_) => "principled sheet",
        }
    }
}
