//! Poses of a parameter vector as affine maps.

use glam::{DAffine3, DVec3};

use super::Parameters;
use crate::geometry::Mesh;
use crate::scene::Object;

/// An object that translation, rotation or scale parameters place.
#[derive(Clone, Debug)]
pub struct Placed<'p> {
    /// The object.
    pub object: Object,
    /// c₀, the centre of rotation and scale in the scene at rest, in scene units.
    pub pivot: DVec3,
    /// p₀ ↦ c₀ + t + s R (p₀ − c₀), from the scene at rest to where the object is, in scene units.
    pub map: DAffine3,
    /// Its meshes at rest, with the indices of their shapes.
    pub meshes: Vec<(usize, &'p Mesh)>,
}

impl Parameters {
    /// The pose at x of every object that translation, rotation or scale parameters place, in the order of
    /// their first parameter.
    ///
    /// # Panics
    /// If x has another length.
    #[must_use]
    pub fn placed(&self, x: &[f64]) -> Vec<Placed<'_>> {
        assert_eq!(x.len(), self.len, "one number for each parameter");
        let placed = self.rests.iter().map(|rest| Placed {
            object: rest.object,
            pivot: rest.centre,
            map: self.pose(x, rest.object).map(rest.centre),
            meshes: rest.parts.shapes.iter().copied().zip(&rest.meshes).collect(),
        });
        placed.collect()
    }
}
