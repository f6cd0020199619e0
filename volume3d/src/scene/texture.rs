//! Images as functions of texture coordinates.

use glam::{DAffine2, DVec2, DVec3};

use crate::geometry::Attribute;

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

/// How far texels in single precision may be from where a triangle's plane is, and corners from their texels.
const ROUNDING: f64 = 1e-6;

impl Texture {
    /// Whether it has four texels a triangle, two by two, the fourth of them in the plane of the other three, which are at the
    /// triangle's corners: so the numbers at the corners of a mesh are made a texture.
    pub(crate) fn is_of_triangles(&self) -> bool {
        let Self { width, height, texels, .. } = self;
        let is_plane = |i: usize| {
            let [a, b, c, d] = [i - width - 1, i - width, i - 1, i].map(|i| texels[i]);
            (b + c - a - d).abs().max_element() <= ROUNDING
        };
        self.wrap == Wrap::Clamp
            && width % 2 == 0
            && height % 2 == 0
            && texels.len() == width * height
            && (0..texels.len()).filter(|&i| self.is_fourth(i)).all(is_plane)
    }

    /// Whether a texel of such a texture is the fourth of its triangle, which may be outside of the range of the other three.
    pub(crate) fn is_fourth(&self, texel: usize) -> bool {
        texel % self.width % 2 == 1 && texel / self.width % 2 == 1
    }

    /// Whether a mesh with these texture coordinates shows only what is between the first three of four texels.
    pub(crate) fn shows_triangles_only(&self, uvs: &Attribute<DVec2>) -> bool {
        let size = DVec2::new(self.width as f64, self.height as f64);
        uvs.triangles.iter().all(|triangle| {
            let corners = triangle.map(|i| {
                let uv = self.to_uv.transform_point2(uvs.values[i as usize]);
                DVec2::new(uv.x, 1.0 - uv.y) * size - 0.5
            });
            let [a, b, c] = corners;
            let cell = 2.0 * ((a.min(b).min(c) + ROUNDING) / 2.0).floor();
            let is_within = |corner: DVec2| {
                let part = corner - cell;
                part.min_element() >= -ROUNDING && part.element_sum() <= 1.0 + ROUNDING
            };
            cell.min_element() >= 0.0
                && (cell + 2.0).cmple(size + ROUNDING).all()
                && corners.into_iter().all(is_within)
        })
    }
}
