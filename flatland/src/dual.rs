//! A value and its derivative with respect to θ, for the reparameterised form.

use std::ops::{Add, Mul, Sub};

use glam::DVec2;

/// value + ε slope, with ε² = 0.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Dual {
    pub(crate) value: f64,
    pub(crate) slope: f64,
}

impl Dual {
    /// The point u moving with velocity v.
    pub(crate) fn path(u: DVec2, v: DVec2) -> [Self; 2] {
        [Self { value: u.x, slope: v.x }, Self { value: u.y, slope: v.y }]
    }

    pub(crate) fn constant(value: f64) -> Self {
        Self { value, slope: 0.0 }
    }

    pub(crate) fn exp(self) -> Self {
        let e = self.value.exp();
        Self { value: e, slope: e * self.slope }
    }

    pub(crate) fn abs(self) -> Self {
        if self.value < 0.0 { self * -1.0 } else { self }
    }
}

impl Add for Dual {
    type Output = Self;
    fn add(self, other: Self) -> Self {
        Self { value: self.value + other.value, slope: self.slope + other.slope }
    }
}

impl Sub for Dual {
    type Output = Self;
    fn sub(self, other: Self) -> Self {
        self + other * -1.0
    }
}

impl Mul for Dual {
    type Output = Self;
    fn mul(self, other: Self) -> Self {
        let slope = self.slope * other.value + self.value * other.slope;
        Self { value: self.value * other.value, slope }
    }
}

impl Mul<f64> for Dual {
    type Output = Self;
    fn mul(self, factor: f64) -> Self {
        Self { value: self.value * factor, slope: self.slope * factor }
    }
}
