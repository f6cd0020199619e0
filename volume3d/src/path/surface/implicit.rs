//! Intersection of a ray with an implicit surface, over numbers.

use flatland::calculus::{Number, Vec3};

/// A point of an implicit surface over numbers: its normal is that of the level set through the point.
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
