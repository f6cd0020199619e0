//! The principled BSDFs and their parameters.

use super::value::{Reflectance, Value};

/// The principled BSDF of Burley (2012, 2015), with parameters of a scene, or evaluated at a point.
/// Parameters are in [0, 1] unless stated otherwise.
#[derive(Clone, Debug, PartialEq)]
pub struct Principled<V = Value> {
    /// Base colour, of the diffuse and metallic lobes; its square root tints refracted light.
    pub base_color: Reflectance,
    /// r; α is r², and at least 10⁻³.
    pub roughness: V,
    /// a: with s = √(1 − 0.9 a), α is r²/s along u, the first texture coordinate, and r² s orthogonally. 0
    /// without texture coordinates.
    pub anisotropic: V,
    /// Weight of the metallic model.
    pub metallic: V,
    /// Index of refraction relative to the outside, positive, and not 1 if it transmits.
    pub eta: f64,
    /// Amount of the base's hue in the dielectric reflection.
    pub spec_tint: V,
    /// Transmission, as a fraction of the dielectric part.
    pub spec_trans: V,
    /// Sheen at grazing angles.
    pub sheen: V,
    /// Amount of the base's hue in the sheen.
    pub sheen_tint: V,
    /// Weight of the approximation of subsurface scattering.
    pub flatness: V,
    /// Weight of a second, colourless lobe.
    pub clearcoat: V,
    /// Gloss of the clear coat: α from 0.1 (at 0) to 0.001 (at 1).
    pub clearcoat_gloss: V,
}

/// The principled BSDF of a thin sheet (Burley 2015), with parameters of a scene, or evaluated at a point.
/// Parameters are in [0, 1] unless stated otherwise.
#[derive(Clone, Debug, PartialEq)]
pub struct PrincipledThin<V = Value> {
    /// Base colour, also of transmitted light.
    pub base_color: Reflectance,
    /// r; α is r², and at least 10⁻³.
    pub roughness: V,
    /// Anisotropy, as in [`Principled`].
    pub anisotropic: V,
    /// Index of refraction, positive.
    pub eta: f64,
    /// Amount of the base's hue in specular reflection.
    pub spec_tint: V,
    /// Fraction that is reflected or transmitted specularly instead of diffusely.
    pub spec_trans: V,
    /// Diffuse transmission in [0, 2], where 2 transmits everything.
    pub diff_trans: V,
    /// Sheen at grazing angles.
    pub sheen: V,
    /// Amount of the base's hue in the sheen.
    pub sheen_tint: V,
    /// Weight of the approximation of subsurface scattering.
    pub flatness: V,
}

impl<V: Copy> Principled<V> {
    /// Maps all parameters: `map(Value::Constant)` turns numbers into material parameters.
    #[must_use]
    pub fn map<W>(&self, mut f: impl FnMut(V) -> W) -> Principled<W> {
        Principled {
            base_color: self.base_color.clone(),
            roughness: f(self.roughness),
            anisotropic: f(self.anisotropic),
            metallic: f(self.metallic),
            eta: self.eta,
            spec_tint: f(self.spec_tint),
            spec_trans: f(self.spec_trans),
            sheen: f(self.sheen),
            sheen_tint: f(self.sheen_tint),
            flatness: f(self.flatness),
            clearcoat: f(self.clearcoat),
            clearcoat_gloss: f(self.clearcoat_gloss),
        }
    }

    /// Names, values and upper bounds of all parameters.
    pub(crate) fn values(&self) -> Vec<(&'static str, V, f64)> {
        vec![
            ("roughness", self.roughness, 1.0),
            ("anisotropic", self.anisotropic, 1.0),
            ("metallic", self.metallic, 1.0),
            ("spec_tint", self.spec_tint, 1.0),
            ("spec_trans", self.spec_trans, 1.0),
            ("sheen", self.sheen, 1.0),
            ("sheen_tint", self.sheen_tint, 1.0),
            ("flatness", self.flatness, 1.0),
            ("clearcoat", self.clearcoat, 1.0),
            ("clearcoat_gloss", self.clearcoat_gloss, 1.0),
        ]
    }
}

impl<V: Copy> PrincipledThin<V> {
    /// Maps all parameters, as in [`Principled::map`].
    #[must_use]
    pub fn map<W>(&self, mut f: impl FnMut(V) -> W) -> PrincipledThin<W> {
        PrincipledThin {
            base_color: self.base_color.clone(),
            roughness: f(self.roughness),
            anisotropic: f(self.anisotropic),
            eta: self.eta,
            spec_tint: f(self.spec_tint),
            spec_trans: f(self.spec_trans),
            diff_trans: f(self.diff_trans),
            sheen: f(self.sheen),
            sheen_tint: f(self.sheen_tint),
            flatness: f(self.flatness),
        }
    }

    /// Names, values and upper bounds of all parameters.
    pub(crate) fn values(&self) -> Vec<(&'static str, V, f64)> {
        vec![
            ("roughness", self.roughness, 1.0),
            ("anisotropic", self.anisotropic, 1.0),
            ("spec_tint", self.spec_tint, 1.0),
            ("spec_trans", self.spec_trans, 1.0),
            ("diff_trans", self.diff_trans, 2.0),
            ("sheen", self.sheen, 1.0),
            ("sheen_tint", self.sheen_tint, 1.0),
            ("flatness", self.flatness, 1.0),
        ]
    }
}
