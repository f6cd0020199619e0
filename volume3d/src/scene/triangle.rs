//! The triangles of a scene's table.

/// No normal, or no texture coordinate.
pub(crate) const NONE: u32 = u32::MAX;

/// A triangle of the scene, by indices into the scene's tables.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Triangle {
    pub(crate) positions: [u32; 3],
    /// [`NONE`] where the face's own normal shades.
    pub(crate) normals: [u32; 3],
    /// [`NONE`] where there are no texture coordinates.
    pub(crate) uvs: [u32; 3],
    pub(crate) shape: u32,
}
