//! Vectors of numbers that may carry derivatives. glam's are of floats only, on purpose.

use std::ops::{Add, Mul, Neg, Sub};

use glam::DVec3;

use super::Number;

/// A vector in space.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Vec3<T> {
    pub(crate) x: T,
    pub(crate) y: T,
    pub(crate) z: T,
}

impl<T: Number> Vec3<T> {
    pub(crate) fn new(x: T, y: T, z: T) -> Self {
        Self { x, y, z }
    }

    pub(crate) fn constant(v: DVec3) -> Self {
        Self::new(T::constant(v.x), T::constant(v.y), T::constant(v.z))
    }

    pub(crate) fn value(self) -> DVec3 {
        DVec3::new(self.x.value(), self.y.value(), self.z.value())
    }

    pub(crate) fn dot(self, other: Self) -> T {
        self.x * other.x + self.y * other.y + self.z * other.z
    }

    pub(crate) fn cross(self, other: Self) -> Self {
        Self::new(
            self.y * other.z - self.z * other.y,
            self.z * other.x - self.x * other.z,
            self.x * other.y - self.y * other.x,
        )
    }

    /// A constant vector after a turn ω: v + ω × v.
    pub(crate) fn turned(v: DVec3, turn: Option<Self>) -> Self {
        let v = Self::constant(v);
        turn.map_or(v, |turn| v + turn.cross(v))
    }

    pub(crate) fn normalized(self) -> Self {
        self * (T::constant(1.0) / self.dot(self).sqrt())
    }
}

impl<T: Number> Add for Vec3<T> {
    type Output = Self;

    fn add(self, other: Self) -> Self {
        Self::new(self.x + other.x, self.y + other.y, self.z + other.z)
    }
}

impl<T: Number> Sub for Vec3<T> {
    type Output = Self;

    fn sub(self, other: Self) -> Self {
        Self::new(self.x - other.x, self.y - other.y, self.z - other.z)
    }
}

impl<T: Number> Neg for Vec3<T> {
    type Output = Self;

    fn neg(self) -> Self {
        Self::new(-self.x, -self.y, -self.z)
    }
}

impl<T: Number> Mul<T> for Vec3<T> {
    type Output = Self;

    fn mul(self, factor: T) -> Self {
        Self::new(self.x * factor, self.y * factor, self.z * factor)
    }
}

/// Linear RGB, of numbers that may carry derivatives.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Rgb<T>(pub(crate) [T; 3]);

impl<T: Number> Rgb<T> {
    pub(crate) fn constant(c: DVec3) -> Self {
        Self(c.to_array().map(T::constant))
    }

    pub(crate) fn value(self) -> DVec3 {
        DVec3::from_array(self.0.map(T::value))
    }
}

impl<T: Number> Add for Rgb<T> {
    type Output = Self;

    fn add(self, other: Self) -> Self {
        Self(std::array::from_fn(|i| self.0[i] + other.0[i]))
    }
}

impl<T: Number> Mul for Rgb<T> {
    type Output = Self;

    fn mul(self, other: Self) -> Self {
        Self(std::array::from_fn(|i| self.0[i] * other.0[i]))
    }
}

impl<T: Number> Mul<T> for Rgb<T> {
    type Output = Self;

    fn mul(self, factor: T) -> Self {
        Self(self.0.map(|c| c * factor))
    }
}
