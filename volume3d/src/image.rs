//! Images.

use glam::DVec3;

/// Linear RGB, row by row from the top: radiance, a derivative, a standard error, or ∂L/∂I.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Image {
    /// Columns.
    pub width: usize,
    /// Rows.
    pub height: usize,
    /// Pixels, `width` · `height` of them.
    pub pixels: Vec<DVec3>,
}

impl Image {
    /// A constant image.
    #[must_use]
    pub fn constant(width: usize, height: usize, colour: DVec3) -> Self {
        Self { width, height, pixels: vec![colour; width * height] }
    }

    /// Columns and rows.
    #[must_use]
    pub fn size(&self) -> (usize, usize) {
        (self.width, self.height)
    }

    /// An image of the same size with other pixels.
    #[must_use]
    pub fn with_pixels(&self, pixels: Vec<DVec3>) -> Self {
        Self { width: self.width, height: self.height, pixels }
    }
}
