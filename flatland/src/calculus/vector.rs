//! Vectors of numbers that may carry derivatives. glam's are of floats only, on purpose.

use std::ops::{Add, Mul, Neg, Sub};

use glam::DVec3;

use super::Number;

/// A vector in space.
#[derive(Clone, Copy, Debug)]
pub struct Vec3<T> {
    /// First.
    pub x: T,
    /// Second.
    pub y: T,
    /// Third.
    pub z: T,
}

impl<T: Number> Vec3<T> {
    /// Of its coordinates.
    #[inline]
    #[must_use]
    pub fn new(x: T, y: T, z: T) -> Self {
        Self { x, y, z }
    }

    /// Without derivatives.
    #[inline]
    #[must_use]
    pub fn constant(v: DVec3) -> Self {
        Self::new(T::constant(v.x), T::constant(v.y), T::constant(v.z))
    }

    /// The vector itself.
    #[inline]
    #[must_use]
    pub fn value(self) -> DVec3 {
        DVec3::new(self.x.value(), self.y.value(), self.z.value())
    }

    /// a · b.
    #[inline]
    #[must_use]
    pub fn dot(self, other: Self) -> T {
        self.x * other.x + self.y * other.y + self.z * other.z
    }

    /// a × b.
    #[inline]
    #[must_use]
    pub fn cross(self, other: Self) -> Self {
        Self::new(
            self.y * other.z - self.z * other.y,
            self.z * other.x - self.x * other.z,
            self.x * other.y - self.y * other.x,
        )
    }

    /// A constant vector after a turn ω: v + ω × v.
    #[inline]
    #[must_use]
    pub fn turned(v: DVec3, turn: Option<Self>) -> Self {
        let v = Self::constant(v);
        turn.map_or(v, |turn| v + turn.cross(v))
    }

    /// v/|v|.
    #[inline]
    #[must_use]
    pub fn normalized(self) -> Self {
        self * (T::constant(1.0) / self.dot(self).sqrt())
    }
}

impl<T: Number> Add for Vec3<T> {
    type Output = Self;

    #[inline]
    fn add(self, other: Self) -> Self {
        Self::new(self.x + other.x, self.y + other.y, self.z + other.z)
    }
}

impl<T: Number> Sub for Vec3<T> {
    type Output = Self;

    #[inline]
    fn sub(self, other: Self) -> Self {
        Self::new(self.x - other.x, self.y - other.y, self.z - other.z)
    }
}

impl<T: Number> Neg for Vec3<T> {
    type Output = Self;

    #[inline]
    fn neg(self) -> Self {
        Self::new(-self.x, -self.y, -self.z)
    }
}

impl<T: Number> Mul<T> for Vec3<T> {
    type Output = Self;

    #[inline]
    fn mul(self, factor: T) -> Self {
        Self::new(self.x * factor, self.y * factor, self.z * factor)
    }
}

/// Linear RGB, of numbers that may carry derivatives.
#[derive(Clone, Copy, Debug)]
pub struct Rgb<T>(
    /// Red, green and blue.
    pub [T; 3],
);

impl<T: Number> Rgb<T> {
    /// Without derivatives.
    #[inline]
    #[must_use]
    pub fn constant(c: DVec3) -> Self {
        Self(c.to_array().map(T::constant))
    }

    /// The colour itself.
    #[inline]
    #[must_use]
    pub fn value(self) -> DVec3 {
        DVec3::from_array(self.0.map(T::value))
    }
}

impl<T: Number> Add for Rgb<T> {
    type Output = Self;

    #[inline]
    fn add(self, other: Self) -> Self {
        Self(std::array::from_fn(|i| self.0[i] + other.0[i]))
    }
}

impl<T: Number> Mul for Rgb<T> {
    type Output = Self;

    #[inline]
    fn mul(self, other: Self) -> Self {
        Self(std::array::from_fn(|i| self.0[i] * other.0[i]))
    }
}

impl<T: Number> Mul<T> for Rgb<T> {
    type Output = Self;

    #[inline]
    fn mul(self, factor: T) -> Self {
        Self(self.0.map(|c| c * factor))
    }
}
