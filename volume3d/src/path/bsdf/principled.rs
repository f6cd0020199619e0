//! The principled BSDF (Burley 2012, 2015), with the terms and weights of Mitsuba's `principled`: a diffuse
//! base with retro-reflection, a main lobe that blends metal and dielectric, refraction, a clear coat and
//! sheen.

use std::f64::consts::{FRAC_1_PI, PI, TAU};

use flatland::calculus::{Number, Rgb, Vec3};
use glam::DVec3;

use super::facets::{Facets, Stretch};
use super::{Shading, dielectric, diffuse};
use crate::optics::{Microfacets, fresnel};
use crate::scene::Principled;

/// Least α of the main lobe.
const LEAST_ALPHA: f64 = 1e-3;

/// The principled BSDF at a shading point.
pub(super) struct Lobes<'s, T> {
    shading: &'s Shading<'s, T>,
    principled: &'s Principled<T>,
    facets: Facets<T>,
    /// Relative index of refraction: beyond the surface over the viewer's side.
    eta: f64,
    /// (1 − metallic) (1 − spec_trans) and (1 − metallic) spec_trans.
    reflecting: T,
    refracting: T,
}

/// Lobe from which a direction is sampled.
#[derive(Clone, Copy, Debug)]
enum Lobe {
    Diffuse,
    Clearcoat,
    Refraction,
    Reflection,
}

impl<'s, T: Number> Lobes<'s, T> {
    pub(super) fn new(shading: &'s Shading<'s, T>, principled: &'s Principled<T>) -> Self {
        let one = T::constant(1.0);
        let base = one - principled.metallic;
        Self {
            shading,
            principled,
            facets: facets(shading, principled.roughness, principled.anisotropic),
            eta: if shading.behind { 1.0 / principled.eta } else { principled.eta },
            reflecting: base * (one - principled.spec_trans),
            refracting: base * principled.spec_trans,
        }
    }

    /// f |cos θ|.
    pub(super) fn evaluate(&self, direction: Vec3<T>) -> Rgb<T> {
        let Shading { normal, viewer, behind, .. } = *self.shading;
        let cosine = normal.dot(direction);
        if cosine.value() < 0.0 {
            return self.refraction(direction);
        }
        let (facets, at_facet) = self.facets.reflect(direction);
        let (dielectric, _) = fresnel::dielectric(at_facet, self.eta);
        if behind {
            return white(facets * dielectric * self.refracting);
        }
        let half = (viewer + direction).normalized();
        let mut sum = self.tinted_fresnel(dielectric, at_facet) * facets;
        if is_there(self.principled.clearcoat) {
            sum = sum + white(self.clearcoat(half, direction));
        }
        let p = self.principled;
        if is_there(self.reflecting) {
            let lobe = base_lobe(self.shading, half, direction, p.roughness, p.flatness);
            sum = sum + self.shading.reflectance * (lobe * cosine * self.reflecting);
        }
        if is_there(p.sheen) && is_there(self.reflecting) {
            let weight = schlick(direction.dot(half)) * cosine * (p.sheen * (T::constant(1.0) - p.metallic));
            sum = sum + tint(self.shading.reflectance, p.sheen_tint) * weight;
        }
        sum
    }

    /// Fresnel term of the main lobe on the front: metal in the base colour, dielectric, and tinted
    /// dielectric.
    fn tinted_fresnel(&self, dielectric: T, cosine: T) -> Rgb<T> {
        let p = self.principled;
        let one = T::constant(1.0);
        let base = one - p.metallic;
        let mut sum = white(dielectric * (base * (one - p.spec_tint)));
        if is_there(p.metallic) {
            sum = sum + self.schlick_towards_white(self.shading.reflectance, cosine) * p.metallic;
        }
        if is_there(p.spec_tint) {
            let normal = ((self.eta - 1.0) / (self.eta + 1.0)).powi(2);
            let at_normal = tint(self.shading.reflectance, one) * T::constant(normal);
            sum = sum + self.schlick_towards_white(at_normal, cosine) * (base * p.spec_tint);
        }
        sum
    }

    /// R₀ + (1 − R₀)(1 − cos θ)⁵, with the angle in the thinner medium.
    fn schlick_towards_white(&self, normal: Rgb<T>, cosine: T) -> Rgb<T> {
        let weight = if self.eta > 1.0 { cosine } else { fresnel::dielectric(cosine, self.eta).1 };
        let weight = schlick(weight);
        normal * (T::constant(1.0) - weight) + white(weight)
    }

