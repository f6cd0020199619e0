//! The spaces a warp field lives on: where auxiliary points come from and what a tangent is.

use std::f64::consts::{PI, TAU};
use std::fmt::Debug;
use std::ops::{Add, Mul, Neg, Sub};

use glam::{DVec2, DVec3};
use rand::Rng;

use crate::random::open01;

/// What the machinery asks of a vector.
pub trait Vector:
    Copy
    + Debug
    + PartialEq
    + Add<Output = Self>
    + Sub<Output = Self>
    + Neg<Output = Self>
    + Mul<f64, Output = Self>
{
    /// The zero vector.
    const ZERO: Self;
    /// The inner product.
    #[must_use]
    fn dot(self, other: Self) -> f64;
    /// Whether every component is finite.
    #[must_use]
    fn is_finite(self) -> bool;
}

macro_rules! vector {
    ($type:ty) => {
        impl Vector for $type {
            const ZERO: Self = <$type>::ZERO;
            fn dot(self, other: Self) -> f64 {
                <$type>::dot(self, other)
            }
            fn is_finite(self) -> bool {
                <$type>::is_finite(self)
            }
        }
    };
}

vector!(DVec2);
vector!(DVec3);

/// An auxiliary point drawn around u with density proportional to e⁻ˣ.
#[derive(Clone, Copy, Debug)]
pub struct Draw<V> {
    /// The point u'.
    pub point: V,
    /// Its part tangent at u: u' − u in the plane, P_u u' on the circle and the sphere. In all of
    /// them ∇_u x = −κ times this.
    pub tangent: V,
    /// x = κ|u−u'|²/2 in the plane, κ(1 − u·u') on the circle and the sphere: D = eˣ − 1. Always
    /// positive.
    pub exponent: f64,
}

/// A domain of integration: the plane, the circle of directions or the sphere of directions.
///
/// Points and tangents are ambient vectors: of R² for the plane and the circle, of R³ for the
/// sphere.
pub trait Domain {
    /// Points and vectors.
    type Vector: Vector;

    /// The coefficient c of −c u·V in the divergence of a field that is projected to the tangent
    /// space: 0 in the plane, the dimension n on the unit circle and sphere.
    const CURVATURE: f64;

    /// Draws u' from the kernel of concentration κ around u: N(u, I/κ), von Mises or von
    /// Mises–Fisher. `xi` are uniform in (0, 1), and possibly stratified; `rng` serves only
    /// rejection.
    fn draw(u: Self::Vector, kappa: f64, xi: [f64; 2], rng: &mut impl Rng) -> Draw<Self::Vector>;

    /// The antithetic partner of a draw: its reflection through u.
    #[must_use]
    fn reflect(u: Self::Vector, draw: &Draw<Self::Vector>) -> Draw<Self::Vector>;

    /// P_u: the orthogonal projection of an ambient vector to the tangent space at u.
    #[must_use]
    fn project(u: Self::Vector, v: Self::Vector) -> Self::Vector;
}

/// The image plane R², n = 2.
#[derive(Clone, Copy, Debug)]
pub struct Plane;

impl Domain for Plane {
    type Vector = DVec2;
    const CURVATURE: f64 = 0.0;

    /// Box–Muller: x = −ln ξ₀ is exactly κ|u−u'|²/2.
    fn draw(u: DVec2, kappa: f64, [a, b]: [f64; 2], _: &mut impl Rng) -> Draw<DVec2> {
        let exponent = -a.ln();
        let tangent = (2.0 * exponent / kappa).sqrt() * DVec2::from_angle(TAU * b);
        Draw { point: u + tangent, tangent, exponent }
    }

    fn reflect(u: DVec2, draw: &Draw<DVec2>) -> Draw<DVec2> {
        Draw { point: u - draw.tangent, tangent: -draw.tangent, ..*draw }
    }

    fn project(_: DVec2, v: DVec2) -> DVec2 {
        v
    }
}

/// The unit circle S¹, n = 1, in the ambient plane.
#[derive(Clone, Copy, Debug)]
pub struct Circle;

impl Domain for Circle {
    type Vector = DVec2;
    const CURVATURE: f64 = 1.0;

