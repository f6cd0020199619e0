//! The principled models and their numbers.

use super::value::{Reflectance, Value};

/// The principled model of Burley (2012, 2015): of numbers in a scene, or as they are at a point. Numbers are in [0, 1] unless
/// told.
#[derive(Clone, Debug, PartialEq)]
pub struct Principled<V = Value> {
    /// The colour of the base, of metal, and, its square root, of what is refracted.
    pub base_color: Reflectance,
    /// r; α is r², and at least 10⁻³.
    pub roughness: V,
    /// a: with s = √(1 − 0.9 a), α is r²/s along u, the first texture coordinate, and r² s across it. Without texture
    /// coordinates it is 0.
    pub anisotropic: V,
    /// How much of it is metal.
    pub metallic: V,
    /// The index of refraction over that of the outside, above 0, and not 1 if light passes.
    pub eta: f64,
    /// How much of the dielectric's reflection has the base's hue.
    pub spec_tint: V,
    /// How much light passes, of what is not metal.
    pub spec_trans: V,
    /// Sheen at grazing angles.
    pub sheen: V,
    /// How much of it has the base's hue.
    pub sheen_tint: V,
    /// How much the base looks as if light were scattered below the surface.
    pub flatness: V,
    /// A second, colourless lobe.
    pub clearcoat: V,
    /// How narrow it is: α goes from 0.1 to 0.001.
    pub clearcoat_gloss: V,
}

/// The principled model of a sheet (Burley 2015): of numbers in a scene, or as they are at a point. Numbers are in [0, 1]
/// unless told.
#[derive(Clone, Debug, PartialEq)]
pub struct PrincipledThin<V = Value> {
    /// The colour of the base and of what passes.
    pub base_color: Reflectance,
    /// r; α is r², and at least 10⁻³.
    pub roughness: V,
    /// As of [`Principled`].
    pub anisotropic: V,
    /// The index of refraction, above 0.
    pub eta: f64,
    /// How much of what facets reflect has the base's hue.
    pub spec_tint: V,
    /// How much is reflected or passed by facets, and not diffusely.
    pub spec_trans: V,
    /// How much of diffuse light passes: in [0, 2], where 2 is all.
    pub diff_trans: V,
    /// Sheen at grazing angles.
    pub sheen: V,
    /// How much of it has the base's hue.
    pub sheen_tint: V,
    /// How much the base looks as if light were scattered below the surface.
    pub flatness: V,
}

impl<V: Copy> Principled<V> {
    /// The same with other numbers: `map(Value::Constant)` makes a material of numbers.
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

    /// All numbers by their names, and the most that each may be.
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
    /// The same with other numbers, as of [`Principled`].
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

    /// All numbers by their names, and the most that each may be.
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
