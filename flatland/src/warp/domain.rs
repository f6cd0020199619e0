//! Domains of warp fields: sampling of auxiliary points, and tangent spaces.

use std::f64::consts::TAU;
use std::fmt::Debug;
use std::ops::{Add, Mul, Neg, Sub};

use glam::{DVec2, DVec3};
/// Vector operations needed by the warp.
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
            #[inline]
            fn dot(self, other: Self) -> f64 {
                <$type>::dot(self, other)
            }
            #[inline]
            fn is_finite(self) -> bool {
                <$type>::is_finite(self)
            }
        }
    };
}

vector!(DVec2);
vector!(DVec3);

impl Vector for f64 {
    const ZERO: Self = 0.0;
    fn dot(self, other: Self) -> f64 {
        self * other
    }
    fn is_finite(self) -> bool {
        Self::is_finite(self)
    }
}

/// An auxiliary point drawn around u.
#[derive(Clone, Copy, Debug)]
pub struct Draw<V> {
    /// The point u'.
    pub point: V,
    /// Its component tangent at u: u' − u on the line and in the plane, P_u u' on the circle and the sphere.
    /// In all of them ∇_u x = −κ times this.
    pub tangent: V,
    /// x = κ|u−u'|²/2 on the line and in the plane, κ(1 − u·u') on the circle and the sphere: D = eˣ − 1.
    /// Always positive.
    pub exponent: f64,
    /// ln p(u') up to a constant, the same for all draws with the same κ and radial exponent.
    pub log_density: f64,
}

/// A domain of integration: the line, the plane, the circle of directions or the sphere of directions.
///
/// Points and tangents are ambient vectors: of R² for the plane and the circle, of R³ for the sphere.
pub trait Domain {
    /// Points and vectors.
    type Vector: Vector;

    /// Coefficient c of −c u·V in the divergence of a field that is projected to the tangent space: 0 on the
    /// line and in the plane, the dimension n on the unit circle and sphere.
    const CURVATURE: f64;

    /// Draws u' around u, for a kernel e⁻ˣ of concentration κ. `xi` are uniform in (0, 1), and possibly
    /// stratified.
    ///
    /// `radial_exponent` a ∈ [0.1, 1] is the power to which the distribution function of the distance is
    /// raised: at 1 points are distributed as the kernel; below, they are denser near u, with
    /// density ∝ |u−u'|^−n(1−a) there.
    fn draw(u: Self::Vector, kappa: f64, radial_exponent: f64, xi: [f64; 2]) -> Draw<Self::Vector>;

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

    /// Box–Muller: for N(u, I/κ), x = κ|u−u'|²/2 has the distribution function 1 − e⁻ˣ. Its power a is
    /// inverted by 1 − e⁻ˣ = ξ₀^(1/a).
    fn draw(u: DVec2, kappa: f64, radial_exponent: f64, [a, b]: [f64; 2]) -> Draw<DVec2> {
        let within = a.powf(1.0 / radial_exponent);
        let exponent = -(-within).ln_1p();
        let tangent = (2.0 * exponent / kappa).sqrt() * DVec2::from_angle(TAU * b);
        let log_density = (radial_exponent - 1.0) * within.ln() - exponent;
        Draw { point: u + tangent, tangent, exponent, log_density }
    }

    fn reflect(u: DVec2, draw: &Draw<DVec2>) -> Draw<DVec2> {
        Draw { point: u - draw.tangent, tangent: -draw.tangent, ..*draw }
    }

    fn project(_: DVec2, v: DVec2) -> DVec2 {
        v
    }
}

/// The line R, n = 1: the film of a flat world.
#[derive(Clone, Copy, Debug)]
pub struct Line;

impl Domain for Line {
    type Vector = f64;
    const CURVATURE: f64 = 0.0;

    /// With x = κ|u − u'|²/2, the distance has the distribution function (1 − e⁻ˣ)^(a/2): at a = 1 it is
    /// close to the normal distribution, which has no elementary inverse, with the same tails.
    fn draw(u: f64, kappa: f64, radial_exponent: f64, [a, b]: [f64; 2]) -> Draw<f64> {
        // At the smallest radial exponent the power of the smallest ξ underflows.
        let within = a.powf(2.0 / radial_exponent).max(f64::MIN_POSITIVE);
        let exponent = -(-within).ln_1p();
        let tangent = (2.0 * exponent / kappa).sqrt().copysign(b - 0.5);
        let log_density = (0.5 * radial_exponent - 1.0) * within.ln() - exponent + 0.5 * exponent.ln();
        Draw { point: u + tangent, tangent, exponent, log_density }
    }

    fn reflect(u: f64, draw: &Draw<f64>) -> Draw<f64> {
        Draw { point: u - draw.tangent, tangent: -draw.tangent, ..*draw }
    }

    fn project(_: f64, v: f64) -> f64 {
        v
    }
}

/// The unit circle S¹, n = 1, in the ambient plane.
#[derive(Clone, Copy, Debug)]
pub struct Circle;

impl Domain for Circle {
    type Vector = DVec2;
    const CURVATURE: f64 = 1.0;

