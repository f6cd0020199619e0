//! Vectors of dual numbers, component by component.

use std::ops::{Add, Mul, Neg, Sub};

use glam::{DVec2, DVec3};
use num_dual::{Dual64, DualNum};

/// A vector as a function of θ, to first order.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Vector<const N: usize>(pub(crate) [Dual64; N]);

/// A plane vector.
pub(crate) type Vector2 = Vector<2>;
/// A vector in space.
pub(crate) type Vector3 = Vector<3>;

impl<const N: usize> Vector<N> {
    /// value + θ rate.
    pub(crate) fn new(value: impl Into<[f64; N]>, rate: impl Into<[f64; N]>) -> Self {
        let (value, rate) = (value.into(), rate.into());
        Self(std::array::from_fn(|k| Dual64::new(value[k], rate[k])))
    }

    /// A vector that does not depend on θ.
    pub(crate) fn still(value: impl Into<[f64; N]>) -> Self {
        Self::new(value, [0.0; N])
    }

    pub(crate) fn dot(self, other: Self) -> Dual64 {
        let product = |k: usize| self.0[k] * other.0[k];
        (1..N).fold(product(0), |sum, k| sum + product(k))
    }

    pub(crate) fn length(self) -> Dual64 {
        // Scaling keeps lengths of 10⁻²⁰⁰ from underflowing.
        let scale = self.0.iter().map(|x| x.re.abs()).fold(0.0, f64::max);
        if scale == 0.0 {
            return self.dot(self).sqrt();
        }
        let unit = self * Dual64::from(1.0 / scale);
        unit.dot(unit).sqrt() * scale
    }

    pub(crate) fn unit(self) -> Self {
        self * self.length().recip()
    }

    /// self + t (other − self).
    pub(crate) fn lerp(self, other: Self, t: Dual64) -> Self {
        self + (other - self) * t
    }
}

impl Vector2 {
    /// The value at θ = 0.
    pub(crate) fn value(self) -> DVec2 {
        self.0.map(|x| x.re).into()
    }

    /// The derivative with respect to θ.
    pub(crate) fn rate(self) -> DVec2 {
        self.0.map(|x| x.eps).into()
    }

    /// The signed area that `self` and `other` span.
    pub(crate) fn cross(self, other: Self) -> Dual64 {
        self.0[0] * other.0[1] - self.0[1] * other.0[0]
    }

    /// The vector turned by a right angle from +x towards +y.
    pub(crate) fn turned(self) -> Self {
        Self([-self.0[1], self.0[0]])
    }

    /// The angle from +x towards +y. (The function of `num_dual` has no derivative where x is 0.)
    pub(crate) fn angle(self) -> Dual64 {
        let (value, rate) = (self.value(), self.rate());
        Dual64::new(value.to_angle(), value.perp_dot(rate) / value.length_squared())
    }
}

impl Vector3 {
    /// The value at θ = 0.
    pub(crate) fn value(self) -> DVec3 {
        self.0.map(|x| x.re).into()
    }

    /// The derivative with respect to θ.
    pub(crate) fn rate(self) -> DVec3 {
        self.0.map(|x| x.eps).into()
    }

    pub(crate) fn cross(self, other: Self) -> Self {
        let ([a, b, c], [x, y, z]) = (self.0, other.0);
        Self([b * z - c * y, c * x - a * z, a * y - b * x])
    }
}

impl<const N: usize> Add for Vector<N> {
    type Output = Self;
    fn add(self, other: Self) -> Self {
        Self(std::array::from_fn(|k| self.0[k] + other.0[k]))
    }
}

impl<const N: usize> Sub for Vector<N> {
    type Output = Self;
    fn sub(self, other: Self) -> Self {
        Self(std::array::from_fn(|k| self.0[k] - other.0[k]))
    }
}

impl<const N: usize> Neg for Vector<N> {
    type Output = Self;
    fn neg(self) -> Self {
        Self(self.0.map(|x| -x))
    }
}

impl<const N: usize> Mul<Dual64> for Vector<N> {
    type Output = Self;
    fn mul(self, factor: Dual64) -> Self {
        Self(self.0.map(|x| x * factor))
    }
}
