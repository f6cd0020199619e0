//! A diffuse base below a dielectric coating: part is reflected by the coating, and the rest enters, is scattered, and leaves
//! or is thrown back to be scattered again.

use std::f64::consts::FRAC_1_PI;

use flatland::calculus::{Number, Rgb, Vec3};
use glam::DVec3;

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
    /// f cos θ of a direction above, but for the mirror image in a smooth coating.
    pub(super) fn evaluate(&self, direction: Vec3<T>) -> Rgb<T> {
        let base = self.base(direction);
        if self.plastic.facets.is_none() {
            return base;
        }
        let (facets, at_facet) = self.shading.facets().reflect(direction);
        let glossy = facets * fresnel::dielectric(at_facet, self.plastic.eta).0;
        base + Rgb::constant(self.plastic.specular_reflectance) * glossy
    }

    /// The density of [`sample`](Self::sample), and of the base alone where the coating is smooth.
    pub(super) fn density(&self, direction: DVec3) -> f64 {
        let part = self.glossy_part();
        let base = (1.0 - part) * diffuse::density(self.shading.normal.value().dot(direction));
        if self.plastic.facets.is_none() {
            return base;
        }
        base + part * self.shading.facets().reflection_density(direction)
    }

    /// A direction above: of the coating if the choice is below its part, else of the base.
    pub(super) fn sample(&self, [a, b, c]: [f64; 3]) -> DVec3 {
        let part = self.glossy_part();
        if c >= part {
            return self.shading.above(diffuse::sample([a, b, (c - part) / (1.0 - part)]));
        }
        let (half, viewer) = (self.shading.facets().sample([a, b]), self.shading.viewer.value());
        2.0 * viewer.dot(half) * half - viewer
    }

    /// The mirror image in a smooth coating, if the choice is below its part.
    pub(super) fn mirror(&self, choice: f64) -> Option<Ideal<T>> {
        let part = self.glossy_part();
        (choice < part).then(|| {
            let (reflected, _) =
                fresnel::dielectric(self.shading.normal.dot(self.shading.viewer), self.plastic.eta);
            let colour = Rgb::constant(self.plastic.specular_reflectance);
            Ideal { direction: self.shading.mirrored(), factor: colour * (reflected * (1.0 / part)) }
        })
    }

    /// The probability with which a sample is one of the coating, by what it lets through of the viewer's direction.
    fn glossy_part(&self) -> f64 {
        let cosine = self.shading.normal.dot(self.shading.viewer).value();
        let let_through = self.coating.transmitted(cosine, self.shading.roughness.value());
        let base = let_through * self.shading.reflectance.value().element_sum();
        let coat = (1.0 - let_through) * self.plastic.specular_reflectance.element_sum();
        if base + coat > 0.0 { coat / (base + coat) } else { 0.5 }
    }

    /// f cos θₒ of the base, ρ/(1 − ρ′ Rᵢ) T(θᵢ) T(θₒ) cos θₒ/(π η²), for what the coating lets through and throws back;
    /// ρ′ is ρ where colours saturate by being scattered again, and 1 elsewhere. Where it is scattered once it is ρ T(θᵢ) T(θₒ) cos θₒ/π.
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
