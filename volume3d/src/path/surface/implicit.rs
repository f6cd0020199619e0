//! An implicit surface and a ray, in numbers.

use flatland::calculus::{Number, Vec3};

/// A point of an implicit surface in numbers: its normal is that of the level set through it, wherever that goes.
#[derive(Clone, Copy, Debug)]
pub(super) struct MovingLevelSet<T> {
    /// ∇φ.
    pub(super) gradient: Vec3<T>,
}

impl<T: Number> MovingLevelSet<T> {
    /// ∇φ/|∇φ|.
    pub(super) fn normal(&self) -> Vec3<T> {
        self.gradient.normalized()
    }
}