    fn refraction(&self, direction: Vec3<T>) -> Rgb<T> {
        if !is_there(self.refracting) {
            return Rgb::constant(DVec3::ZERO);
        }
        let Some((value, cosine)) = self.facets.refract(direction, self.eta) else {
            return Rgb::constant(DVec3::ZERO);
        };
        let passed = value * (T::constant(1.0) - fresnel::dielectric(cosine, self.eta).0) * self.refracting;
        let Rgb(channels) = self.shading.reflectance;
        Rgb(channels.map(Number::sqrt)) * passed
    }

    /// ¼ c F D G cos θₒ with F from 4 % and G for α = ¼.
    fn clearcoat(&self, half: Vec3<T>, direction: Vec3<T>) -> T {
        let Shading { normal, viewer, .. } = *self.shading;
        let fresnel = self.schlick_towards_white(white(T::constant(0.04)), viewer.dot(half)).0[0];
        let width = T::constant(0.25);
        let shadowing = Microfacets::Ggx.unshadowed(normal.dot(viewer), width)
            * Microfacets::Ggx.unshadowed(normal.dot(direction), width);
        let density = clearcoat_density(normal.dot(half), self.clearcoat_alpha());
        fresnel * density * shadowing * normal.dot(direction) * (self.principled.clearcoat * 0.25)
    }

    fn clearcoat_alpha(&self) -> T {
        T::constant(0.1) + self.principled.clearcoat_gloss * (0.001 - 0.1)
    }

    /// Probabilities of lobes, given the dielectric's reflectance at a facet.
    fn parts(&self, reflected: f64) -> [(Lobe, f64); 4] {
        let parts = if self.shading.behind {
            [0.0, 0.0, 1.0 - reflected, reflected]
        } else {
            let refracted = self.refracting.value() * (1.0 - reflected);
            [self.reflecting.value(), 0.25 * self.principled.clearcoat.value(), refracted, 1.0 - refracted]
        };
        let sum: f64 = parts.iter().sum();
        let lobes = [Lobe::Diffuse, Lobe::Clearcoat, Lobe::Refraction, Lobe::Reflection];
        std::array::from_fn(|i| (lobes[i], parts[i] / sum))
    }

    /// Probability density of [`sample`](Self::sample).
    pub(super) fn density(&self, direction: DVec3) -> f64 {
        let (n, viewer) = (self.shading.normal.value(), self.shading.viewer.value());
        if n.dot(direction) < 0.0 {
            if self.refracting.value() == 0.0 {
                return 0.0;
            }
            let found = self.facets.refraction_density(direction, self.eta);
            return found.map_or(0.0, |(density, cosine)| {
                density * self.parts(fresnel::dielectric(cosine, self.eta).0)[2].1
            });
        }
        let half = (viewer + direction).normalize();
        let cosine = viewer.dot(half);
        let [diffuse, clearcoat, _, reflection] =
            self.parts(fresnel::dielectric(cosine, self.eta).0).map(|(_, part)| part);
        let mut sum = reflection * self.facets.reflection_density(direction);
        if diffuse > 0.0 {
            sum += diffuse * diffuse::density(n.dot(direction));
        }
        if clearcoat > 0.0 {
            let up = n.dot(half);
            sum += clearcoat * clearcoat_density(up, self.clearcoat_alpha().value()) * up / (4.0 * cosine);
        }
        sum
    }

    /// Samples a direction; `None` if it ends on the wrong side.
    ///
    /// The facet of the main lobe is sampled first, then the lobe by the facet's reflectance. The sum of the
    /// weights does not depend on the facet, and neither do the probabilities of the diffuse lobe and the
    /// clear coat.
    pub(super) fn sample(&self, [a, b, c]: [f64; 3]) -> Option<DVec3> {
        let viewer = self.shading.viewer.value();
        let half = self.facets.sample([a, b]);
        let cosine = viewer.dot(half);
        if cosine <= 0.0 {
            return None;
        }
        let (reflected, _) = fresnel::dielectric(cosine, self.eta);
        let mut rest = c;
        let mut chosen = Lobe::Reflection;
        for (lobe, part) in self.parts(reflected) {
            if rest < part {
                (chosen, rest) = (lobe, rest / part);
                break;
            }
            rest -= part;
        }
        let direction = match chosen {
            Lobe::Diffuse => self.shading.above(diffuse::sample([a, b, rest])),
            Lobe::Clearcoat => {
                let half = self.shading.above(clearcoat_normal(self.clearcoat_alpha().value(), [a, b]));
                2.0 * viewer.dot(half) * half - viewer
            }
            Lobe::Reflection => 2.0 * cosine * half - viewer,
            Lobe::Refraction => dielectric::refracted_or_reflected(viewer, half, self.eta, 2.0)?.0,
        };
        let above = self.shading.normal.value().dot(direction) > 0.0;
        (above != matches!(chosen, Lobe::Refraction)).then_some(direction)
    }
}

