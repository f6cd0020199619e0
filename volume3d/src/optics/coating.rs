//! Transmittance of a dielectric coating: Fresnel's equations if it is smooth, tables if it is rough.

use std::f64::consts::PI;

use flatland::calculus::{Dual, Number};
use rayon::prelude::*;

use super::{Microfacets, fresnel};

/// Nodes of a table over the cosine.
const NODES: usize = 64;

/// Nodes of the integral over facets: in slope and azimuth.
const SLOPES: usize = 48;
const TURNS: usize = 24;

/// Relative step of the finite differences by roughness. At the critical angle Fresnel's term has the slope
/// of a square root: the sum of per-node derivatives is off by 7 %, while differences over this step agree
/// with wider ones within 5 %.
const STEP: f64 = 0.02;

/// Transmittance of a coating by angle, and its internal reflectance for diffuse light; with both, diffuse
/// reflection below it is as in Mitsuba's `plastic` and `roughplastic`. For a rough coating, derivatives by
/// the roughness are stored with the values.
#[derive(Clone, Debug, PartialEq)]
pub(crate) struct Coating {
    /// Ratio of the inner to the outer index of refraction.
    eta: f64,
    /// By evenly spaced cosines; empty if it is smooth.
    transmitted: Vec<Dual<1>>,
    internal: Dual<1>,
}

impl Coating {
    /// A smooth coating, with the ratio of the inner to the outer index of refraction.
    pub(crate) fn smooth(eta: f64) -> Self {
        Self { eta, transmitted: vec![], internal: Dual::constant(fresnel::diffuse(1.0 / eta)) }
    }

    /// A rough coating.
    pub(crate) fn rough(distribution: Microfacets, alpha: f64, eta: f64) -> Self {
        let by_alpha = |function: &(dyn Fn(f64) -> f64 + Sync)| {
            let step = STEP * alpha;
            let [low, high] = [alpha - step, alpha + step].map(function);
            Dual::new(function(alpha), [(high - low) / (2.0 * step)])
        };
        let at = |alpha| (distribution, alpha);
        let nodes = || (0..NODES).into_par_iter().map(cosine);
        let transmitted = nodes().map(|mu| by_alpha(&|alpha| transmittance(at(alpha), eta, mu))).collect();
        // Mean over nodes, as in the reference implementation: 1.6 % above the integral 2 ∫ R μ dμ. Summed in
        // order.
        let weighted: Vec<Dual<1>> =
            nodes().map(|mu| by_alpha(&|alpha| reflectance(at(alpha), 1.0 / eta, mu)) * mu).collect();
        let internal = weighted.into_iter().fold(Dual::constant(0.0), |a, b| a + b) * (2.0 / NODES as f64);
        Self { eta, transmitted, internal }
    }

    /// Transmittance at an angle, linear between nodes, for the roughness of the table.
    pub(crate) fn transmitted<T: Number>(&self, cosine: T, alpha: T) -> T {
        if self.transmitted.is_empty() {
            return T::constant(1.0) - fresnel::dielectric(cosine, self.eta).0;
        }
        let place = cosine * (NODES - 1) as f64;
        let i = (place.value().max(0.0) as usize).min(NODES - 2);
        let rest = place - T::constant(i as f64);
        let [low, high] = [0, 1].map(|k| numbered(self.transmitted[i + k], alpha));
        low * (T::constant(1.0) - rest) + high * rest
    }

    /// Internal reflectance for diffuse light.
    pub(crate) fn internal<T: Number>(&self, alpha: T) -> T {
        numbered(self.internal, alpha)
    }
}

/// A function of the roughness, from its value and derivative.
fn numbered<T: Number>(entry: Dual<1>, alpha: T) -> T {
    alpha.chain(entry.value, entry.tangent[0])
}

/// Cosines of the nodes. At exactly grazing incidence no facet is visible.
fn cosine(node: usize) -> f64 {
    (node as f64 / (NODES - 1) as f64).max(1e-6)
}

