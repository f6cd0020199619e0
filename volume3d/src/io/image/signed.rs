//! Visualisation of signed images: gradients, differences.

use std::path::Path;

use super::encode::{COMMENT, png_bytes, write_png_bytes};
use super::{check, error};
use crate::Image;
use crate::io::{Error, ImageProblem};

/// The diverging map `RdBu` of Brewer (ColorBrewer 2.0), sRGB bytes, from negative (blue) over zero (white)
/// to positive (red). Its nodes are interpolated linearly in sRGB.
const COLOURS: [[u8; 3]; 11] = [
    [5, 48, 97],
    [33, 102, 172],
    [67, 147, 195],
    [146, 197, 222],
    [209, 229, 240],
    [255, 255, 255],
    [253, 219, 199],
    [244, 165, 130],
    [214, 96, 77],
    [178, 24, 43],
    [103, 0, 31],
];

/// The colour of NaN: yellow, which is not in the map.
const NOT_A_NUMBER: [u8; 3] = [255, 210, 0];

/// Fraction of the non-zero pixels that must lie within the range chosen by [`signed_range`]. The others are
/// clamped: a few bright pixels of a noisy gradient must not turn all others white.
const WITHIN: f64 = 0.995;

/// The sRGB colour of `value` on a scale from −`range` (dark blue) over 0 (white) to `range` (dark red).
#[must_use]
pub fn signed_colour(value: f64, range: f64) -> [u8; 3] {
    let ratio = if value == 0.0 { 0.0 } else { value / range };
    if ratio.is_nan() {
        return NOT_A_NUMBER;
    }
    let half = (COLOURS.len() / 2) as f64;
    let at = half * (1.0 + ratio.clamp(-1.0, 1.0));
    let below = (at as usize).min(COLOURS.len() - 2);
    let mix = |channel: usize| {
        let [a, b] = [below, below + 1].map(|i| f64::from(COLOURS[i][channel]));
        (a + (at - below as f64) * (b - a)).round() as u8
    };
    [mix(0), mix(1), mix(2)]
}

/// A range for [`write_signed_png`]: of the pixels whose mean over the channels is finite and not 0, 99.5%
/// lie within ± the range. Zero if there are none.
#[must_use]
pub fn signed_range(image: &Image) -> f64 {
    let mut sizes: Vec<f64> = values(image).map(f64::abs).filter(|x| x.is_finite() && *x != 0.0).collect();
    sizes.sort_by(f64::total_cmp);
    let rank = (WITHIN * sizes.len() as f64).ceil() as usize;
    sizes.get(rank.saturating_sub(1)).copied().unwrap_or(0.0)
}

/// Writes a visualisation of a signed image as an 8-bit PNG, atomically: the mean of the three channels of
/// each pixel, on a scale from −`range` (blue) over 0 (white) to `range` (red); see [`signed_colour`].
///
/// The mean is used, and not the luminance, because most losses, and so their gradients, weigh the channels
/// equally. Changes that keep the mean (red turning into blue) are invisible; write the channels separately
/// to see them. The range is stored in the file, in a text chunk named "Range".
///
/// # Errors
/// [`Error::File`], or [`Error::Image`] if the number of pixels is not that of the size.
pub fn write_signed_png(path: &Path, image: &Image, range: f64) -> Result<(), Error> {
    write_signed_png_with_comments(path, image, range, "")
}

/// `write_signed_png` with a text chunk named "Comment". An empty text writes none.
///
/// # Errors
/// [`Error::File`], or [`Error::Image`] if the number of pixels is not that of the size.
pub fn write_signed_png_with_comments(
    path: &Path,
    image: &Image,
    range: f64,
    comments: &str,
) -> Result<(), Error> {
    check(image).map_err(error(path))?;
    let text = format!("mean of R, G, B; blue −{range:e}, white 0, red {range:e}");
    write_png_bytes(path, image, &colours(image, range), &[("Range", text), (COMMENT, comments.to_owned())])
}

/// [`write_signed_png`] to memory.
///
/// # Errors
/// An [`ImageProblem`] if the number of pixels is not that of the size.
pub fn encode_signed_png(image: &Image, range: f64) -> Result<Vec<u8>, ImageProblem> {
    check(image)?;
    png_bytes(image, &colours(image, range), &[])
}

fn colours(image: &Image, range: f64) -> Vec<u8> {
    values(image).flat_map(|x| signed_colour(x, range)).collect()
}

fn values(image: &Image) -> impl Iterator<Item = f64> + '_ {
    image.pixels.iter().map(|p| p.element_sum() / 3.0)
}
