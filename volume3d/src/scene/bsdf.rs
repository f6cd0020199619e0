//! Reflection models and their parameters.

use glam::DVec3;

use super::principled::{Principled, PrincipledThin};
use super::value::{Reflectance, Value};
use crate::optics::{Coating, Microfacets};

/// A reflection model. Light arrives and leaves on the side of the shading normal, unless the material is
/// transmissive.
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
        /// Roughness α along u, the first texture coordinate.
        alpha: f64,
        /// Ratio of α orthogonal to u to α along u: 1 if isotropic. Must be 1 without texture coordinates.
        stretch: f64,
        /// Real part of the index of refraction.
        eta: DVec3,
        /// Imaginary part. With `eta` zero and this equal to one, F = 1 (Mitsuba's material "none").
        k: DVec3,
        /// Factor on the whole BSDF.
        specular_reflectance: Reflectance,
    },
    /// An ideal metallic mirror.
    Conductor {
        /// Real part of the index of refraction.
        eta: DVec3,
        /// Imaginary part.
        k: DVec3,
        /// Factor on the whole BSDF.
        specular_reflectance: Reflectance,
    },
    /// A diffuse base below a dielectric coating.
    Plastic(Plastic),
    /// Boundary of a transparent medium, whose interior is behind the front.
    Dielectric(Dielectric),
    /// A smooth transparent plate without refraction offset, with all internal reflections.
    ThinDielectric(Dielectric),
    /// The principled BSDF of a solid.
    Principled(Principled),
    /// The principled BSDF of an infinitely thin sheet.
    PrincipledThin(PrincipledThin),
}

/// Microfacets of a rough surface.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Roughness {
    /// D.
    pub distribution: Microfacets,
    /// The roughness α, in [10⁻⁴, 1], along u, the first texture coordinate.
    pub alpha: f64,
    /// Ratio of α orthogonal to u to α along u: 1 if isotropic. Must be 1 without texture coordinates, and
    /// for plastic unless its scattering is [`Scattering::Once`].
    pub stretch: f64,
}

impl Roughness {
    /// Isotropic microfacets.
    #[must_use]
    pub fn new(distribution: Microfacets, alpha: f64) -> Self {
        Self { distribution, alpha, stretch: 1.0 }
    }
}

/// A diffuse base below a dielectric coating. With ρ the base's reflectance, η the relative index of
/// refraction, T the transmittance of the coating, Rᵢ its internal reflectance for diffuse light, and
/// Fresnel's F,
///
/// ```text
/// f = s F D G/(4 cos θᵢ cos θₒ) + ρ/(1 − ρ′ Rᵢ) T(θᵢ) T(θₒ)/(π η²);
/// ```
///
/// for a smooth coating, the first term is an ideal mirror s F(θᵢ).
#[derive(Clone, Debug, PartialEq)]
pub struct Plastic {
    /// η, the coating's index of refraction relative to the outside; not 1, which is no coating.
    pub eta: f64,
    /// Microfacets of the coating; `None` if it is smooth.
    pub facets: Option<Roughness>,
    /// ρ.
    pub diffuse_reflectance: Reflectance,
    /// s, a factor on the coating's reflection.
    pub specular_reflectance: DVec3,
    /// Treatment of light that the coating reflects internally.
    pub scattering: Scattering,
}

/// Treatment of light in a diffuse base that the coating reflects internally.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Scattering {
    /// Scattered again without loss: ρ′ = 1.
    #[default]
    Linear,
    /// Scattered again, so that colours saturate: ρ′ = ρ.
    Nonlinear,
    /// Lost, with the base below a smooth boundary whatever the facets: ρ T(θᵢ) T(θₒ)/π (Baek and others
    /// 2018).
    Once,
}

/// Boundary between two transparent media. Transmitted radiance is scaled by the squared ratio of indices, as
/// for paths from the camera.
#[derive(Clone, Debug, PartialEq)]
pub struct Dielectric {
    /// Index of refraction behind the front relative to that in front; not 1 if the boundary is rough.
    pub eta: f64,
    /// Microfacets; `None` if it is smooth.
    pub facets: Option<Roughness>,
    /// Factor on reflected light.
    pub specular_reflectance: DVec3,
    /// Factor on transmitted light.
    pub specular_transmittance: Reflectance,
}

impl Bsdf {
    /// The colour that may be textured: a factor on everything that diffuse surfaces and conductors reflect,
    /// the base colour of plastic and the principled models, and a factor on a dielectric's transmission.
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

    /// Mutable [`reflectance`](Self::reflectance).
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

    /// The constant roughness, if it has one: α, or r for the principled models.
    #[must_use]
    pub fn roughness(&self) -> Option<f64> {
        match self {
            Self::Principled(principled) => principled.roughness.constant(),
            Self::PrincipledThin(thin) => thin.roughness.constant(),
            _ => self.facets().map(|facets| facets.alpha),
        }
    }

    /// Mutable [`roughness`](Self::roughness).
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

    /// Microfacets, if it has any with an α of their own.
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

    /// Parameters that may be textures, with their names and upper bounds.
    pub(crate) fn values(&self) -> Vec<(&'static str, Value, f64)> {
        match self {
            Self::Principled(principled) => principled.values(),
            Self::PrincipledThin(thin) => thin.values(),
            _ => vec![],
        }
    }

    /// Whether the BSDF is anisotropic, with axes along and orthogonal to u, the first texture coordinate.
    pub(crate) fn is_anisotropic(&self) -> bool {
        match self {
            Self::Principled(principled) => principled.anisotropic.may_differ_from(0.0),
            Self::PrincipledThin(thin) => thin.anisotropic.may_differ_from(0.0),
            _ => self.facets().is_some_and(|facets| facets.stretch != 1.0),
        }
    }

    /// η and k, if it is metallic.
    #[must_use]
    pub fn index_of_refraction(&self) -> Option<[DVec3; 2]> {
        match self {
            Self::RoughConductor { eta, k, .. } | Self::Conductor { eta, k, .. } => Some([*eta, *k]),
            _ => None,
        }
    }

    /// Index of refraction behind the front relative to that in front, if it is not metallic and has one.
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

    /// Whether it has an ideal specular reflection.
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

    /// Whether it is transmissive.
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

    /// Whether it is black if its [`reflectance`](Self::reflectance) is 0.
    pub(crate) fn is_scaled(&self) -> bool {
        matches!(self, Self::Diffuse { .. } | Self::RoughConductor { .. } | Self::Conductor { .. })
    }

    /// Transmittance tables of its coating, if it has one.
    pub(crate) fn coating(&self) -> Option<Coating> {
        let Self::Plastic(plastic) = self else { return None };
        Some(match plastic.facets {
            Some(Roughness { distribution, alpha, .. }) if plastic.scattering != Scattering::Once => {
                Coating::rough(distribution, alpha, plastic.eta)
            }
            _ => Coating::smooth(plastic.eta),
        })
    }

    /// Display name of the model.
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
