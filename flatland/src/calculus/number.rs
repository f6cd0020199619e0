//! Real numbers that may carry derivatives.

use std::fmt::Debug;
use std::ops::{Add, Div, Mul, Neg, Sub};

use glam::DVec2;

/// A real number, with or without derivatives. Code over `Number` computes the primal, its derivative along a
/// direction, or a record for the reverse sweep.
///
/// The values of all three are computed by the same operations in the same order, and have the same bits.
pub trait Number:
    Copy
    + Debug
    + Add<Output = Self>
    + Sub<Output = Self>
    + Mul<Output = Self>
    + Div<Output = Self>
    + Neg<Output = Self>
    + Mul<f64, Output = Self>
{
    /// A number without derivatives.
    fn constant(value: f64) -> Self;

    /// The number itself.
    fn value(self) -> f64;

    /// f(self), given its value and f′ there.
    fn chain(self, value: f64, derivative: f64) -> Self;

    /// Whether its derivatives are identically 0.
    fn is_still(self) -> bool;

    /// √x; its derivative at 0 is taken as 0.
    #[inline]
    fn sqrt(self) -> Self {
        let root = self.value().sqrt();
        self.chain(root, if root > 0.0 { 0.5 / root } else { 0.0 })
    }

    /// eˣ.
    #[inline]
    fn exp(self) -> Self {
        let value = self.value().exp();
        self.chain(value, value)
    }

    /// sin x.
    #[inline]
    fn sin(self) -> Self {
        let (sin, cos) = self.value().sin_cos();
        self.chain(sin, cos)
    }

    /// cos x.
    #[inline]
    fn cos(self) -> Self {
        let (sin, cos) = self.value().sin_cos();
        self.chain(cos, -sin)
    }

    /// sinh x.
    #[inline]
    fn sinh(self) -> Self {
        self.chain(self.value().sinh(), self.value().cosh())
    }

    /// |x|.
    #[inline]
    fn abs(self) -> Self {
        if self.value() < 0.0 { -self } else { self }
    }

    /// max(0, x).
    #[inline]
    fn positive(self) -> Self {
        if self.value() > 0.0 { self } else { Self::constant(0.0) }
    }

    /// x².
    #[inline]
    fn squared(self) -> Self {
        self * self
    }
}

impl Number for f64 {
    #[inline]
    fn constant(value: f64) -> Self {
        value
    }

    #[inline]
    fn value(self) -> f64 {
        self
    }

    #[inline]
    fn chain(self, value: f64, _: f64) -> Self {
        value
    }

    #[inline]
    fn is_still(self) -> bool {
        true
    }
}

/// Operators of a number type with a `binary(self, other, value, partials)`: each with its value and its
/// derivatives by both operands.
macro_rules! operators {
    ([$($parameters:tt)*] $number:ty) => {
        impl<$($parameters)*> Add for $number {
            type Output = Self;

            #[inline]
            fn add(self, other: Self) -> Self {
                self.binary(other, self.value + other.value, [1.0, 1.0])
            }
        }

        impl<$($parameters)*> Sub for $number {
            type Output = Self;

            #[inline]
            fn sub(self, other: Self) -> Self {
                self.binary(other, self.value - other.value, [1.0, -1.0])
            }
        }

        impl<$($parameters)*> Mul for $number {
            type Output = Self;

            #[inline]
            fn mul(self, other: Self) -> Self {
                self.binary(other, self.value * other.value, [other.value, self.value])
            }
        }

        impl<$($parameters)*> Div for $number {
            type Output = Self;

            #[inline]
            fn div(self, other: Self) -> Self {
                let quotient = self.value / other.value;
                let inverse = 1.0 / other.value;
                self.binary(other, quotient, [inverse, -quotient * inverse])
            }
        }

        impl<$($parameters)*> Neg for $number {
            type Output = Self;

            #[inline]
            fn neg(self) -> Self {
                self.chain(-self.value, -1.0)
            }
        }

        impl<$($parameters)*> Mul<f64> for $number {
            type Output = Self;

            #[inline]
            fn mul(self, factor: f64) -> Self {
                self.chain(self.value * factor, factor)
            }
        }
    };
}

pub(super) use operators;

/// A number with its derivatives along N directions at once.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Dual<const N: usize> {
    /// The number.
    pub value: f64,
    /// Its derivative along each direction.
    pub tangent: [f64; N],
}

impl Dual<1> {
    /// The coordinates of a point u that moves with velocity v.
    pub(crate) fn path(u: DVec2, v: DVec2) -> [Self; 2] {
        [Self::new(u.x, [v.x]), Self::new(u.y, [v.y])]
    }

    /// The derivative along the only direction.
    #[inline]
    #[must_use]
    pub fn slope(self) -> f64 {
        self.tangent[0]
    }
}

impl<const N: usize> Dual<N> {
    /// A number with its derivatives.
    #[inline]
    #[must_use]
    pub fn new(value: f64, tangent: [f64; N]) -> Self {
        Self { value, tangent }
    }

    #[inline]
    fn binary(self, other: Self, value: f64, [a, b]: [f64; 2]) -> Self {
        Self::new(value, std::array::from_fn(|i| a * self.tangent[i] + b * other.tangent[i]))
    }
}

impl<const N: usize> Number for Dual<N> {
    #[inline]
    fn constant(value: f64) -> Self {
        Self::new(value, [0.0; N])
    }

    #[inline]
    fn value(self) -> f64 {
        self.value
    }

    #[inline]
    fn chain(self, value: f64, derivative: f64) -> Self {
        Self::new(value, self.tangent.map(|t| derivative * t))
    }

    #[inline]
    fn is_still(self) -> bool {
        self.tangent == [0.0; N]
    }
}

operators!([const N: usize] Dual<N>);

#[cfg(test)]
mod tests {
    use super::*;
    use crate::calculus::Vec2;

    fn expression<T: Number>(x: T, y: T) -> T {
        let angle = Vec2::new(x, y).angle_to(Vec2::new(y, x * y));
        ((x * y + x.exp()) / (y - x * 0.3).sqrt() - -y).squared().positive() + x.sin() * y.cos()
            - x.sinh() * angle
    }

    #[test]
    fn derivatives_are_those_of_central_differences() {
        let (x, y, h) = (0.4, 1.7, 1e-6);
        let dual = expression(Dual::new(x, [1.0, 0.0]), Dual::new(y, [0.0, 1.0]));
        assert_eq!(dual.value, expression(x, y), "the value is the primal's, bit for bit");
        let dx = (expression(x + h, y) - expression(x - h, y)) / (2.0 * h);
        let dy = (expression(x, y + h) - expression(x, y - h)) / (2.0 * h);
        assert!((dual.tangent[0] - dx).abs() < 1e-8 && (dual.tangent[1] - dy).abs() < 1e-8);
    }
}
