//! Double-double arithmetic: numbers of about 106 bits as unevaluated sums of two doubles (Dekker 1971).
//!
//! Edges 10⁻¹³ apart meet at places that depend on the fourteenth digit of every coordinate. The oracle
//! decides in this arithmetic which edge is lower and where two cross, so that its own rounding never does.

use std::ops::{Add, Mul, Neg, Sub};

/// high + low, with high the double nearest to the sum. Comparison is by value.
#[derive(Clone, Copy, Debug, Default, PartialEq, PartialOrd)]
pub(crate) struct DoubleDouble {
    high: f64,
    low: f64,
}

impl DoubleDouble {
    /// The product of two doubles, exactly (Dekker's product with Veltkamp's splitting), for
    /// factors below 2⁹⁹⁶ whose product is no denormal.
    pub(crate) fn product(a: f64, b: f64) -> Self {
        let split = |x: f64| {
            let c = 134_217_729.0 * x; // 2²⁷ + 1
            let high = c - (c - x);
            (high, x - high)
        };
        let high = a * b;
        let ((a1, a0), (b1, b0)) = (split(a), split(b));
        Self { high, low: ((a1 * b1 - high) + a1 * b0 + a0 * b1) + a0 * b0 }
    }

    /// The nearest double.
    pub(crate) fn value(self) -> f64 {
        self.high
    }

    /// self/divisor, to about 100 bits.
    pub(crate) fn over(self, divisor: Self) -> Self {
        let first = self.high / divisor.high;
        let rest = self - divisor * Self::from(first);
        let second = rest.high / divisor.high;
        let third = (rest - divisor * Self::from(second)).high / divisor.high;
        Self::from(first) + Self::from(second) + Self::from(third)
    }

    /// The sum of two doubles, exactly (Knuth).
    fn sum(a: f64, b: f64) -> Self {
        let high = a + b;
        let rounded = high - a;
        Self { high, low: (a - (high - rounded)) + (b - rounded) }
    }
}

impl From<f64> for DoubleDouble {
    fn from(high: f64) -> Self {
        Self { high, low: 0.0 }
    }
}

impl Add for DoubleDouble {
    type Output = Self;
    fn add(self, other: Self) -> Self {
        let (high, low) = (Self::sum(self.high, other.high), Self::sum(self.low, other.low));
        let middle = Self::sum(high.high, high.low + low.high);
        Self::sum(middle.high, middle.low + low.low)
    }
}

impl Neg for DoubleDouble {
    type Output = Self;
    fn neg(self) -> Self {
        Self { high: -self.high, low: -self.low }
    }
}

impl Sub for DoubleDouble {
    type Output = Self;
    fn sub(self, other: Self) -> Self {
        self + -other
    }
}

impl Mul for DoubleDouble {
    type Output = Self;
    fn mul(self, other: Self) -> Self {
        let product = Self::product(self.high, other.high);
        Self::sum(product.high, product.low + (self.high * other.low + self.low * other.high))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn sums_and_products_keep_what_doubles_lose() {
        let tiny = DoubleDouble::from(1e-25);
        let one = DoubleDouble::from(1.0);
        assert!(((one + tiny) - one - tiny).value().abs() < 1e-40);
        assert!(one + tiny > one && one - tiny < one);
        // (1 + 2⁻³⁰)² − 1 − 2⁻²⁹ = 2⁻⁶⁰.
        let x = 1.0 + 2.0_f64.powi(-30);
        let square = DoubleDouble::product(x, x);
        assert_eq!((square - one - DoubleDouble::from(2.0_f64.powi(-29))).value(), 2.0_f64.powi(-60));
    }

    #[test]
    fn quotients_times_divisors_give_the_dividend() {
        let dividend = DoubleDouble::from(0.1) + DoubleDouble::from(1e-20);
        let divisor = DoubleDouble::from(-7.3) + DoubleDouble::from(3e-19);
        let back = dividend.over(divisor) * divisor;
        assert!((back - dividend).value().abs() < 1e-31, "{:e}", (back - dividend).value());
    }
}
