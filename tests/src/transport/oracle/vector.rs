//! Vectors of dual numbers.

use std::ops::{Add, Mul, Neg, Sub};

use glam::DVec2;
use num_dual::{Dual64, DualNum};

/// A point or a direction, with its velocity.
#[derive(Clone, Copy, Debug)]
pub(super) struct Vector {
    pub(super) x: Dual64,
    pub(super) y: Dual64,
}

impl Vector {
    pub(super) fn moving(place: DVec2, velocity: DVec2) -> Self {
        Self { x: Dual64::new(place.x, velocity.x), y: Dual64::new(place.y, velocity.y) }
    }

    pub(super) fn value(self) -> DVec2 {
        DVec2::new(self.x.re, self.y.re)
    }

    pub(super) fn dot(self, other: Self) -> Dual64 {
        self.x * other.x + self.y * other.y
    }

    /// The signed area that `self` and `other` span.
    pub(super) fn cross(self, other: Self) -> Dual64 {
        self.x * other.y - self.y * other.x
    }

    /// The angle from +x towards +y. (That of `num_dual` has no derivative where x is 0.)
    pub(super) fn angle(self) -> Dual64 {
        let squared = self.x.re * self.x.re + self.y.re * self.y.re;
        let rate = (self.x.re * self.y.eps - self.y.re * self.x.eps) / squared;
        Dual64::new(self.y.re.atan2(self.x.re), rate)
    }

    /// Turned from +x towards +y by a right angle.
    pub(super) fn turned(self) -> Self {
        Self { x: -self.y, y: self.x }
    }

    pub(super) fn length(self) -> Dual64 {
        // Scaled, so that lengths of 10⁻²⁰⁰ do not vanish.
        let scale = self.x.re.abs().max(self.y.re.abs());
        if scale == 0.0 {
            return self.dot(self).sqrt();
        }
        let unit = self * Dual64::from(1.0 / scale);
        unit.dot(unit).sqrt() * scale
    }

    pub(super) fn unit(self) -> Self {
        self * self.length().recip()
    }
}

impl Add for Vector {
    type Output = Self;
    fn add(self, other: Self) -> Self {
        Self { x: self.x + other.x, y: self.y + other.y }
    }
}

impl Sub for Vector {
    type Output = Self;
    fn sub(self, other: Self) -> Self {
        Self { x: self.x - other.x, y: self.y - other.y }
    }
}

impl Neg for Vector {
    type Output = Self;
    fn neg(self) -> Self {
        Self { x: -self.x, y: -self.y }
    }
}

impl Mul<Dual64> for Vector {
    type Output = Self;
    fn mul(self, factor: Dual64) -> Self {
        Self { x: self.x * factor, y: self.y * factor }
    }
}
