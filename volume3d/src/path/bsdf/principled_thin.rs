//! The principled model of a sheet without thickness (Burley 2015), with the terms and weights of Mitsuba's `principledthin`:
//! light is reflected and passes by facets and diffusely, from both sides alike.

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
    /// Those that light passes are smoother, or rougher, by the index of refraction (Burley 2015, figure 15).
    passing: Facets<T>,
    /// Parts: glossy, and of the rest what is reflected and what passes.
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

    /// Fresnel's term, and so much of its approximation in the base colour's hue.
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

    /// The density of [`sample`](Self::sample).
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

    /// A direction; nothing if a facet ends it on the wrong side.
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

    /// The direction on the viewer's side that mirrors one below.
    fn above(&self, direction: Vec3<T>) -> Vec3<T> {
        let normal = self.shading.normal;
        direction - normal * (normal.dot(direction) * 2.0)
    }

    /// Whether the facet that passes light into a direction below has it on its other side.
    fn passes_facet(&self, direction: DVec3) -> bool {
        let above = self.above(Vec3::constant(direction)).value();
        (self.shading.viewer.value() + above).dot(direction) < 0.0
    }
}
