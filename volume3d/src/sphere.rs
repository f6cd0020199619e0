//! The sphere of directions as a domain of integration.

use std::f64::consts::TAU;

use flatland::warp::{Domain, Draw};
use glam::DVec3;

/// The unit sphere S², n = 2, in ambient space, with the von Mises–Fisher kernel.
#[derive(Clone, Copy, Debug)]
pub struct Sphere;

impl Domain for Sphere {
    type Vector = DVec3;
    const CURVATURE: f64 = 2.0;

    /// For von Mises–Fisher, x = κ(1 − u·u') has the distribution function
    /// (1 − e⁻ˣ)/(1 − e^−2κ). Its power a is inverted by 1 − e⁻ˣ = ξ₀^(1/a) (1 − e^−2κ).
    fn draw(u: DVec3, kappa: f64, radial_exponent: f64, [a, b]: [f64; 2]) -> Draw<DVec3> {
        let within = a.powf(1.0 / radial_exponent) * -(-2.0 * kappa).exp_m1();
        let exponent = -(-within).ln_1p();
        // 1 − cos φ is carried instead of cos φ: at κ = 10¹² the latter would be rounding noise.
        let versine = (exponent / kappa).min(2.0);
        let (s, t) = u.any_orthonormal_pair();
        let (sin, cos) = (TAU * b).sin_cos();
        let tangent = (versine * (2.0 - versine)).sqrt() * (cos * s + sin * t);
        let log_density = (radial_exponent - 1.0) * within.ln() - exponent;
        // u cos φ = u − u (1 − cos φ)
        Draw { point: u - versine * u + tangent, tangent, exponent, log_density }
    }

    fn reflect(_: DVec3, draw: &Draw<DVec3>) -> Draw<DVec3> {
        Draw { point: draw.point - 2.0 * draw.tangent, tangent: -draw.tangent, ..*draw }
    }

    fn project(u: DVec3, v: DVec3) -> DVec3 {
        v - v.dot(u) * u
    }
}

#[cfg(test)]
mod tests {
    use flatland::random::{open01, stream};

    use super::*;

    #[test]
    fn draws_weighted_by_their_density_are_von_mises_fisher() {
        // E[u·u'] = coth κ − 1/κ.
        for kappa in [0.1, 1.0, 20.0, 1e12_f64] {
            for radial_exponent in [1.0, 0.4] {
                let u = DVec3::new(0.2, -0.5, 0.7).normalize();
                let mut rng = stream(1, &[]);
                let (mut sum, mut mass) = (0.0, 0.0);
                for _ in 0..400_000 {
                    let d = Sphere::draw(u, kappa, radial_exponent, [open01(&mut rng), open01(&mut rng)]);
                    assert!((d.point.length() - 1.0).abs() < 1e-14);
                    assert!(d.exponent > 0.0 && d.tangent.dot(u).abs() < 1e-15);
                    let w = (-d.exponent - d.log_density).exp();
                    sum += w * d.exponent;
                    mass += w;
                }
                let expected = kappa * (1.0 - 1.0 / kappa.tanh()) + 1.0;
                let expected = if kappa > 1e6 { 1.0 } else { expected };
                assert!(
                    (sum / mass - expected).abs() < 0.015 * expected,
                    "{kappa} {radial_exponent} {}",
                    sum / mass
                );
            }
        }
    }

    #[test]
    fn reflection_goes_through_u() {
        let u = DVec3::new(0.2, -0.5, 0.7).normalize();
        let d = Sphere::draw(u, 2.0, 0.5, [0.7, 0.3]);
        let r = Sphere::reflect(u, &d);
        assert!((r.point.length() - 1.0).abs() < 1e-15);
        assert!((r.point + d.point).cross(u).length() < 1e-15);
    }
}
