//! Textures with steps, as textures without.
//!
//! A step of reflectance within a surface is a jump that moves with the surface, and no field follows it: derivatives by
//! geometry would be biased in silence. Instead of a step there is a ramp, so narrow that it is hardly seen, which a bilinear
//! texture represents exactly: derivatives are those of the image with ramps.

use glam::DVec3;

use crate::Image;

/// Texels of a checkerboard along each axis of its period, of which one cell is a half. A ramp between cells is one texel wide:
/// 1/128 of the period. It lies half on either side of the step, so that the mean over a period stays what it is.
pub(super) const CHECKERBOARD_TEXELS: usize = 128;

/// What is said of every checkerboard.
pub(super) const CHECKERBOARD_NOTE: &str =
    "the steps of the checkerboard are ramps of 1/128 of its period: derivatives are those of the ramps";

/// Texels that one of an image without interpolation becomes along each axis; a ramp is one of them wide.
const MOST_COPIES: usize = 16;
/// With fewer, ramps would be as wide as what is between them.
const FEWEST_COPIES: usize = 4;
/// Texels that there may be in all.
const MOST_TEXELS: usize = 1 << 20;

/// The unit square in four: the first colour where u and v are both below ½, or both above.
pub(super) fn checkerboard(colours: [DVec3; 2]) -> Image {
    let n = CHECKERBOARD_TEXELS;
    let texel = |k: usize| {
        let (column, row) = (k % n, k / n);
        colours[usize::from((2 * column < n) != (2 * row < n))]
    };
    Image { width: n, height: n, pixels: (0..n * n).map(texel).collect() }
}

/// An image whose texels are squares of one colour, up to narrow ramps; and what is said of it. Large ones stay as they are.
pub(super) fn nearest(image: Image) -> (Image, String) {
    let Image { width, height, ref pixels } = image;
    let fits = |copies: usize| (width * copies).saturating_mul(height * copies) <= MOST_TEXELS;
    let Some(copies) = (FEWEST_COPIES..=MOST_COPIES).rev().find(|&copies| fits(copies)) else {
        let text =
            "filter_type nearest is read as bilinear: the image is too large to have its steps become ramps";
        return (image, text.to_owned());
    };
    let columns = width * copies;
    let texel = |k: usize| pixels[k / columns / copies * width + k % columns / copies];
    let pixels = (0..columns * height * copies).map(texel).collect();
    let text = format!(
        "the steps between texels are ramps of 1/{copies} of a texel: derivatives are those of the ramps"
    );
    (Image { width: columns, height: height * copies, pixels }, text)
}
