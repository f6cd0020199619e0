//! A sum with its derivative, and the rounding and quadrature errors of both.

use std::ops::{AddAssign, Mul};

use num_dual::Dual64;

/// A number summed from terms.
#[derive(Clone, Copy, Debug)]
pub(super) struct Term {
    /// The sum.
    pub(super) value: Dual64,
    /// The sum of the absolute derivatives of all terms.
    pub(super) absolute: f64,
    /// The estimated error of quadrature of the derivative.
    pub(super) error: f64,
}

impl Term {
    /// One term.
    pub(super) fn new(value: Dual64) -> Self {
        Self { value, absolute: value.eps.abs(), error: 0.0 }
    }

    /// One term whose derivative is a difference of others with a known absolute sum.
    pub(super) fn with_absolute(value: Dual64, absolute: f64) -> Self {
        Self { value, absolute: absolute.max(value.eps.abs()), error: 0.0 }
    }
}

impl Default for Term {
    fn default() -> Self {
        Self::new(0.0.into())
    }
}

impl AddAssign for Term {
    fn add_assign(&mut self, other: Self) {
        self.value += other.value;
        self.absolute += other.absolute;
        self.error += other.error;
    }
}

impl Mul<Dual64> for Term {
    type Output = Self;
    fn mul(self, factor: Dual64) -> Self {
        Self {
            value: self.value * factor,
            absolute: self.absolute * factor.re.abs() + (self.value.re * factor.eps).abs(),
            error: self.error * factor.re.abs(),
        }
    }
}
