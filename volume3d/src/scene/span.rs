//! Straight pieces of discontinuities: edges of triangles, and crossings.

use flatland::calculus::{Number, Vec3};
use glam::DVec3;

use super::Scene;

/// A straight piece of a discontinuity.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub(crate) enum Span {
    /// A segment between two positions.
    Edge([u32; 2]),
    /// A crossing, by index.
    Crossing(u32),
}

impl Span {
    /// Both ends.
    pub(crate) fn ends(self, scene: &Scene) -> [DVec3; 2] {
        match self {
            Self::Edge(ends) => ends.map(|i| scene.positions[i as usize]),
            Self::Crossing(index) => scene.crossings().get(index).places,
        }
    }

    /// A point at a position along the piece, over numbers, from the positions of vertices.
    pub(crate) fn point<T: Number>(
        self,
        scene: &Scene,
        along: f64,
        position: impl Fn(u32) -> Vec3<T>,
    ) -> Vec3<T> {
        match self {
            Self::Edge(ends) => {
                let [p, q] = ends.map(position);
                p * T::constant(1.0 - along) + q * T::constant(along)
            }
            Self::Crossing(index) => scene.crossings().get(index).point(scene.tables(), along, position),
        }
    }
}