/// Mean over the facets visible from a direction, with weight D G₁(θᵢ) (v·m)⁺/cos θᵢ, of a function of v·m
/// and of the facet's height m·n. The function returns the height of the outgoing direction and the fraction
/// of light there; shadowed light is excluded.
///
/// Facets are sampled with density D cos θ, tan²θ = α² s(u), at midpoints: of 1 − √(1 − u), as the steepest
/// facets of GGX matter most at grazing angles, and of the azimuth.
fn mean(
    (distribution, alpha): (Microfacets, f64),
    cosine: f64,
    scattered: impl Fn(f64, f64) -> (f64, f64),
) -> f64 {
    let sine = (1.0 - cosine * cosine).max(0.0).sqrt();
    let mut sum = 0.0;
    for i in 0..SLOPES {
        let rest = 1.0 - (i as f64 + 0.5) / SLOPES as f64;
        let u = 1.0 - rest * rest;
        let slope2 = match distribution {
            Microfacets::Beckmann => -(-u).ln_1p(),
            Microfacets::Ggx => u / (1.0 - u),
        };
        let tangent = alpha * slope2.sqrt();
        let up = 1.0 / (1.0 + tangent * tangent).sqrt();
        for j in 0..TURNS {
            let along = (PI * (j as f64 + 0.5) / TURNS as f64).cos();
            let visible = up * (tangent * (along * sine) + cosine);
            if visible > 0.0 {
                let (height, part) = scattered(visible, up);
                let seen = distribution.unshadowed(height, alpha) * visible / (up * cosine);
                sum += part * seen * (2.0 * rest);
            }
        }
    }
    sum * distribution.unshadowed(cosine, alpha) * (1.0 / (SLOPES * TURNS) as f64)
}

/// Light that facets transmit, without the shadowed part.
fn transmittance(facets: (Microfacets, f64), eta: f64, cosine: f64) -> f64 {
    mean(facets, cosine, |visible, up| {
        let (reflected, beyond) = fresnel::dielectric(visible, eta);
        // Below, at −((v·m/η − cos θₜ) m − v/η)·n.
        let depth = (beyond - visible * (1.0 / eta)) * up + cosine / eta;
        (depth, 1.0 - reflected)
    })
}

/// Light that facets reflect, without the shadowed part.
fn reflectance(facets: (Microfacets, f64), eta: f64, cosine: f64) -> f64 {
    mean(facets, cosine, |visible, up| {
        let height = visible * up * 2.0 - cosine;
        (height, fresnel::dielectric(visible, eta).0)
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A nearly smooth coating equals Fresnel's, inside and out.
    #[test]
    fn smooth_coatings_are_known() {
        for distribution in [Microfacets::Beckmann, Microfacets::Ggx] {
            let coating = Coating::rough(distribution, 1e-3, 1.5);
            for i in [25, 40, 63] {
                let (mu, expected) = (cosine(i), 1.0 - fresnel::dielectric(cosine(i), 1.5).0);
                let found = coating.transmitted(mu, 1e-3);
                assert!((found - expected).abs() < 2e-3, "{distribution:?} {mu}: {found} {expected}");
            }
            let (found, expected) = (coating.internal(1e-3), fresnel::diffuse(1.0 / 1.5));
            assert!((found / expected - 1.0).abs() < 0.02, "{distribution:?}: {found} {expected}");
        }
    }

    /// Comparison with 1600 × 400 nodes of the same integrals, for η = 1.5.
    #[test]
    fn tables_have_converged() {
        let known = [(Microfacets::Ggx, 0.3, 0.825, 0.9528), (Microfacets::Beckmann, 0.3, 0.8380, 0.9598)];
        for (distribution, alpha, oblique, normal) in known {
            let coating = Coating::rough(distribution, alpha, 1.5);
            for (node, expected) in [(20, oblique), (63, normal)] {
                let found = coating.transmitted(cosine(node), alpha);
                assert!((found - expected).abs() < 1e-3, "{distribution:?} {node}: {found} {expected}");
            }
        }
    }

    #[test]
    fn derivatives_by_the_roughness_are_those_of_differences() {
        for distribution in [Microfacets::Beckmann, Microfacets::Ggx] {
            // A wider step than the tables', so that each reveals the other's error.
            let (alpha, h) = (0.2, 0.01);
            let [low, at, high] = [alpha - h, alpha, alpha + h].map(|a| Coating::rough(distribution, a, 1.5));
            for i in 0..NODES {
                let expected = (high.transmitted[i].value - low.transmitted[i].value) / (2.0 * h);
                let found = at.transmitted[i].tangent[0];
                assert!((found - expected).abs() < 1e-3 + 5e-2 * expected.abs(), "{i}: {found} {expected}");
            }
            let expected = (high.internal.value - low.internal.value) / (2.0 * h);
            let found = at.internal.tangent[0];
            assert!((found - expected).abs() < 1e-3 + 5e-2 * expected.abs(), "{found} {expected}");
        }
    }
}
