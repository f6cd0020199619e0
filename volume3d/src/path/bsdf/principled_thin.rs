//! The thin principled BSDF (Burley 2015), with the terms and weights of Mitsuba's `principledthin`: specular
//! and diffuse reflection and transmission of an infinitely thin sheet, equal from both sides.

use std::f64::consts::FRAC_1_PI;

use flatland::calculus::{Number, Rgb, Vec3};
use glam::DVec3;

use super::facets::Facets;
use super::principled::{base_lobe, facets, is_there, schlick, tint, white};
use super::{Shading, diffuse};
use crate::optics::fresnel;
use crate::scene::PrincipledThin;

/// The sheet at a shading point.
pub(super) struct Sheet<'s, T> {
    shading: &'s Shading<'s, T>,
    thin: &'s PrincipledThin<T>,
    reflecting: Facets<T>,
    /// Transmitting facets, whose roughness is scaled according to the index of refraction (Burley 2015,
    /// figure 15).
    passing: Facets<T>,
    /// Fractions: the specular one, and the reflected and the transmitted parts of the rest.
    glossy: T,
    reflected: T,
    passed: T,
}

impl<'s, T: Number> Sheet<'s, T> {
    pub(super) fn new(shading: &'s Shading<'s, T>, thin: &'s PrincipledThin<T>) -> Self {
        let one = T::constant(1.0);
        let facets = |roughness| facets(shading, roughness, thin.anisotropic);
        let (rest, passed) = (one - thin.spec_trans, thin.diff_trans * 0.5);
        Self {
            shading,
            thin,
            reflecting: facets(thin.roughness),
            passing: facets(thin.roughness * (0.65 * thin.eta - 0.35)),
            glossy: thin.spec_trans,
            reflected: rest * (one - passed),
            passed: rest * passed,
        }
    }

    /// f |cos θ|.
    pub(super) fn evaluate(&self, direction: Vec3<T>) -> Rgb<T> {
        let Shading { normal, viewer, reflectance, .. } = *self.shading;
        let (thin, cosine) = (self.thin, normal.dot(direction));
        if cosine.value() < 0.0 {
            let mut sum = reflectance * (-cosine * (self.passed * FRAC_1_PI));
            if is_there(self.glossy) && self.passes_facet(direction.value()) {
                let (facets, at_facet) = self.passing.reflect(self.above(direction));
                let (reflected, _) = fresnel::dielectric(at_facet, thin.eta);
                let passed = facets * (T::constant(1.0) - reflected) * self.glossy;
                sum = sum + reflectance * passed;
            }
            return sum;
        }
        let half = (viewer + direction).normalized();
        let base = base_lobe(self.shading, half, direction, thin.roughness, thin.flatness);
        let mut sum = reflectance * (base * cosine * self.reflected);
        if is_there(thin.sheen) {
            let weight = schlick(direction.dot(half)) * cosine * (thin.sheen * self.reflected);
            sum = sum + tint(reflectance, thin.sheen_tint) * weight;
        }
        if is_there(self.glossy) {
            let (facets, at_facet) = self.reflecting.reflect(direction);
            sum = sum + self.tinted_fresnel(at_facet) * (facets * self.glossy);
        }
        sum
    }

    /// Fresnel's term, blended with its approximation in the base colour's hue.
    fn tinted_fresnel(&self, cosine: T) -> Rgb<T> {
        let PrincipledThin { eta, spec_tint, .. } = *self.thin;
        let (reflected, beyond) = fresnel::dielectric(cosine, eta);
        if !is_there(spec_tint) {
            return white(reflected);
        }
        let at_normal = T::constant(((eta - 1.0) / (eta + 1.0)).powi(2));
        let weight = schlick(if eta > 1.0 { cosine } else { beyond });
        let hue =
            tint(self.shading.reflectance, T::constant(1.0)) * (at_normal * (T::constant(1.0) - weight));
        (hue + white(weight)) * spec_tint + white(reflected * (T::constant(1.0) - spec_tint))
    }

    /// Probability density of [`sample`](Self::sample).
    pub(super) fn density(&self, direction: DVec3) -> f64 {
        let cosine = self.shading.normal.value().dot(direction);
        let (reflected, passed) = (self.reflected.value(), self.passed.value());
        let glossy = 0.5 * self.glossy.value();
        if cosine < 0.0 {
            let facets = if glossy > 0.0 && self.passes_facet(direction) {
                self.passing.reflection_density(self.above(Vec3::<T>::constant(direction)).value())
            } else {
                0.0
            };
            return glossy * facets + if passed > 0.0 { passed * diffuse::density(-cosine) } else { 0.0 };
        }
        let facets = if glossy > 0.0 { self.reflecting.reflection_density(direction) } else { 0.0 };
        glossy * facets + if reflected > 0.0 { reflected * diffuse::density(cosine) } else { 0.0 }
    }

    /// Samples a direction; `None` if it ends on the wrong side of its facet.
    pub(super) fn sample(&self, [a, b, c]: [f64; 3]) -> Option<DVec3> {
        let (normal, viewer) = (self.shading.normal.value(), self.shading.viewer.value());
        let glossy = 0.5 * self.glossy.value();
        let base = 2.0 * glossy;
        if c < base {
            let half = if c < glossy { self.reflecting.sample([a, b]) } else { self.passing.sample([a, b]) };
            let direction = 2.0 * viewer.dot(half) * half - viewer;
            let up = normal.dot(direction);
            let direction = if c < glossy { direction } else { direction - 2.0 * up * normal };
            return (up > 0.0 && (c < glossy || self.passes_facet(direction))).then_some(direction);
        }
        let (reflected, passed) = (self.reflected.value(), self.passed.value());
        let above = c < base + reflected;
        let (first, part) = if above { (base, reflected) } else { (base + reflected, passed) };
        let local = diffuse::sample([a, b, (c - first) / part]);
        Some(self.shading.above(if above { local } else { -local }))
    }

    /// Mirrors a direction below to the viewer's side.
    fn above(&self, direction: Vec3<T>) -> Vec3<T> {
        let normal = self.shading.normal;
        direction - normal * (normal.dot(direction) * 2.0)
    }

    /// Whether the facet that transmits light into a direction below has that direction on its other side.
    fn passes_facet(&self, direction: DVec3) -> bool {
        let above = self.above(Vec3::constant(direction)).value();
        (self.shading.viewer.value() + above).dot(direction) < 0.0
    }
}
