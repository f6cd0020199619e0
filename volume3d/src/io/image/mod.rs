//! Image files: textures, radiance and gradients.

mod decode;
mod encode;
mod layers;
mod signed;
mod transfer;

use std::path::Path;

pub use self::decode::{image_size, load_image, load_image_over, read_exr, read_image};
pub use self::encode::{
    encode_png, write_animation, write_exr, write_exr_with_comments, write_png, write_png_with_comments,
};
pub use self::signed::{
    encode_signed_png, signed_colour, signed_range, write_signed_png, write_signed_png_with_comments,
};
pub use self::transfer::{Encoding, covered};

use super::{Error, ImageProblem};
use crate::Image;

/// Maximum number of pixels that is read or written: 2²⁸, 6 GiB in memory.
const MAX_PIXELS: usize = 1 << 28;

/// Checks that the number of pixels matches the size, is not 0, and is not too large.
fn check(image: &Image) -> Result<(), ImageProblem> {
    let Image { width, height, ref pixels } = *image;
    check_size(width, height)?;
    if pixels.len() == width * height {
        Ok(())
    } else {
        Err(ImageProblem::Length { width, height, found: pixels.len() })
    }
}

fn check_size(width: usize, height: usize) -> Result<(), ImageProblem> {
    match width.checked_mul(height) {
        Some(1..=MAX_PIXELS) => Ok(()),
        _ => Err(ImageProblem::Size { width, height, limit: MAX_PIXELS }),
    }
}

/// Maximum number of pixels per byte of a file: deflate expands a byte up to 1032 times, and a byte of a PNG
/// is up to 8 pixels. The other formats compress less.
const MAX_PIXELS_PER_BYTE: usize = 1032 * 8;

fn error(path: &Path) -> impl Fn(ImageProblem) -> Error {
    move |problem| Error::Image { path: path.to_path_buf(), problem }
}

/// The sRGB transfer function (IEC 61966-2-1), linear to encoded, from [0, 1] to [0, 1].
fn to_srgb(x: f64) -> f64 {
    if x <= 0.003_130_8 { 12.92 * x } else { 1.055 * x.powf(1.0 / 2.4) - 0.055 }
}

/// The inverse of [`to_srgb`].
pub(super) fn from_srgb(x: f64) -> f64 {
    if x <= 0.040_45 { x / 12.92 } else { ((x + 0.055) / 1.055).powf(2.4) }
}
