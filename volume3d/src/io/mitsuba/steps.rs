//! Smoothing of discontinuous textures.
//!
//! A step of reflectance within a surface is a discontinuity that moves with the surface, and no warp field
//! follows it: derivatives with respect to geometry would be biased without notice. The step is replaced by a
//! ramp that is almost invisible and that a bilinear texture represents exactly: derivatives are those of the
//! image with ramps.

use glam::DVec3;

use crate::Image;

/// Texels of a checkerboard along each axis of its period; one cell is half of them. A ramp between cells is
/// one texel wide: 1/128 of the period. It lies half on either side of the step, so that the mean over a
/// period is unchanged.
pub(super) const CHECKERBOARD_TEXELS: usize = 128;

/// Note on every checkerboard.
pub(super) const CHECKERBOARD_NOTE: &str =
    "the steps of the checkerboard are ramps of 1/128 of its period: derivatives are those of the ramps";

/// Maximum upsampling factor per axis of an image without interpolation; a ramp is one of the new texels
/// wide.
const MOST_COPIES: usize = 16;
/// Minimum upsampling factor: with a smaller one, ramps would be as wide as the space between them.
const FEWEST_COPIES: usize = 4;
/// Maximum number of texels of the upsampled image.
const MOST_TEXELS: usize = 1 << 20;

/// A checkerboard on the unit square: the first colour where u and v are both below ½ or both above.
pub(super) fn checkerboard(colours: [DVec3; 2]) -> Image {
    let n = CHECKERBOARD_TEXELS;
    let texel = |k: usize| {
        let (column, row) = (k % n, k / n);
        colours[usize::from((2 * column < n) != (2 * row < n))]
    };
    Image { width: n, height: n, pixels: (0..n * n).map(texel).collect() }
}

/// Converts an image without interpolation: its texels become squares of one colour, separated by narrow
/// ramps. Returns the image and a note; large images are unchanged.
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
