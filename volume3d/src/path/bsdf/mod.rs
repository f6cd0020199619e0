//! BSDFs at a point: evaluation over numbers, and sampling by value. One file per material.

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
pub(crate) use self::shading::{Bounce, Branch, Ideal, Mixed, Numbers, Passage, Sampled, Shading};
use crate::optics::{Microfacets, fresnel};
use crate::scene::{Bsdf, Plastic};

impl<T: Number> Shading<'_, T> {
    /// f(ω) |cos θ|, without ideal directions.
    #[inline]
    pub(crate) fn evaluate(&self, direction: Vec3<T>) -> Rgb<T> {
        let cosine = self.normal.dot(direction);
        if self.is_merely_diffuse() && cosine.value() > 0.0 {
            return self.reflectance * (cosine * FRAC_1_PI);
        }
        self.evaluate_any(direction, cosine)
    }

    /// [`evaluate`](Self::evaluate) for any material.
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

    /// Fast-path test for the most frequent case: a diffuse material without opacity mask or blend.
    #[inline]
    fn is_merely_diffuse(&self) -> bool {
        matches!(self.bsdf, Bsdf::Diffuse { .. })
            && !self.black
            && self.blend.is_none()
            && self.opacity.is_none()
            && self.beneath.is_none()
    }

    /// (1 − w) a + w b for a quantity of the two parts of a mixture; the quantity itself for a single
    /// material.
    fn mixed<V: std::ops::Add<Output = V>>(&self, of: impl Fn(&Self) -> V, scale: impl Fn(V, T) -> V) -> V {
        let Some(blend) = &self.blend else { return of(self) };
        let rest = T::constant(1.0) - blend.weight;
        scale(of(self), rest) + scale(of(&blend.other), blend.weight)
    }

    /// [`evaluate`](Self::evaluate) without blend, opacity mask and normal map.
    fn evaluate_alone(&self, direction: Vec3<T>, cosine: T) -> Rgb<T> {
        // Mixed with glass, light arrives from behind too.
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
            // An ideal BSDF has no value for directions that were not sampled from it.
            Bsdf::Conductor { .. } | Bsdf::Dielectric(_) | Bsdf::ThinDielectric(_) => {
                Rgb::constant(DVec3::ZERO)
            }
        }
    }

    /// Whether the material is black, blend included.
    fn is_black(&self) -> bool {
        self.black && self.blend.as_ref().is_none_or(|blend| blend.other.black)
    }

    /// Whether the surface neither reflects nor transmits light.
    pub(crate) fn is_dark(&self) -> bool {
        self.is_black() && self.opacity.is_none()
    }

    /// Shadowing term of a tilted normal at angle θ: Smith's G₁ of GGX with α² = min(tan²θ/8, 1), which
    /// darkens the image smoothly towards the horizon of the geometric surface (Estevez, Lecocq and Stein
    /// 2019).
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

    /// Whether the material transmits light other than through its opacity mask.
    pub(crate) fn transmits(&self) -> bool {
        self.bsdf.transmits() || self.blend.as_ref().is_some_and(|blend| blend.other.bsdf.transmits())
    }

    /// Whether light from a direction may be reflected or transmitted, as far as the side is concerned.
    #[inline]
    pub(crate) fn receives(&self, direction: DVec3) -> bool {
        !self.receives_none(self.normal.value().dot(direction))
    }

    fn receives_none(&self, cosine: f64) -> bool {
        cosine <= 0.0 && (cosine == 0.0 || !self.transmits())
    }

    /// Whether a direction contributes nothing because the geometric normal has it on the other side.
    fn hides(&self, direction: DVec3) -> bool {
        let normal = self.normal.value();
        self.is_black()
            || self.beneath.is_some_and(|own| own.value().dot(direction) * normal.dot(direction) <= 0.0)
    }

    /// Compression of radiance by refraction into a direction, η²: Russian roulette must not treat it as
    /// loss.
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

    /// Whether all light is reflected or transmitted in ideal directions.
    pub(crate) fn is_ideal(&self) -> bool {
        let alone = |shading: &Self| match shading.bsdf {
            Bsdf::Conductor { .. } | Bsdf::ThinDielectric(_) => true,
            Bsdf::Dielectric(dielectric) => dielectric.facets.is_none(),
            _ => false,
        };
        alone(self) && self.blend.as_ref().is_none_or(|blend| alone(&blend.other))
    }

    /// Narrowness of the lobe: the excess of the concentration of its kernel over that of diffuse surfaces.
    /// For a mixture, the value of the narrower lobe; ideal directions have no kernel.
    pub(crate) fn concentration(&self) -> f64 {
        let other = self.blend.as_ref().map_or(0.0, |blend| blend.other.concentration());
        other.max(self.concentration_alone())
    }

    fn concentration_alone(&self) -> f64 {
        let alpha = match self.bsdf {
            Bsdf::Principled(_) | Bsdf::PrincipledThin(_) => principled::alpha(self.roughness.value()),
            bsdf if bsdf.roughness().is_some() => self.roughness.value(),
            _ => return 0.0,
        };
        // Facets tilted by up to α rotate the mirrored ray by up to 2 α.
        0.25 / (alpha * alpha)
    }

    /// Probability density of the non-ideal directions that [`sample`](Self::sample) returns.
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

    /// [`density`](Self::density) of one part of a mixture.
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

    /// Samples an ideal direction, or one approximately proportional to [`evaluate`](Self::evaluate).
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
                let branch = Passage::Unhindered.alone();
                let factor = Rgb([passed; 3]);
                return Some(Bounce::Ideal(Ideal { branch, direction: -self.viewer, factor }));
            }
            choice /= part;
        }
        let bounce = match &self.blend {
            Some(blend) => self.sample_mixed(blend, [a, b, choice]),
            None => self.sample_alone([a, b, choice]),
        }?;
        Some(match (bounce, self.opacity) {
            // A masked surface is chosen with the probability of its opacity, so that only derivatives remain
            // in the factor.
            (Bounce::Ideal(ideal), Some(opacity)) => {
                Bounce::Ideal(Ideal { factor: ideal.factor * (opacity * (1.0 / opacity.value())), ..ideal })
            }
            (bounce, _) => bounce,
        })
    }

    /// Samples a mixture. A non-ideal direction may come from both parts; an ideal one belongs to the part
    /// that was chosen.
    fn sample_mixed(&self, blend: &Mixed<'_, T>, [a, b, choice]: [f64; 3]) -> Option<Bounce<T>> {
        let part = blend.part();
        let is_of_other = choice < part;
        let (shading, weight, part, choice) = if is_of_other {
            (&blend.other, blend.weight, part, choice / part)
        } else {
            (self, T::constant(1.0) - blend.weight, 1.0 - part, (choice - part) / (1.0 - part))
        };
        match shading.sample_alone([a, b, choice])? {
            Bounce::Smooth(Sampled { direction, .. }) => self.smooth(direction),
            Bounce::Ideal(Ideal { branch, direction, factor }) => {
                let branch = Branch { is_of_other, ..branch };
                Some(Bounce::Ideal(Ideal { branch, direction, factor: factor * (weight * (1.0 / part)) }))
            }
        }
    }

    /// The direction of a branch; `None` if the material has none here.
    pub(crate) fn ideal(&self, branch: Branch) -> Option<Vec3<T>> {
        if branch.passage == Passage::Unhindered {
            return self.opacity.is_some().then(|| -self.viewer);
        }
        let alone = if branch.is_of_other { &self.blend.as_ref()?.other } else { self };
        if alone.black {
            return None;
        }
        let direction = match (branch.passage, alone.bsdf) {
            (Passage::Mirrored, bsdf) if bsdf.is_mirror() => alone.mirrored(),
            (Passage::Refracted, Bsdf::ThinDielectric(_)) => -alone.viewer,
            (Passage::Refracted, Bsdf::Dielectric(d)) if d.facets.is_none() => dielectric::towards(alone, d)?,
            _ => return None,
        };
        (!alone.hides(direction.value())).then_some(direction)
    }

    /// A direction with the density of the whole material, if it is nonzero.
    #[inline]
    fn smooth(&self, direction: DVec3) -> Option<Bounce<T>> {
        let density = self.density(direction);
        let good = density > 0.0 && density.is_finite();
        good.then_some(Bounce::Smooth(Sampled { direction, density }))
    }

    /// Samples one part of a mixture.
    fn sample_alone(&self, [a, b, choice]: [f64; 3]) -> Option<Bounce<T>> {
        if self.black {
            return None;
        }
        let ideal = match self.bsdf {
            Bsdf::Conductor { eta, k, .. } => {
                let reflected = fresnel::conductor_rgb(self.normal.dot(self.viewer), *eta, *k);
                let branch = Passage::Mirrored.alone();
                Some(Ideal { branch, direction: self.mirrored(), factor: self.reflectance * reflected })
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

    /// The mirror direction.
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

    /// The facets of its rough boundary; meaningless for smooth ones.
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
