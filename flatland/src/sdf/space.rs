//! The plane and space as ambient spaces of implicit shapes.

use std::fmt::Debug;
use std::ops::{Add, Mul, Sub};

use glam::{DMat2, DMat3, DVec2, DVec3};

use crate::warp::{Domain, Vector};

/// R² or R³, with matrices for second derivatives.
pub trait Space: Vector + Send + Sync {
    /// A matrix of d × d numbers.
    type Matrix: Copy
        + Debug
        + PartialEq
        + Send
        + Sync
        + Add<Output = Self::Matrix>
        + Sub<Output = Self::Matrix>
        + Mul<f64, Output = Self::Matrix>
        + Mul<Self, Output = Self>;

    /// d.
    const DIMENSION: usize;
    /// The zero matrix.
    const FLAT: Self::Matrix;
    /// The identity.
    const IDENTITY: Self::Matrix;

    /// The vector with components given by a function.
    fn from_components(component: impl Fn(usize) -> f64) -> Self;
    /// A component, from 0 to d − 1.
    #[must_use]
    fn component(self, axis: usize) -> f64;
    /// a bᵀ.
    #[must_use]
    fn outer(self, other: Self) -> Self::Matrix;
    /// The sum of the diagonal.
    #[must_use]
    fn trace(matrix: Self::Matrix) -> f64;

    /// |a|.
    #[must_use]
    fn norm(self) -> f64 {
        self.dot(self).sqrt()
    }
}

impl Space for DVec2 {
    type Matrix = DMat2;
    const DIMENSION: usize = 2;
    const FLAT: DMat2 = DMat2::ZERO;
    const IDENTITY: DMat2 = DMat2::IDENTITY;

    #[inline]
    fn from_components(component: impl Fn(usize) -> f64) -> Self {
        Self::new(component(0), component(1))
    }

    #[inline]
    fn component(self, axis: usize) -> f64 {
        self[axis]
    }

    #[inline]
    fn outer(self, other: Self) -> DMat2 {
        DMat2::from_cols(self * other.x, self * other.y)
    }

    #[inline]
    fn trace(matrix: DMat2) -> f64 {
        matrix.x_axis.x + matrix.y_axis.y
    }

    #[inline]
    fn norm(self) -> f64 {
        self.length()
    }
}

impl Space for DVec3 {
    type Matrix = DMat3;
    const DIMENSION: usize = 3;
    const FLAT: DMat3 = DMat3::ZERO;
    const IDENTITY: DMat3 = DMat3::IDENTITY;

    #[inline]
    fn from_components(component: impl Fn(usize) -> f64) -> Self {
        Self::new(component(0), component(1), component(2))
    }

    #[inline]
    fn component(self, axis: usize) -> f64 {
        self[axis]
    }

    #[inline]
    fn outer(self, other: Self) -> DMat3 {
        DMat3::from_cols(self * other.x, self * other.y, self * other.z)
    }

    #[inline]
    fn trace(matrix: DMat3) -> f64 {
        matrix.x_axis.x + matrix.y_axis.y + matrix.z_axis.z
    }

    #[inline]
    fn norm(self) -> f64 {
        self.length()
    }
}

/// Directions of rays in such a space: [`Circle`](crate::warp::Circle) in the plane, the sphere in space.
pub trait Directions: Domain<Vector: Space> {}

impl<D: Domain<Vector: Space>> Directions for D {}
