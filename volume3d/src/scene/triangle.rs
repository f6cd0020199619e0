//! Triangles of a scene.

use glam::DVec3;

/// Index for no normal, or no texture coordinate.
pub(crate) const NONE: u32 = u32::MAX;

/// A triangle of the scene, by indices into the scene's tables.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Triangle {
    pub(crate) positions: [u32; 3],
    /// [`NONE`] for the geometric normal.
    pub(crate) normals: [u32; 3],
    /// [`NONE`] without texture coordinates.
    pub(crate) uvs: [u32; 3],
    pub(crate) shape: u32,
}

impl Triangle {
    /// Whether it is shaded with its geometric normal.
    #[inline]
    pub(crate) fn is_flat(&self) -> bool {
        self.normals[0] == NONE
    }
}

/// Position and index tables of a scene's triangles.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Tables<'s> {
    pub(crate) positions: &'s [DVec3],
    pub(crate) triangles: &'s [Triangle],
    /// Origin of the input coordinates.
    pub(crate) origin: DVec3,
}

impl Tables<'_> {
    /// The corners of a triangle.
    #[inline]
    pub(crate) fn corners(self, triangle: u32) -> [DVec3; 3] {
        let [a, b, c] = self.triangles[triangle as usize].positions;
        [self.positions[a as usize], self.positions[b as usize], self.positions[c as usize]]
    }
}

/// Barycentric coordinates of a point in the plane of a triangle.
pub(super) fn barycentric([a, b, c]: &[DVec3; 3], x: DVec3) -> [f64; 3] {
    let cross = (b - a).cross(c - a);
    let area = cross.length_squared();
    let second = (x - a).cross(c - a).dot(cross) / area;
    let third = (b - a).cross(x - a).dot(cross) / area;
    [1.0 - second - third, second, third]
}
