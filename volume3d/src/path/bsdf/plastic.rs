//! Plastic: a diffuse base below a dielectric coating. Part of the light is reflected by the coating; the
//! rest enters, is scattered, and leaves or is reflected internally and scattered again.

use std::f64::consts::FRAC_1_PI;

use flatland::calculus::{Number, Rgb, Vec3};
use glam::DVec3;

use super::shading::Passage;
use super::{Ideal, Shading, diffuse};
use crate::optics::{Coating, fresnel};
use crate::scene::{Plastic, Scattering};

/// A coated material at a shading point.
pub(super) struct Coated<'s, T> {
    pub(super) shading: &'s Shading<'s, T>,
    pub(super) plastic: &'s Plastic,
    pub(super) coating: &'s Coating,
}

impl<T: Number> Coated<'_, T> {
    /// f cos θ of a direction above, without the mirror reflection of a smooth coating.
    pub(super) fn evaluate(&self, direction: Vec3<T>) -> Rgb<T> {
        let base = self.base(direction);
        if self.plastic.facets.is_none() {
            return base;
        }
        let (facets, at_facet) = self.shading.facets().reflect(direction);
        let glossy = facets * fresnel::dielectric(at_facet, self.plastic.eta).0;
        base + Rgb::constant(self.plastic.specular_reflectance) * glossy
    }

    /// Probability density of [`sample`](Self::sample); with a smooth coating, of the base alone.
    pub(super) fn density(&self, direction: DVec3) -> f64 {
        let part = self.glossy_part();
        let base = (1.0 - part) * diffuse::density(self.shading.normal.value().dot(direction));
        if self.plastic.facets.is_none() {
            return base;
        }
        base + part * self.shading.facets().reflection_density(direction)
    }

    /// Samples a direction above: from the coating if `choice` is below its probability, else from the base.
    pub(super) fn sample(&self, [a, b, c]: [f64; 3]) -> DVec3 {
        let part = self.glossy_part();
        if c >= part {
            return self.shading.above(diffuse::sample([a, b, (c - part) / (1.0 - part)]));
        }
        let (half, viewer) = (self.shading.facets().sample([a, b]), self.shading.viewer.value());
        2.0 * viewer.dot(half) * half - viewer
    }

    /// The mirror reflection of a smooth coating, if `choice` is below its probability.
    pub(super) fn mirror(&self, choice: f64) -> Option<Ideal<T>> {
        let part = self.glossy_part();
        (choice < part).then(|| {
            let (reflected, _) =
                fresnel::dielectric(self.shading.normal.dot(self.shading.viewer), self.plastic.eta);
            let colour = Rgb::constant(self.plastic.specular_reflectance);
            let factor = colour * (reflected * (1.0 / part));
            Ideal { branch: Passage::Mirrored.alone(), direction: self.shading.mirrored(), factor }
        })
    }

    /// Probability of sampling the coating, from its transmittance in the viewer's direction.
    fn glossy_part(&self) -> f64 {
        let cosine = self.shading.normal.dot(self.shading.viewer).value();
        let let_through = self.coating.transmitted(cosine, self.shading.roughness.value());
        let base = let_through * self.shading.reflectance.value().element_sum();
        let coat = (1.0 - let_through) * self.plastic.specular_reflectance.element_sum();
        if base + coat > 0.0 { coat / (base + coat) } else { 0.5 }
    }

    /// f cos θₒ of the base below the coating, ρ/(1 − ρ′ Rᵢ) T(θᵢ) T(θₒ) cos θₒ/(π η²); ρ′ is ρ for nonlinear
    /// scattering (colours saturate) and 1 for linear scattering. With single scattering it is ρ T(θᵢ) T(θₒ)
    /// cos θₒ/π.
    fn base(&self, direction: Vec3<T>) -> Rgb<T> {
        let [viewer, cosine] = [self.shading.viewer, direction].map(|v| self.shading.normal.dot(v));
        let [entering, leaving] =
            [viewer, cosine].map(|cosine| self.coating.transmitted(cosine, self.shading.roughness));
        let through = cosine * entering * leaving * FRAC_1_PI;
        let passed = through * (1.0 / (self.plastic.eta * self.plastic.eta));
        let internal = self.coating.internal(self.shading.roughness);
        let Rgb(channels) = self.shading.reflectance;
        Rgb(channels.map(|rho| match self.plastic.scattering {
            Scattering::Linear => rho * passed / (T::constant(1.0) - internal),
            Scattering::Nonlinear => rho * passed / (T::constant(1.0) - rho * internal),
            Scattering::Once => rho * through,
        }))
    }
}
