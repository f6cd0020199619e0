//! Bump and normal maps.

use flatland::calculus::{Number, Vec3};

use super::calculus::Calculus;
use super::texture::{lookup, slope};
use crate::scene::{Relief, Scene};

/// Inputs of a bump- or normal-mapped normal.
pub(super) struct Tilted<T> {
    /// The interpolated shading normal.
    pub(super) normal: Vec3<T>,
    pub(super) uv: [T; 2],
    /// ∂u p and ∂v p.
    pub(super) sides: [Vec3<T>; 2],
    /// The geometric normal.
    pub(super) face: Vec3<T>,
}

impl<T: Number> Tilted<T> {
    /// The mapped unit normal on the front.
    pub(super) fn normal<C: Calculus<Number = T>>(
        &self,
        scene: &Scene,
        calculus: &C,
        relief: &Relief,
    ) -> Vec3<T> {
        let (n, [s, t]) = (self.normal, self.uv);
        match *relief {
            Relief::Bump { texture, scale } => {
                let heights = slope(&scene.description.textures[texture], texture, s, t, calculus);
                let lifted = |side: Vec3<T>, height: T| side + n * (height * scale - n.dot(side));
                let tilted = lifted(self.sides[0], heights[0]).cross(lifted(self.sides[1], heights[1]));
                let tilted = tilted.normalized();
                if self.face.dot(tilted).value() < 0.0 { -tilted } else { tilted }
            }
            Relief::Normals { texture } => {
                let image = &scene.description.textures[texture];
                let c = lookup(image, texture, [image.wrap; 2], s, t, calculus).0;
                let [x, y, z] = c.map(|c| c * 2.0 - T::constant(1.0));
                // Frame of the surface, with its first axis along ∂u p.
                let along = (self.sides[0] - n * n.dot(self.sides[0])).normalized();
                (along * x + n.cross(along) * y + n * z).normalized()
            }
        }
    }
}
