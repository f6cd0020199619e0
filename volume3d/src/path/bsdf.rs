//! Reflection at one point: its value with derivatives, and sampling by value alone.

use flatland::calculus::{Number, Rgb, Vec3};
use std::f64::consts::{FRAC_1_PI, PI, TAU};

use glam::{DVec2, DVec3};

use crate::scene::{Bsdf, Microfacets};

/// A shaded point: everything that reflection depends on.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Shading<'s, T> {
    pub(crate) bsdf: &'s Bsdf,
    /// On the viewer's side.
    pub(crate) normal: Vec3<T>,
    pub(crate) viewer: Vec3<T>,
    pub(crate) reflectance: Rgb<T>,
    pub(crate) roughness: T,
}

/// A direction and its density in solid angle.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Sampled {
    pub(crate) direction: DVec3,
    pub(crate) density: f64,
}

impl<T: Number> Shading<'_, T> {
    /// f(ω) cos θ, of the side the normal points to.
    pub(crate) fn evaluate(&self, direction: Vec3<T>) -> Rgb<T> {
        let cosine = self.normal.dot(direction).positive();
        if cosine.value() <= 0.0 {
            return Rgb::constant(DVec3::ZERO);
        }
        match self.bsdf {
            Bsdf::Diffuse { .. } => self.reflectance * (cosine * FRAC_1_PI),
            Bsdf::RoughConductor { distribution, eta, k, .. } => {
                let half = (self.viewer + direction).normalized();
                let facet = |v: Vec3<T>| self.normal.dot(v);
                let normals = density(*distribution, facet(half), self.roughness);
                let shadowing = unshadowed(*distribution, facet(self.viewer), self.roughness)
                    * unshadowed(*distribution, facet(direction), self.roughness);
                let fresnel = conductor_rgb(self.viewer.dot(half), *eta, *k);
                // F D G / (4 cos θᵢ cos θₒ) times cos θₒ
                self.reflectance * fresnel * (normals * shadowing / (facet(self.viewer) * 4.0))
            }
            // A mirror reflects no light from a direction that was not chosen for it.
            Bsdf::Conductor { .. } => Rgb::constant(DVec3::ZERO),
        }
    }

    /// The mirrored direction and what is reflected from it.
    pub(crate) fn mirror(&self) -> Option<(Vec3<T>, Rgb<T>)> {
        let Bsdf::Conductor { eta, k, .. } = self.bsdf else { return None };
        let cosine = self.normal.dot(self.viewer);
        let direction = self.normal * (cosine * 2.0) - self.viewer;
        Some((direction, self.reflectance * conductor_rgb(cosine, *eta, *k)))
    }

    /// How narrow the lobe is: the concentration a kernel on it should have beyond that for diffuse surfaces.
    pub(crate) fn concentration(&self) -> f64 {
        match self.bsdf {
            Bsdf::Diffuse { .. } => 0.0,
            // Facets within α tilt the mirrored ray by up to 2 α.
            _ => 0.25 / (self.roughness.value() * self.roughness.value()),
        }
    }

    /// The density of [`sample`](Self::sample).
    pub(crate) fn density(&self, direction: DVec3) -> f64 {
        let (n, viewer) = (self.normal.value(), self.viewer.value());
        let cosine = n.dot(direction);
        if cosine <= 0.0 {
            return 0.0;
        }
        match self.bsdf {
            Bsdf::Diffuse { .. } => (1.0 - DEFENSIVE) * cosine * FRAC_1_PI + DEFENSIVE / TAU,
            Bsdf::RoughConductor { distribution, .. } => {
                let alpha = self.roughness.value();
                let half = (viewer + direction).normalize();
                let facets = density(*distribution, n.dot(half), alpha);
                match distribution {
                    Microfacets::Beckmann => facets * n.dot(half) / (4.0 * viewer.dot(half)),
                    Microfacets::Ggx => {
                        facets * unshadowed(*distribution, n.dot(viewer), alpha) / (4.0 * n.dot(viewer))
                    }
                }
            }
            Bsdf::Conductor { .. } => 0.0,
        }
    }

    /// A direction of the upper side, roughly as [`evaluate`](Self::evaluate) is distributed.
    pub(crate) fn sample(&self, [a, b, c]: [f64; 3]) -> Option<Sampled> {
        let (n, viewer) = (self.normal.value(), self.viewer.value());
        let (s, t) = n.any_orthonormal_pair();
        let world = |v: DVec3| v.x * s + v.y * t + v.z * n;
        let direction = match self.bsdf {
            Bsdf::Diffuse { .. } => {
                let z = if c < DEFENSIVE { a } else { a.sqrt() };
                let (sin, cos) = (TAU * b).sin_cos();
                let r = (1.0 - z * z).max(0.0).sqrt();
                world(DVec3::new(r * cos, r * sin, z))
            }
            Bsdf::RoughConductor { distribution, .. } => {
                let alpha = self.roughness.value();
                let local = DVec3::new(viewer.dot(s), viewer.dot(t), viewer.dot(n));
                let half = world(match distribution {
                    Microfacets::Beckmann => beckmann_normal(alpha, [a, b]),
                    Microfacets::Ggx => visible_normal(local, alpha, [a, b]),
                });
                2.0 * viewer.dot(half) * half - viewer
            }
            Bsdf::Conductor { .. } => return None,
        };
        let density = self.density(direction);
        (density > 0.0 && density.is_finite()).then_some(Sampled { direction, density })
    }
}