    /// The [`Line`]'s method with y = 8κ sin²(φ/4) in place of x = κ(1 − cos φ): equivalent near u, and with
    /// a density that does not vanish at the antipode. y ≤ 4κ, hence the distribution function
    /// ((1 − e⁻ʸ)/(1 − e^−4κ))^(a/2). 1 − cos φ is computed instead of cos φ, which at κ = 10¹² would be
    /// rounding noise.
    fn draw(u: DVec2, kappa: f64, radial_exponent: f64, [a, b]: [f64; 2]) -> Draw<DVec2> {
        let within = a.powf(2.0 / radial_exponent).max(f64::MIN_POSITIVE);
        let y = -(within * (-4.0 * kappa).exp_m1()).ln_1p();
        // sin²(φ/4) and sin²(φ/2)
        let quarter = (y / (8.0 * kappa)).min(0.5);
        let half = 4.0 * quarter * (1.0 - quarter);
        let sine = 2.0 * half.sqrt() * (1.0 - 2.0 * quarter);
        let tangent = sine.copysign(b - 0.5) * u.perp();
        let log_density = (0.5 * radial_exponent - 1.0) * within.ln() - y + 0.5 * half.ln();
        // u cos φ = u − u (1 − cos φ)
        let versine = 2.0 * half;
        Draw { point: u - versine * u + tangent, tangent, exponent: kappa * versine, log_density }
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
    use crate::random::{open01, stream};

    /// Σ g(x)/p over draws, divided by the same with g = 1: the mean of g under the kernel e⁻ˣ.
    fn kernel_mean<D: Domain<Vector = DVec2>>(
        kappa: f64,
        radial_exponent: f64,
        g: impl Fn(f64) -> f64,
    ) -> f64 {
        let u = DVec2::from_angle(0.7);
        let mut rng = stream(2, &[]);
        let (mut sum, mut mass) = (0.0, 0.0);
        for _ in 0..400_000 {
            let d = D::draw(u, kappa, radial_exponent, [open01(&mut rng), open01(&mut rng)]);
            assert!(d.exponent > 0.0 && d.log_density.is_finite());
            let w = (-d.exponent - d.log_density).exp();
            sum += w * g(d.exponent);
            mass += w;
        }
        sum / mass
    }

    #[test]
    fn draws_weighted_by_their_density_are_the_kernel() {
        for radial_exponent in [1.0, 0.5, 0.25] {
            // Plane: x is exponential of mean 1.
            assert!(
                (kernel_mean::<Plane>(7.0, radial_exponent, |x| x) - 1.0).abs() < 0.02,
                "{radial_exponent}"
            );
            // Circle: E[cos φ] = I₁(κ)/I₀(κ) (Abramowitz and Stegun 9.6); far out, x is a gamma variable of
            // mean 1/2.
            for (kappa, cosine) in [(1.0, 0.446_389_965_9), (2.0, 0.697_774_658_0), (10.0, 0.948_599_825_9)] {
                let mean = kernel_mean::<Circle>(kappa, radial_exponent, |x| 1.0 - x / kappa);
                assert!((mean - cosine).abs() < 0.01, "{radial_exponent} {kappa} {mean}");
            }
            assert!(
                (kernel_mean::<Circle>(1e12, radial_exponent, |x| x) - 0.5).abs() < 0.01,
                "{radial_exponent}"
            );
        }
    }

    #[test]
    fn draws_on_the_line_weighted_by_their_density_are_normal() {
        for radial_exponent in [1.0, 0.5, 0.25] {
            let mut rng = stream(3, &[]);
            let (mut sum, mut mass) = (0.0, 0.0);
            for _ in 0..400_000 {
                let d = Line::draw(0.7, 9.0, radial_exponent, [open01(&mut rng), open01(&mut rng)]);
                assert!((d.exponent - 4.5 * d.tangent * d.tangent).abs() <= 1e-14 * d.exponent);
                let w = (-d.exponent - d.log_density).exp();
                sum += w * (d.point - 0.7).powi(2);
                mass += w;
            }
            assert!((sum / mass - 1.0 / 9.0).abs() < 2e-3, "{radial_exponent} {}", sum / mass);
        }
    }

    #[test]
    fn points_lie_where_they_say() {
        let u = DVec2::from_angle(0.7);
        for a in [1e-16, 0.1, 0.5, 0.9, 1.0 - 1e-16] {
            for b in [0.1, 0.9] {
                for kappa in [1e-3, 1.0, 100.0] {
                    let d = Circle::draw(u, kappa, 0.5, [a, b]);
                    assert!((d.point.length() - 1.0).abs() < 1e-14);
                    assert!(d.tangent.dot(u).abs() < 1e-15);
                    assert!((d.exponent - kappa * (1.0 - d.point.dot(u))).abs() < 1e-15 * kappa * 4.0);
                    let r = Circle::reflect(u, &d);
                    assert!((r.point.length() - 1.0).abs() < 1e-14);
                    assert!((r.point + d.point).perp_dot(u).abs() < 1e-15);
                    let d = Plane::draw(u, kappa, 0.5, [a, b]);
                    let x = 0.5 * kappa * d.tangent.length_squared();
                    assert!((d.exponent - x).abs() < 1e-13 * x);
                    assert_eq!(Plane::reflect(u, &d).point, u - d.tangent);
                }
            }
        }
    }
}
