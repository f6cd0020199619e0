//! Images as functions of texture coordinates.

use glam::{DAffine2, DVec3};

/// What a texture is outside [0, 1]².
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Wrap {
    /// Periodic.
    #[default]
    Repeat,
    /// Mirrored at every border.
    Mirror,
    /// The border's colour.
    Clamp,
}

/// An image looked up bilinearly: texel (i, j) has its centre at ((i + ½)/width, (j + ½)/height), and the
/// first row is at the top, v = 1.
#[derive(Clone, Debug, PartialEq)]
pub struct Texture {
    /// Its name in messages and requests.
    pub id: String,
    /// Columns.
    pub width: usize,
    /// Rows.
    pub height: usize,
    /// Linear RGB, row by row from the top.
    pub texels: Vec<DVec3>,
    /// What it is outside [0, 1]².
    pub wrap: Wrap,
    /// Applied to texture coordinates before the lookup.
    pub to_uv: DAffine2,
}