/// The part of diffuse samples that is uniform over the hemisphere. The derivative of a cosine does not vanish
/// at the horizon, where the density of cosine samples does; without this part, gradients of a surface that
/// turns have infinite variance.
const DEFENSIVE: f64 = 0.1;

/// D(cos θ).
fn density<T: Number>(distribution: Microfacets, cosine: T, alpha: T) -> T {
    if cosine.value() <= 0.0 {
        return T::constant(0.0);
    }
    let (cos2, alpha2) = (cosine.squared(), alpha.squared());
    // tan²θ/α²
    let slope = (T::constant(1.0) - cos2) / (cos2 * alpha2);
    let scale = alpha2 * cos2.squared() * PI;
    match distribution {
        Microfacets::Beckmann => (-slope).exp() / scale,
        Microfacets::Ggx => T::constant(1.0) / (scale * (T::constant(1.0) + slope).squared()),
    }
}

/// Smith's G₁(cos θ): the part of facets that is not hidden. Beckmann's as approximated by Walter et al. (2007).
fn unshadowed<T: Number>(distribution: Microfacets, cosine: T, alpha: T) -> T {
    if cosine.value() <= 0.0 {
        return T::constant(0.0);
    }
    let one = T::constant(1.0);
    let cos2 = cosine.squared();
    // α² tan²θ
    let slope2 = alpha.squared() * ((one - cos2) / cos2);
    if slope2.value() <= 0.0 {
        return one;
    }
    match distribution {
        Microfacets::Ggx => T::constant(2.0) / (one + (one + slope2).sqrt()),
        Microfacets::Beckmann => {
            let a = one / slope2.sqrt();
            if a.value() >= 1.6 {
                return one;
            }
            (a * 3.535 + a.squared() * 2.181) / (one + a * 2.276 + a.squared() * 2.577)
        }
    }
}

/// Fresnel reflectance of a conductor, unpolarised.
fn conductor_rgb<T: Number>(cosine: T, eta: DVec3, k: DVec3) -> Rgb<T> {
    Rgb(std::array::from_fn(|i| conductor(cosine, eta[i], k[i])))
}

fn conductor<T: Number>(cosine: T, eta: f64, k: f64) -> T {
    let cos2 = cosine.squared();
    let sin2 = T::constant(1.0) - cos2;
    // a² + b² = |η² − k² − sin² + 2iηk|, 2a² = that plus the real part.
    let real = T::constant(eta * eta - k * k) - sin2;
    let modulus = (real.squared() + T::constant(4.0 * eta * eta * k * k)).sqrt();
    let a = ((modulus + real).positive() * 0.5).sqrt();
    let (sum, cross) = (modulus + cos2, a * cosine * 2.0);
    let perpendicular = (sum - cross) / (sum + cross);
    let (sum, cross) = (cos2 * modulus + sin2.squared(), cross * sin2);
    let parallel = perpendicular * ((sum - cross) / (sum + cross));
    (perpendicular + parallel) * 0.5
}

/// A facet normal with density D cos θ (Beckmann): tan²θ is exponential with mean α².
fn beckmann_normal(alpha: f64, [a, b]: [f64; 2]) -> DVec3 {
    let cosine = 1.0 / (1.0 - alpha * alpha * a.ln()).sqrt();
    let sine = (1.0 - cosine * cosine).max(0.0).sqrt();
    let (sin, cos) = (TAU * b).sin_cos();
    DVec3::new(sine * cos, sine * sin, cosine)
}

/// A facet normal of GGX that is visible from `viewer` (Heitz 2018).
fn visible_normal(viewer: DVec3, alpha: f64, [a, b]: [f64; 2]) -> DVec3 {
    let stretched = DVec3::new(alpha * viewer.x, alpha * viewer.y, viewer.z).normalize();
    let (r, (sin, cos)) = (a.sqrt(), (TAU * b).sin_cos());
    let disc = DVec2::new(r * cos, r * sin);
    let lift = 0.5 * (1.0 + stretched.z);
    // One axis of the disc lies in the surface.
    let side = DVec3::Z.cross(stretched).try_normalize().unwrap_or(DVec3::X);
    let other = stretched.cross(side);
    let y = (1.0 - lift) * (1.0 - disc.x * disc.x).max(0.0).sqrt() + lift * disc.y;
    let z = (1.0 - disc.x * disc.x - y * y).max(0.0).sqrt();
    let h = disc.x * side + y * other + z * stretched;
    DVec3::new(alpha * h.x, alpha * h.y, h.z.max(0.0)).normalize()
}

