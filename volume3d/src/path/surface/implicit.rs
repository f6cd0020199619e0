//! Intersection of a ray with an implicit surface, over numbers.

use flatland::calculus::{Number, Vec3};

/// A point of an implicit surface over numbers, with the normal of the level set through it.
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
