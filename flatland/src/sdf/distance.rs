//! Interface of implicit shapes to the tracer and the fields.

use std::ops::{Add, Mul};

use super::space::Space;
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

/// A value, its gradient and its second derivatives.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct SecondOrder<V: Space> {
    /// φ and ∇φ.
    pub jet: Jet<V>,
    /// ∇²φ, which is symmetric.
    pub hessian: V::Matrix,
}

impl<V: Space> SecondOrder<V> {
    /// (∇φ·v, ∇²φ v): rates of φ and ∇φ at a point that moves with velocity v. For an eye with velocity ȯ,
    /// they are added to the shape's φ̇ and ∇φ̇. This omits from the velocity of a level set only the
    /// component of −ȯ along it, which moves no silhouette.
    #[must_use]
    pub fn advected(&self, velocity: V) -> Jet<V> {
        Jet { value: self.jet.gradient.dot(velocity), gradient: self.hessian * velocity }
    }

    /// Transpose of [`advected`](Self::advected): the covector of v.
    #[must_use]
    pub fn advected_transpose(&self, covector: Jet<V>) -> V {
        self.jet.gradient * covector.value + self.hessian * covector.gradient
    }
}

/// An implicit shape φ(x; θ) = 0 with φ > 0 outside and parameters θ ∈ Rᵖ. Spheres of radius φ divided by the
/// [bound](Self::slope_bound) on |∇φ|, 1 for distances, are empty.
///
/// [`rate`](Self::rate) and [`add_parameter_gradient`](Self::add_parameter_gradient) are a linear map and its
/// transpose: forward and reverse mode agree to rounding.
///
/// Near the surface |∇φ| ≥ √½ is assumed.
///
/// φ need not be differentiable everywhere: exceptions are its medial axis, the corners of polygons, and the
/// cell edges of a bilinear grid. There every implementation returns the derivatives of one of the adjacent
/// smooth pieces, and a gradient of 0 at an isolated point (the centre of a circle, a vertex).
pub trait Sdf<V: Space>: Sync {
    /// φ(x) and ∇φ(x).
    fn jet(&self, x: V) -> Jet<V>;

    /// φ(x) alone, if that is cheaper.
    fn value(&self, x: V) -> f64 {
        self.jet(x).value
    }

    /// φ(x), ∇φ(x) and ∇²φ(x) in one evaluation.
    fn second_order(&self, x: V) -> SecondOrder<V>;

    /// A bound on |∇φ| where rays are traced, which is where φ > 0.
    fn slope_bound(&self) -> f64 {
        1.0
    }

    /// A bound on |∇φ| that includes the inside, where rays are traced around the
    /// [complement](super::shapes::Complement) of the shape. Equal for shapes whose bound does not depend on
    /// the side.
    fn slope_bound_everywhere(&self) -> f64 {
        self.slope_bound()
    }

    /// M ≥ 0 with s·∇²φ s ≥ −M for all unit directions s, where rays are traced within the
    /// [bounds](Self::bounds), and where ∇φ is continuous or φ has only convex kinks. Then φ falls along a
    /// ray by at most −∇φ·ω t + M t²/2, so that steps may be longer than φ divided by the bound on |∇φ|
    /// (Kalra and Barr 1989). 0 if φ is convex, as outside balls and boxes: rays then take the steps of
    /// Newton's method. ∞ if none is known.
    fn second_derivative_bound(&self) -> f64 {
        f64::INFINITY
    }

    /// Corners of an axis-aligned box outside which φ > 0 everywhere: it contains the surface and the inside.
    /// `None` if none is known, or the inside is unbounded.
    fn bounds(&self) -> Option<(V, V)> {
        self.level_bounds(0.0)
    }

    /// Corners of a box outside which φ > `level` everywhere, for a level of at least 0. `None` if none is
    /// known. Blended shapes need it of their parts: unless φ is a distance, the distance between φ = level
    /// and φ = 0 is not determined by the latter.
    fn level_bounds(&self, level: f64) -> Option<(V, V)> {
        let _ = level;
        None
    }

    /// [`level_bounds`](Self::level_bounds) of −φ, for [complements](super::shapes::Complement): outside the
    /// box φ < −`level`. `None` for all bounded shapes.
    fn complement_level_bounds(&self, level: f64) -> Option<(V, V)> {
        let _ = level;
        None
    }

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

    /// [`add_parameter_gradient`](Self::add_parameter_gradient) for many points with their covectors, in this
    /// order if the order matters; for shapes that are faster in batches.
    ///
    /// # Panics
    /// As [`add_parameter_gradient`](Self::add_parameter_gradient).
    fn add_parameter_gradients(&self, taps: &[(V, Jet<V>)], gradient: &mut [f64]) {
        taps.iter().for_each(|&(x, covector)| self.add_parameter_gradient(x, covector, gradient));
    }
}

/// Value of |∇φ|² below which the velocity of a level set is modified to stay bounded: on surfaces |∇φ| must
/// be at least √½.
const BOUNDED: f64 = 0.5;

/// e = −ρ ∇φ and its derivative, with ρ = 1/|∇φ|² where |∇φ|² ≥ ½ and 4(1 − |∇φ|²), its smooth continuation,
/// elsewhere.
///
/// e times ∂_θφ is the velocity of the level set through x, near the surface. Away from it any continuous
/// function is admissible, but 1/|∇φ|² is not: between any two shapes a differentiable φ has a saddle, where
/// it is infinite.
#[derive(Clone, Copy)]
pub struct LevelSetVelocity<V> {
    e: V,
    gradient: V,
    rho: f64,
    rho_slope: f64,
}

impl<V: Space> LevelSetVelocity<V> {
    /// From ∇φ of a shape.
    #[must_use]
    pub fn new(gradient: V) -> Self {
        let square = gradient.dot(gradient);
        let (rho, rho_slope) = if square >= BOUNDED {
            (square.recip(), -(square * square).recip())
        } else {
            let rho = 1.0 / BOUNDED;
            (rho - (square - BOUNDED) * rho * rho, -rho * rho)
        };
        Self { e: gradient * -rho, gradient, rho, rho_slope }
    }

    /// e.
    #[must_use]
    pub fn e(&self) -> V {
        self.e
    }

    /// De v = −ρ Hv − 2ρ′ ∇φ (∇φ·Hv), with H = ∇²φ.
    #[must_use]
    pub fn derivative(&self, hessian: V::Matrix, v: V) -> V {
        let turn = hessian * v;
        turn * -self.rho - self.gradient * (2.0 * self.rho_slope * self.gradient.dot(turn))
    }

    /// tr De.
    #[must_use]
    pub fn trace(&self, hessian: V::Matrix) -> f64 {
        let turn = hessian * self.gradient;
        -self.rho * V::trace(hessian) - 2.0 * self.rho_slope * self.gradient.dot(turn)
    }
}
