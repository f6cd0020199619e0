//! Textures.

use glam::{DAffine2, DVec2, DVec3};

use crate::geometry::Attribute;

/// Continuation of a texture outside [0, 1]².
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Wrap {
    /// Periodic.
    #[default]
    Repeat,
    /// Mirrored at every border.
    Mirror,
    /// Clamped to the border texels.
    Clamp,
}

/// An image with bilinear lookup: texel (i, j) has its centre at ((i + ½)/width, (j + ½)/height), and the
/// first row is at the top, v = 1.
#[derive(Clone, Debug, PartialEq)]
pub struct Texture {
    /// Name in messages and queries.
    pub id: String,
    /// Columns.
    pub width: usize,
    /// Rows.
    pub height: usize,
    /// Linear RGB, row by row from the top.
    pub texels: Vec<DVec3>,
    /// Continuation outside [0, 1]².
    pub wrap: Wrap,
    /// Transform of texture coordinates before the lookup.
    pub to_uv: DAffine2,
}

/// Tolerance for single-precision texels relative to a triangle's plane, and for corners relative to their
/// texels.
const ROUNDING: f64 = 1e-6;

impl Texture {
    /// Whether it stores per-vertex values of a mesh: 2 × 2 texels per triangle, three at the triangle's
    /// corners and the fourth in the plane of these.
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

    /// Whether a texel of such a texture is the fourth of its triangle, which may be outside the range of the
    /// other three.
    pub(crate) fn is_fourth(&self, texel: usize) -> bool {
        texel % self.width % 2 == 1 && texel / self.width % 2 == 1
    }

    /// Whether a mesh with these texture coordinates shows only the triangle between the first three of each
    /// four texels.
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