/// α of a roughness r: r², and at least 10⁻³.
pub(super) fn alpha<T: Number>(roughness: T) -> T {
    let alpha = roughness.squared();
    if alpha.value() > LEAST_ALPHA { alpha } else { T::constant(LEAST_ALPHA) }
}

/// Facets of a roughness, whose α is divided by √(1 − 0.9 a) along u and multiplied by it orthogonally.
pub(super) fn facets<T: Number>(shading: &Shading<'_, T>, roughness: T, anisotropic: T) -> Facets<T> {
    let Shading { normal, viewer, along, .. } = *shading;
    let stretch = along.map(|along| {
        let aspect = (T::constant(1.0) - anisotropic * 0.9).sqrt();
        let least = |alpha: T| if alpha.value() > LEAST_ALPHA { alpha } else { T::constant(LEAST_ALPHA) };
        let alpha = roughness.squared();
        Stretch::new(normal, along, [least(alpha / aspect), least(alpha * aspect)])
    });
    Facets { distribution: Microfacets::Ggx, alpha: alpha(roughness), normal, viewer, stretch }
}

/// Whether a parameter matters: not if it is constantly 0.
pub(super) fn is_there<T: Number>(value: T) -> bool {
    value.value() != 0.0 || !value.is_still()
}

pub(super) fn white<T: Number>(value: T) -> Rgb<T> {
    Rgb([value; 3])
}

/// (1 − cos θ)⁵.
pub(super) fn schlick<T: Number>(cosine: T) -> T {
    let rest = (T::constant(1.0) - cosine).positive();
    rest.squared().squared() * rest
}

/// Blend of white and a colour's hue at luminance 1, with weight `part`.
pub(super) fn tint<T: Number>(colour: Rgb<T>, part: T) -> Rgb<T> {
    let Rgb([r, g, b]) = colour;
    let luminance = r * 0.212_671 + g * 0.715_160 + b * 0.072_169;
    if luminance.value() <= 0.0 {
        return Rgb::constant(DVec3::ONE);
    }
    let inverse = part / luminance;
    colour * inverse + white(T::constant(1.0) - part)
}

/// The diffuse lobe over the base colour, with retro-reflection at grazing angles, and flattened to
/// approximate subsurface scattering (Hanrahan and Krueger 1993).
pub(super) fn base_lobe<T: Number>(
    shading: &Shading<'_, T>,
    half: Vec3<T>,
    direction: Vec3<T>,
    roughness: T,
    flatness: T,
) -> T {
    let one = T::constant(1.0);
    let [above, out] = [shading.viewer, direction].map(|v| shading.normal.dot(v));
    let [fi, fo] = [above, out].map(schlick);
    let retro = roughness * direction.dot(half).squared() * 2.0;
    let diffuse = (one - fi * 0.5) * (one - fo * 0.5) + retro * (fo + fi + fo * fi * (retro - one));
    if !is_there(flatness) {
        return diffuse * FRAC_1_PI;
    }
    let [low, high] = [fi, fo].map(|f| one + (retro * 0.5 - one) * f);
    let below = (low * high * (one / (out + above) - T::constant(0.5)) + T::constant(0.5)) * 1.25;
    (diffuse * (one - flatness) + below * flatness) * FRAC_1_PI
}

/// D of the clear coat, GTR with exponent 1 (Burley 2012).
fn clearcoat_density<T: Number>(cosine: T, alpha: T) -> T {
    let (one, squared) = (T::constant(1.0), alpha.squared());
    let logarithm = squared.chain(squared.value().ln(), 1.0 / squared.value());
    let beyond = squared - one;
    beyond / (logarithm * PI) / (cosine.squared() * beyond + one)
}

/// Samples a facet of the clear coat with density D cos θ, about z.
fn clearcoat_normal(alpha: f64, [a, b]: [f64; 2]) -> DVec3 {
    let alpha2 = alpha * alpha;
    let cos2 = (1.0 - alpha2.powf(1.0 - b)) / (1.0 - alpha2);
    let sine = (1.0 - cos2).max(0.0).sqrt();
    let (sin, cos) = (TAU * a).sin_cos();
    DVec3::new(sine * cos, sine * sin, cos2.sqrt())
}