#[cfg(test)]
mod tests {
    use flatland::random::{open01, stream};

    use super::*;
    use crate::scene::Reflectance;

    fn bsdfs() -> Vec<Bsdf> {
        let white = || Reflectance::Constant(DVec3::ONE);
        let rough = |distribution| Bsdf::RoughConductor {
            distribution,
            alpha: 0.3,
            eta: DVec3::ZERO,
            k: DVec3::ONE,
            specular_reflectance: white(),
        };
        vec![Bsdf::Diffuse { reflectance: white() }, rough(Microfacets::Beckmann), rough(Microfacets::Ggx)]
    }

    fn shading(bsdf: &Bsdf, viewer: DVec3, alpha: f64) -> Shading<'_, f64> {
        Shading {
            bsdf,
            normal: Vec3::constant(DVec3::new(0.6, 0.0, 0.8)),
            viewer: Vec3::constant(viewer),
            reflectance: Rgb::constant(DVec3::ONE),
            roughness: alpha,
        }
    }

    /// A direction of the unit sphere.
    fn uniform(rng: &mut flatland::random::Stream) -> DVec3 {
        let z = 2.0 * open01(rng) - 1.0;
        let (sin, cos) = (TAU * open01(rng)).sin_cos();
        let r = (1.0 - z * z).sqrt();
        DVec3::new(r * cos, r * sin, z)
    }

    #[test]
    fn sampling_agrees_with_its_density_and_with_the_albedo() {
        for bsdf in &bsdfs() {
            for viewer in [DVec3::new(0.6, 0.0, 0.8), DVec3::new(0.0, 0.6, 0.8)] {
                let shading = shading(bsdf, viewer, 0.3);
                let mut rng = stream(1, &[]);
                let n = 400_000;
                let axis = DVec3::new(0.3, 0.5, 0.81).normalize();
                // ∫ f cos and ∫ p (ω·a)², by uniform directions and by sampling.
                let (mut uniformly, mut sampled) = ([0.0; 2], [0.0; 2]);
                for _ in 0..n {
                    let direction = uniform(&mut rng);
                    let value = shading.evaluate(Vec3::constant(direction)).value().x;
                    uniformly[0] += 4.0 * PI * value;
                    uniformly[1] += 4.0 * PI * shading.density(direction) * direction.dot(axis).powi(2);
                    let xi = [(); 3].map(|()| open01(&mut rng));
                    if let Some(s) = shading.sample(xi) {
                        sampled[0] += shading.evaluate(Vec3::constant(s.direction)).value().x / s.density;
                        sampled[1] += s.direction.dot(axis).powi(2);
                    }
                }
                for i in 0..2 {
                    let (a, b) = (uniformly[i] / f64::from(n), sampled[i] / f64::from(n));
                    assert!((a - b).abs() < 0.02 * a.abs().max(b.abs()), "{bsdf:?} {viewer} {i}: {a} {b}");
                }
                assert!(sampled[0] / f64::from(n) < 1.005, "no surface reflects more than it receives");
            }
        }
    }

    #[test]
    fn reflection_is_reciprocal() {
        let mut rng = stream(3, &[]);
        for bsdf in &bsdfs() {
            for _ in 0..100 {
                let (a, b) = (uniform(&mut rng), uniform(&mut rng));
                let n = DVec3::new(0.6, 0.0, 0.8);
                if a.dot(n) > 0.01 && b.dot(n) > 0.01 {
                    let f = |i: DVec3, o: DVec3| {
                        shading(bsdf, i, 0.3).evaluate(Vec3::constant(o)).value().x / o.dot(n)
                    };
                    assert!((f(a, b) - f(b, a)).abs() < 1e-10 * f(a, b));
                }
            }
        }
    }

    #[test]
    fn a_conductor_that_absorbs_nothing_mirrors_all() {
        assert!((conductor(0.3, 0.0, 1.0) - 1.0).abs() < 1e-12);
        // Normal incidence: ((η − 1)² + k²)/((η + 1)² + k²).
        let (eta, k) = (0.2, 3.9);
        let expected = ((eta - 1.0f64).powi(2) + k * k) / ((eta + 1.0f64).powi(2) + k * k);
        assert!((conductor(1.0, eta, k) - expected).abs() < 1e-12);
    }
}
