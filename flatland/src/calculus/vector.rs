//! Vectors of numbers that may carry derivatives; glam's vectors support floats only.

use std::ops::{Add, Mul, Neg, Sub};

use glam::{DVec2, DVec3};

use super::Number;

/// Common operations of vectors of any dimension.
macro_rules! vector {
    ($vector:ident of $values:ident: $first:ident $(, $rest:ident)*) => {
        impl<T: Number> $vector<T> {
            /// A vector from its coordinates.
            #[inline]
            #[must_use]
            pub fn new($first: T $(, $rest: T)*) -> Self {
                Self { $first $(, $rest)* }
            }

            /// A constant vector.
            #[inline]
            #[must_use]
            pub fn constant(v: $values) -> Self {
                Self::new(T::constant(v.$first) $(, T::constant(v.$rest))*)
            }

            /// The value, without derivatives.
            #[inline]
            #[must_use]
            pub fn value(self) -> $values {
                $values::new(self.$first.value() $(, self.$rest.value())*)
            }

            /// a · b.
            #[inline]
            #[must_use]
            pub fn dot(self, other: Self) -> T {
                self.$first * other.$first $(+ self.$rest * other.$rest)*
            }

            /// v/|v|.
            #[inline]
            #[must_use]
            pub fn normalized(self) -> Self {
                self * (T::constant(1.0) / self.dot(self).sqrt())
            }
        }

        impl<T: Number> Add for $vector<T> {
            type Output = Self;

            #[inline]
            fn add(self, other: Self) -> Self {
                Self::new(self.$first + other.$first $(, self.$rest + other.$rest)*)
            }
        }

        impl<T: Number> Sub for $vector<T> {
            type Output = Self;

            #[inline]
            fn sub(self, other: Self) -> Self {
                Self::new(self.$first - other.$first $(, self.$rest - other.$rest)*)
            }
        }

        impl<T: Number> Neg for $vector<T> {
            type Output = Self;

            #[inline]
            fn neg(self) -> Self {
                Self::new(-self.$first $(, -self.$rest)*)
            }
        }

        impl<T: Number> Mul<T> for $vector<T> {
            type Output = Self;

            #[inline]
            fn mul(self, factor: T) -> Self {
                Self::new(self.$first * factor $(, self.$rest * factor)*)
            }
        }
    };
}

/// A vector in the plane.
#[derive(Clone, Copy, Debug)]
pub struct Vec2<T> {
    /// First.
    pub x: T,
    /// Second.
    pub y: T,
}

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

vector!(Vec2 of DVec2: x, y);
vector!(Vec3 of DVec3: x, y, z);

impl<T: Number> Vec2<T> {
    /// a × b = |a| |b| sin of the angle from a to b.
    #[inline]
    #[must_use]
    pub fn cross(self, other: Self) -> T {
        self.x * other.y - self.y * other.x
    }

    /// Rotated by a right angle from +x towards +y.
    #[inline]
    #[must_use]
    pub fn perp(self) -> Self {
        Self::new(-self.y, self.x)
    }

    /// The signed angle from a to b, to full precision also for small angles.
    #[must_use]
    pub fn angle_to(self, other: Self) -> T {
        let (sin, cos) = (self.cross(other), self.dot(other));
        let (s, c) = (sin.value(), cos.value());
        // d atan2(s, c) = (c ds − s dc)/(s² + c²)
        (sin * c - cos * s).chain(s.atan2(c), 1.0 / (s * s + c * c))
    }
}

impl<T: Number> Vec3<T> {
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

    /// A constant vector under an infinitesimal rotation ω: v + ω × v.
    #[inline]
    #[must_use]
    pub fn turned(v: DVec3, turn: Option<Self>) -> Self {
        let v = Self::constant(v);
        turn.map_or(v, |turn| v + turn.cross(v))
    }
}

/// Linear RGB over numbers that may carry derivatives.
#[derive(Clone, Copy, Debug)]
pub struct Rgb<T>(
    /// Red, green and blue.
    pub [T; 3],
);

impl<T: Number> Rgb<T> {
    /// A constant colour.
    #[inline]
    #[must_use]
    pub fn constant(c: DVec3) -> Self {
        Self(c.to_array().map(T::constant))
    }

    /// The value, without derivatives.
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

impl<T: Number> Sub for Rgb<T> {
    type Output = Self;

    #[inline]
    fn sub(self, other: Self) -> Self {
        Self(std::array::from_fn(|i| self.0[i] - other.0[i]))
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
