//! What the tracer and the fields ask of an implicit shape.

use std::ops::{Add, Mul};

use crate::warp::Vector;

/// A value and its gradient; also a covector on such pairs.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Jet<V> {
    /// The value.
    pub value: f64,
    /// Its gradient in space.
    pub gradient: V,
}

impl<V: Vector> Jet<V> {
    /// Zero everywhere.
    pub const ZERO: Self = Self { value: 0.0, gradient: V::ZERO };

    /// The product of a covector and a jet.
    #[must_use]
    pub fn dot(self, other: Self) -> f64 {
        self.value * other.value + self.gradient.dot(other.gradient)
    }
}

impl<V: Vector> Add for Jet<V> {
    type Output = Self;
    fn add(self, other: Self) -> Self {
        Self { value: self.value + other.value, gradient: self.gradient + other.gradient }
    }
}

impl<V: Vector> Mul<f64> for Jet<V> {
    type Output = Self;
    fn mul(self, factor: f64) -> Self {
        Self { value: self.value * factor, gradient: self.gradient * factor }
    }
}

/// An implicit shape φ(x; θ) = 0 with φ > 0 outside, |∇φ| ≤ 1 (so that spheres of radius φ are
/// empty) and parameters θ ∈ Rᵖ.
///
/// [`rate`](Self::rate) and [`add_parameter_gradient`](Self::add_parameter_gradient) are one linear
/// map and its transpose: forward and reverse mode agree to rounding.
///
/// Near the surface |∇φ| ≥ √½ is assumed.
///
/// Where φ is not differentiable (its medial axis, the corners of polygons, the cell edges of a
/// bilinear grid) every implementation returns the derivatives of one of the smooth pieces that meet
/// there, and a gradient of 0 at an isolated point (the centre of a circle, a vertex).
pub trait Sdf<V: Vector>: Sync {
    /// φ(x) and ∇φ(x).
    fn jet(&self, x: V) -> Jet<V>;

    /// ∇²φ(x) v.
    fn hessian_times(&self, x: V, v: V) -> V;

    /// Δφ(x), the trace of ∇²φ.
    fn laplacian(&self, x: V) -> f64;

    /// p, the number of parameters.
    fn parameter_count(&self) -> usize;

    /// ∂_θφ(x) and ∇∂_θφ(x) along a direction in parameter space.
    ///
    /// # Panics
    /// May panic if `direction` has fewer than [`parameter_count`](Self::parameter_count) entries.
    fn rate(&self, x: V, direction: &[f64]) -> Jet<V>;

    /// Adds c ∂φ(x)/∂θ_j + q·∇∂φ(x)/∂θ_j to entry j, for the covector (c, q).
    ///
    /// # Panics
    /// May panic if `gradient` has fewer than [`parameter_count`](Self::parameter_count) entries.
    fn add_parameter_gradient(&self, x: V, covector: Jet<V>, gradient: &mut [f64]);
}

/// |∇φ|² below which the velocity of a level set is bounded: on surfaces |∇φ| must not be less than √½.
const BOUNDED: f64 = 0.5;

/// e = −ρ ∇φ and its derivative, with ρ = 1/|∇φ|² where |∇φ|² ≥ ½ and 4(1 − |∇φ|²), which continues it
/// smoothly, where it is less.
///
/// Times ∂_θφ, e is the velocity of the level set through x, wherever the surface is. Away from it any
/// continuous function would do, and 1/|∇φ|² will not: between every two shapes a differentiable φ has
/// a saddle, where it is infinite.
#[derive(Clone, Copy)]
pub(super) struct LevelSetVelocity<V> {
    pub(super) e: V,
    gradient: V,
    rho: f64,
    rho_slope: f64,
}

impl<V: Vector> LevelSetVelocity<V> {
    pub(super) fn new(gradient: V) -> Self {
        let square = gradient.dot(gradient);
        let (rho, rho_slope) = if square >= BOUNDED {
            (square.recip(), -(square * square).recip())
        } else {
            let rho = 1.0 / BOUNDED;
            (rho - (square - BOUNDED) * rho * rho, -rho * rho)
        };
        Self { e: gradient * -rho, gradient, rho, rho_slope }
    }

    /// De v = −ρ Hv − 2ρ′ ∇φ (∇φ·Hv), from Hv.
    pub(super) fn derivative(&self, hessian_v: V) -> V {
        hessian_v * -self.rho - self.gradient * (2.0 * self.rho_slope * self.gradient.dot(hessian_v))
    }

    /// tr De, from Δφ and H∇φ.
    pub(super) fn trace(&self, laplacian: f64, hessian_gradient: V) -> f64 {
        -self.rho * laplacian - 2.0 * self.rho_slope * self.gradient.dot(hessian_gradient)
    }
}
