//! Vectors of space that know how fast they change.

use std::ops::{Add, Mul, Sub};

use glam::DVec3;
use num_dual::{Dual64, DualNum};

/// A vector as a function of θ, to first order.
#[derive(Clone, Copy, Debug)]
pub(super) struct Vector([Dual64; 3]);

impl Vector {
    /// value + θ rate.
    pub(super) fn new(value: DVec3, rate: DVec3) -> Self {
        Self(std::array::from_fn(|k| Dual64::new(value[k], rate[k])))
    }

    /// The same for all θ.
    pub(super) fn still(value: DVec3) -> Self {
        Self::new(value, DVec3::ZERO)
    }

    /// At θ = 0.
    pub(super) fn value(self) -> DVec3 {
        DVec3::from(self.0.map(|x| x.re))
    }

    /// The derivative with respect to θ.
    pub(super) fn rate(self) -> DVec3 {
        DVec3::from(self.0.map(|x| x.eps))
    }

    pub(super) fn dot(self, other: Self) -> Dual64 {
        self.0[0] * other.0[0] + self.0[1] * other.0[1] + self.0[2] * other.0[2]
    }

    pub(super) fn cross(self, other: Self) -> Self {
        let ([a, b, c], [x, y, z]) = (self.0, other.0);
        Self([b * z - c * y, c * x - a * z, a * y - b * x])
    }

    pub(super) fn unit(self) -> Self {
        self * self.dot(self).sqrt().recip()
    }

    /// self + t (other − self).
    pub(super) fn lerp(self, other: Self, t: Dual64) -> Self {
        self + (other - self) * t
    }
}

impl Add for Vector {
    type Output = Self;
    fn add(self, other: Self) -> Self {
        Self(std::array::from_fn(|k| self.0[k] + other.0[k]))
    }
}

impl Sub for Vector {
    type Output = Self;
    fn sub(self, other: Self) -> Self {
        Self(std::array::from_fn(|k| self.0[k] - other.0[k]))
    }
}

impl Mul<Dual64> for Vector {
    type Output = Self;
    fn mul(self, factor: Dual64) -> Self {
        Self(self.0.map(|x| x * factor))
    }
}