    /// Best and Fisher (1979): a wrapped Cauchy proposal, accepted with probability at least 0.65.
    /// The first proposal uses `xi`, so strata survive where it is accepted. 1 − cos φ is carried
    /// instead of cos φ: at κ = 10¹² the latter would be rounding noise.
    fn draw(u: DVec2, kappa: f64, xi: [f64; 2], rng: &mut impl Rng) -> Draw<DVec2> {
        let tau = 1.0 + (4.0 * kappa * kappa + 1.0).sqrt();
        let rho = (tau - (2.0 * tau).sqrt()) / (2.0 * kappa);
        // s − 1 for the paper's s = (1 + ρ²)/(2ρ).
        let excess = (1.0 - rho).powi(2) / (2.0 * rho);
        let [mut a, mut b] = xi;
        loop {
            let half = 0.5 * PI * (2.0 * a - 1.0);
            // 1 − z = 2 sin², for z = cos(2·half).
            let one_minus_z = 2.0 * half.sin().powi(2);
            // 1 − cos φ = (s − 1)(1 − z)/(s + z)
            let versine = excess * one_minus_z / (excess + 2.0 - one_minus_z);
            let c = kappa * (excess + versine);
            if c * (2.0 - c) - b > 0.0 || (c / b).ln() + 1.0 - c >= 0.0 {
                let sine = (versine * (2.0 - versine)).max(0.0).sqrt().copysign(half);
                let tangent = sine * u.perp();
                // u cos φ = u − u (1 − cos φ)
                return Draw { point: u - versine * u + tangent, tangent, exponent: kappa * versine };
            }
            a = open01(rng);
            b = open01(rng);
        }
    }

    fn reflect(_: DVec2, draw: &Draw<DVec2>) -> Draw<DVec2> {
        Draw { point: draw.point - 2.0 * draw.tangent, tangent: -draw.tangent, ..*draw }
    }

    fn project(u: DVec2, v: DVec2) -> DVec2 {
        v - v.dot(u) * u
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::random::stream;

    #[test]
    fn plane_draws_have_the_kernel_variance_and_their_own_exponent() {
        let (kappa, u) = (7.0, DVec2::new(3.0, -2.0));
        let mut rng = stream(1, &[]);
        let n = 100_000;
        let mut second = 0.0;
        for _ in 0..n {
            let xi = [open01(&mut rng), open01(&mut rng)];
            let d = Plane::draw(u, kappa, xi, &mut rng);
            assert!(
                (d.exponent - 0.5 * kappa * d.tangent.length_squared()).abs() < 1e-13 * (1.0 + d.exponent)
            );
            assert!(d.exponent > 0.0);
            second += d.tangent.length_squared() / f64::from(n);
        }
        assert!((second * kappa / 2.0 - 1.0).abs() < 6.0 / f64::from(n).sqrt());
    }

    #[test]
    fn circle_draws_follow_von_mises() {
        // E[cos φ] = I₁(κ)/I₀(κ) at κ = 1, 2, 10 (Abramowitz and Stegun 9.6), and 1 − 1/(2κ) − …
        // far out.
        let table =
            [(1.0, 0.446_389_965_9), (2.0, 0.697_774_658_0), (10.0, 0.948_599_825_9), (1e12, 1.0 - 5e-13)];
        for (kappa, expected) in table {
            let u = DVec2::from_angle(0.7);
            let mut rng = stream(2, &[]);
            let n = 200_000;
            let (mut versine, mut squares) = (0.0, 0.0);
            for _ in 0..n {
                let xi = [open01(&mut rng), open01(&mut rng)];
                let d = Circle::draw(u, kappa, xi, &mut rng);
                assert!((d.point.length() - 1.0).abs() < 1e-14);
                assert!(d.tangent.dot(u).abs() < 1e-15);
                let v = d.exponent / kappa;
                assert!((v - (1.0 - d.point.dot(u))).abs() < 1e-15 * 4.0);
                versine += v;
                squares += v * v;
            }
            let n = f64::from(n);
            let error = ((squares / n - (versine / n).powi(2)) / n).sqrt();
            assert!((versine / n - (1.0 - expected)).abs() < 5.0 * error + 1e-24, "κ = {kappa}");
        }
    }

    #[test]
    fn reflection_stays_on_the_domain_and_keeps_the_exponent() {
        let mut rng = stream(3, &[]);
        let u = DVec2::from_angle(2.0);
        let d = Circle::draw(u, 3.0, [0.9, 0.1], &mut rng);
        let r = Circle::reflect(u, &d);
        assert!((r.point.length() - 1.0).abs() < 1e-15);
        assert!((r.point.dot(u) - d.point.dot(u)).abs() < 1e-15);
        assert!((r.point + d.point).perp_dot(u).abs() < 1e-15);
    }
}
