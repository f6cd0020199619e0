//! Reflection and transmission at one point: values with derivatives, and sampling by value alone. One file a material.

mod dielectric;
pub(super) mod diffuse;
mod facets;
mod plastic;
mod principled;
mod principled_thin;
mod shading;

use std::f64::consts::FRAC_1_PI;

use flatland::calculus::{Number, Rgb, Vec3};
use glam::DVec3;

use self::facets::{Facets, Stretch};
use self::plastic::Coated;
use self::principled::Lobes;
use self::principled_thin::Sheet;
pub(crate) use self::shading::{Bounce, Ideal, Mixed, Numbers, Sampled, Shading};
use crate::optics::{Microfacets, fresnel};
use crate::scene::{Bsdf, Plastic};

impl<T: Number> Shading<'_, T> {
    /// f(ω) |cos θ|, but for ideal directions.
    #[inline]
    pub(crate) fn evaluate(&self, direction: Vec3<T>) -> Rgb<T> {
        let cosine = self.normal.dot(direction);
        if self.is_merely_diffuse() && cosine.value() > 0.0 {
            return self.reflectance * (cosine * FRAC_1_PI);
        }
        self.evaluate_any(direction, cosine)
    }

    /// The same of any material.
    #[inline(never)]
    fn evaluate_any(&self, direction: Vec3<T>, cosine: T) -> Rgb<T> {
        if self.receives_none(cosine.value()) || self.hides(direction.value()) {
            return Rgb::constant(DVec3::ZERO);
        }
        let value =
            self.mixed(|shading| shading.evaluate_alone(direction, cosine), |value, weight| value * weight);
        let value = self.beneath.map_or(value, |own| value * self.shadowed_by_relief(own, direction));
        self.opacity.map_or(value, |opacity| value * opacity)
    }

    /// Whether it is all there, not mixed with another material and diffuse, as most surfaces are: what is asked of it most often
    /// is answered at once then.
    #[inline]
    fn is_merely_diffuse(&self) -> bool {
        matches!(self.bsdf, Bsdf::Diffuse { .. })
            && !self.black
            && self.blend.is_none()
            && self.opacity.is_none()
            && self.beneath.is_none()
    }

    /// (1 − w) a + w b of something of both parts of a mixture; of a single material, that of it.
    fn mixed<V: std::ops::Add<Output = V>>(&self, of: impl Fn(&Self) -> V, scale: impl Fn(V, T) -> V) -> V {
        let Some(blend) = &self.blend else { return of(self) };
        let rest = T::constant(1.0) - blend.weight;
        scale(of(self), rest) + scale(of(&blend.other), blend.weight)
    }

    /// [`evaluate`](Self::evaluate) without what is mixed with it, a mask and a relief.
    fn evaluate_alone(&self, direction: Vec3<T>, cosine: T) -> Rgb<T> {
        // Beside glass, with which it is mixed, light arrives from behind too.
        if self.black || cosine.value() <= 0.0 && !self.bsdf.transmits() {
            return Rgb::constant(DVec3::ZERO);
        }
        match self.bsdf {
            Bsdf::Diffuse { .. } => self.reflectance * (cosine * FRAC_1_PI),
            Bsdf::RoughConductor { eta, k, .. } => {
                let (facets, at_facet) = self.facets().reflect(direction);
                self.reflectance * fresnel::conductor_rgb(at_facet, *eta, *k) * facets
            }
            Bsdf::Plastic(plastic) => {
                self.coated(plastic).map_or(Rgb::constant(DVec3::ZERO), |c| c.evaluate(direction))
            }
            Bsdf::Principled(_) => {
                self.lobes().map_or(Rgb::constant(DVec3::ZERO), |lobes| lobes.evaluate(direction))
            }
            Bsdf::PrincipledThin(_) => {
                self.sheet().map_or(Rgb::constant(DVec3::ZERO), |sheet| sheet.evaluate(direction))
            }
            Bsdf::Dielectric(dielectric) if dielectric.facets.is_some() => {
                dielectric::rough(self, dielectric, direction)
            }
            // What is ideal reflects no light from a direction that was not chosen for it.
            Bsdf::Conductor { .. } | Bsdf::Dielectric(_) | Bsdf::ThinDielectric(_) => {
                Rgb::constant(DVec3::ZERO)
            }
        }
    }

    /// Whether all that is there is black.
    fn is_black(&self) -> bool {
        self.black && self.blend.as_ref().is_none_or(|blend| blend.other.black)
    }

    /// Whether nothing is reflected, and no light passes.
    pub(crate) fn is_dark(&self) -> bool {
        self.is_black() && self.opacity.is_none()
    }

    /// What is lit where the normal is tilted by θ: Smith's G₁ of GGX with α² = min(tan²θ/8, 1), which darkens the image
    /// smoothly towards the horizon of the surface itself (Estevez, Lecocq and Stein 2019).
    fn shadowed_by_relief(&self, own: Vec3<T>, direction: Vec3<T>) -> T {
        let one = T::constant(1.0);
        let cos2 = self.normal.dot(own).squared();
        let width = (one - cos2) / cos2 * 0.125;
        let width = if width.value() > 1.0 { one } else { width };
        if width.value() <= 0.0 {
            return one;
        }
        Microfacets::Ggx.unshadowed(own.dot(direction).abs(), width.sqrt())
    }

    /// Whether light may pass the surface by other than the masked part of it.
    pub(crate) fn transmits(&self) -> bool {
        self.bsdf.transmits() || self.blend.as_ref().is_some_and(|blend| blend.other.bsdf.transmits())
    }

    /// Whether light from a direction may be reflected or pass, as far as the side says.
    #[inline]
    pub(crate) fn receives(&self, direction: DVec3) -> bool {
        !self.receives_none(self.normal.value().dot(direction))
    }

    fn receives_none(&self, cosine: f64) -> bool {
        cosine <= 0.0 && (cosine == 0.0 || !self.transmits())
    }

    /// Whether nothing can come of a direction where the surface's own normal has it on another side.
    fn hides(&self, direction: DVec3) -> bool {
        let normal = self.normal.value();
        self.is_black()
            || self.beneath.is_some_and(|own| own.value().dot(direction) * normal.dot(direction) <= 0.0)
    }

    /// By how much refraction into a direction compresses radiance, η²: what roulette must not take for loss.
    #[inline]
    pub(crate) fn compression(&self, direction: DVec3) -> f64 {
        let eta = match self.bsdf {
            Bsdf::Dielectric(dielectric) => dielectric.eta,
            Bsdf::Principled(principled) => principled.eta,
            _ => return 1.0,
        };
        if self.normal.value().dot(direction) > 0.0 || self.opacity.is_some() {
            1.0
        } else if self.behind {
            1.0 / (eta * eta)
        } else {
            eta * eta
        }
    }

    /// How narrow the lobe is: the concentration a kernel on it should have beyond that for diffuse surfaces. Of a mixture, that
    /// of the narrower lobe.
    pub(crate) fn concentration(&self) -> f64 {
        let other = self.blend.as_ref().map_or(0.0, |blend| blend.other.concentration());
        other.max(self.concentration_alone())
    }

    fn concentration_alone(&self) -> f64 {
        let alpha = match self.bsdf {
            Bsdf::Principled(_) | Bsdf::PrincipledThin(_) => principled::alpha(self.roughness.value()),
            bsdf if bsdf.roughness().is_some() => self.roughness.value(),
            Bsdf::Conductor { .. } | Bsdf::Dielectric(_) | Bsdf::ThinDielectric(_) => 0.0,
            _ => return 0.0,
        };
        // Facets within α tilt the mirrored ray by up to 2 α.
        0.25 / (alpha * alpha)
    }

    /// The density of smooth directions that [`sample`](Self::sample) returns.
    #[inline]
    pub(crate) fn density(&self, direction: DVec3) -> f64 {
        let cosine = self.normal.value().dot(direction);
        if self.is_merely_diffuse() && cosine > 0.0 {
            return diffuse::density(cosine);
        }
        self.density_of_any(direction, cosine)
    }

    #[inline(never)]
    fn density_of_any(&self, direction: DVec3, cosine: f64) -> f64 {
        if self.receives_none(cosine) {
            return 0.0;
        }
        let density = match &self.blend {
            Some(blend) => {
                let part = blend.part();
                (1.0 - part) * self.density_alone(direction, cosine)
                    + part * blend.other.density_alone(direction, cosine)
            }
            None => self.density_alone(direction, cosine),
        };
        self.opacity.map_or(density, |opacity| density * opacity.value())
    }

    /// The same of one part of a mixture.
    fn density_alone(&self, direction: DVec3, cosine: f64) -> f64 {
        if self.black || cosine <= 0.0 && !self.bsdf.transmits() {
            return 0.0;
        }
        match self.bsdf {
            Bsdf::Diffuse { .. } => diffuse::density(cosine),
            Bsdf::RoughConductor { .. } => self.facets().reflection_density(direction),
            Bsdf::Plastic(plastic) => self.coated(plastic).map_or(0.0, |c| c.density(direction)),
            Bsdf::Principled(_) => self.lobes().map_or(0.0, |lobes| lobes.density(direction)),
            Bsdf::PrincipledThin(_) => self.sheet().map_or(0.0, |sheet| sheet.density(direction)),
            Bsdf::Dielectric(dielectric) if dielectric.facets.is_some() => {
                dielectric::rough_density(self, dielectric, direction)
            }
            Bsdf::Conductor { .. } | Bsdf::Dielectric(_) | Bsdf::ThinDielectric(_) => 0.0,
        }
    }

    /// A way on: an ideal one, or a direction roughly as [`evaluate`](Self::evaluate) is distributed.
    #[inline]
    pub(crate) fn sample(&self, numbers: [f64; 3]) -> Option<Bounce<T>> {
        if self.is_merely_diffuse() {
            return self.smooth(self.above(diffuse::sample(numbers)));
        }
        self.sample_any(numbers)
    }

    #[inline(never)]
    fn sample_any(&self, [a, b, c]: [f64; 3]) -> Option<Bounce<T>> {
        let mut choice = c;
        if let Some(opacity) = self.opacity {
            let part = opacity.value();
            if choice >= part {
                let passed = (T::constant(1.0) - opacity) * (1.0 / (1.0 - part));
                return Some(Bounce::Ideal(Ideal { direction: -self.viewer, factor: Rgb([passed; 3]) }));
            }
            choice /= part;
        }
        let bounce = match &self.blend {
            Some(blend) => self.sample_mixed(blend, [a, b, choice]),
            None => self.sample_alone([a, b, choice]),
        }?;
        Some(match (bounce, self.opacity) {
            // What a mask covers is as likely as its part of the surface, which the choice has seen to.
            (Bounce::Ideal(Ideal { direction, factor }), Some(opacity)) => {
                Bounce::Ideal(Ideal { direction, factor: factor * (opacity * (1.0 / opacity.value())) })
            }
            (bounce, _) => bounce,
        })
    }

    /// A way on of a mixture. Both parts may have made a smooth direction; an ideal one is of the part that was chosen.
    fn sample_mixed(&self, blend: &Mixed<'_, T>, [a, b, choice]: [f64; 3]) -> Option<Bounce<T>> {
        let part = blend.part();
        let (shading, weight, part, choice) = if choice < part {
            (&blend.other, blend.weight, part, choice / part)
        } else {
            (self, T::constant(1.0) - blend.weight, 1.0 - part, (choice - part) / (1.0 - part))
        };
        match shading.sample_alone([a, b, choice])? {
            Bounce::Smooth(Sampled { direction, .. }) => self.smooth(direction),
            Bounce::Ideal(Ideal { direction, factor }) => {
                Some(Bounce::Ideal(Ideal { direction, factor: factor * (weight * (1.0 / part)) }))
            }
        }
    }

    /// A direction with the density of them all, if there is one.
    #[inline]
    fn smooth(&self, direction: DVec3) -> Option<Bounce<T>> {
        let density = self.density(direction);
        let good = density > 0.0 && density.is_finite();
        good.then_some(Bounce::Smooth(Sampled { direction, density }))
    }

    /// A way on of one part of a mixture.
    fn sample_alone(&self, [a, b, choice]: [f64; 3]) -> Option<Bounce<T>> {
        if self.black {
            return None;
        }
        let ideal = match self.bsdf {
            Bsdf::Conductor { eta, k, .. } => {
                let reflected = fresnel::conductor_rgb(self.normal.dot(self.viewer), *eta, *k);
                Some(Ideal { direction: self.mirrored(), factor: self.reflectance * reflected })
            }
            Bsdf::Dielectric(d) if d.facets.is_none() => Some(dielectric::smooth(self, d, choice)),
            Bsdf::ThinDielectric(d) => Some(dielectric::thin(self, d, choice)),
            Bsdf::Plastic(plastic) if plastic.facets.is_none() => self.coated(plastic)?.mirror(choice),
            _ => None,
        };
        if let Some(ideal) = ideal {
            let factor = ideal.factor;
            let lit = |own| self.shadowed_by_relief(own, ideal.direction);
            let factor = self.beneath.map_or(factor, |own| factor * lit(own));
            let seen = !self.hides(ideal.direction.value());
            return seen.then_some(Bounce::Ideal(Ideal { factor, ..ideal }));
        }
        let numbers = [a, b, choice];
        let direction = match self.bsdf {
            Bsdf::Diffuse { .. } => self.above(diffuse::sample(numbers)),
            Bsdf::RoughConductor { .. } => {
                let (half, viewer) = (self.facets().sample([a, b]), self.viewer.value());
                2.0 * viewer.dot(half) * half - viewer
            }
            Bsdf::Plastic(plastic) => self.coated(plastic)?.sample(numbers),
            Bsdf::Principled(_) => self.lobes()?.sample(numbers)?,
            Bsdf::PrincipledThin(_) => self.sheet()?.sample(numbers)?,
            Bsdf::Dielectric(dielectric) => dielectric::rough_sample(self, dielectric, numbers)?,
            Bsdf::Conductor { .. } | Bsdf::ThinDielectric(_) => return None,
        };
        self.smooth(direction)
    }

    /// The mirrored direction.
    fn mirrored(&self) -> Vec3<T> {
        let cosine = self.normal.dot(self.viewer);
        self.normal * (cosine * 2.0) - self.viewer
    }

    /// A direction about the normal, given one about z.
    #[inline]
    fn above(&self, local: DVec3) -> DVec3 {
        let n = self.normal.value();
        let (s, t) = n.any_orthonormal_pair();
        local.x * s + local.y * t + local.z * n
    }

    /// The facets of its rough boundary; those of smooth ones are of no use.
    fn facets(&self) -> Facets<T> {
        let distribution = self.bsdf.facets().map_or(Microfacets::Ggx, |facets| facets.distribution);
        let alpha = self.roughness;
        let stretch = self.along.map(|along| Stretch::new(self.normal, along, [alpha, self.across]));
        Facets { distribution, alpha, normal: self.normal, viewer: self.viewer, stretch }
    }

    fn lobes(&self) -> Option<Lobes<'_, T>> {
        match self.numbers.as_deref() {
            Some(Numbers::Solid(principled)) => Some(Lobes::new(self, principled)),
            _ => None,
        }
    }

    fn sheet(&self) -> Option<Sheet<'_, T>> {
        match self.numbers.as_deref() {
            Some(Numbers::Thin(thin)) => Some(Sheet::new(self, thin)),
            _ => None,
        }
    }

    fn coated<'a>(&'a self, plastic: &'a Plastic) -> Option<Coated<'a, T>> {
        let coating = self.coating?;
        Some(Coated { shading: self, plastic, coating })
    }
}

#[cfg(test)]
mod tests;
