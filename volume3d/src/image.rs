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

    /// The picture in fewer pixels: each is the mean over its area. `None` if it would have more columns or
    /// rows, or none.
    #[must_use]
    pub fn reduced(&self, width: usize, height: usize) -> Option<Self> {
        if !(1..=self.width).contains(&width) || !(1..=self.height).contains(&height) {
            return None;
        }
        let columns: Vec<_> = (0..width).map(|x| shares(x, width, self.width)).collect();
        let mut pixels = Vec::with_capacity(width * height);
        for y in 0..height {
            let rows = shares(y, height, self.height);
            pixels.extend(columns.iter().map(|columns| {
                let row = |&(y, share): &(usize, f64)| {
                    let row = &self.pixels[y * self.width..];
                    columns.iter().map(|&(x, share)| share * row[x]).sum::<DVec3>() * share
                };
                rows.iter().map(row).sum::<DVec3>()
            }));
        }
        Some(Self { width, height, pixels })
    }
}

/// The old pixels of a row that new pixel `at` of `new` covers, with their shares of its length.
fn shares(at: usize, new: usize, old: usize) -> Vec<(usize, f64)> {
    // In units of 1/(new · old) of the row.
    let (begin, end) = (at * old, (at + 1) * old);
    let of = |i: usize| ((i + 1) * new).min(end) - (i * new).max(begin);
    (begin / new..end.div_ceil(new)).map(|i| (i, of(i) as f64 / old as f64)).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn reduced_pixels_are_means_over_areas() {
        let image =
            Image { width: 3, height: 2, pixels: (0..6).map(|i| DVec3::splat(f64::from(i))).collect() };
        // Columns of 1.5 pixels: (0 + 1/2)/1.5 and (1/2 + 2)/1.5, the row below 3 more.
        let expected = [1.0 / 3.0 + 1.5, 5.0 / 3.0 + 1.5].map(DVec3::splat);
        let found = image.reduced(2, 1).unwrap();
        assert!(found.pixels.iter().zip(expected).all(|(a, b)| a.abs_diff_eq(b, 1e-15)), "{found:?}");
        assert_eq!(image.reduced(3, 2).unwrap(), image);
        assert!(image.reduced(4, 2).is_none() && image.reduced(3, 0).is_none());
    }
}
