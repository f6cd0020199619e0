//! Reading images.

use std::io::Cursor;
use std::path::Path;

use glam::DVec3;
use image::{DynamicImage, ImageDecoder, ImageFormat, ImageReader, Limits};

use super::{Image, check_size, error, from_srgb};
use crate::io::{Error, ImageProblem, files};

/// Reads a PNG, OpenEXR or Radiance HDR image for use as a texture.
///
/// Integers (8 or 16 bits) are sRGB and become linear, unless `raw` is set; floating point values are linear
/// already. Alpha is left out, grey becomes RGB. An OpenEXR image must have the channels R, G and B.
///
/// # Errors
/// [`Error::File`], or [`Error::Image`]; also for pixels that are not finite.
pub fn load_image(path: &Path, raw: bool) -> Result<Image, Error> {
    read_image(&files::read(path)?, path, raw)
}

/// [`load_image`] from memory. `path` is for messages.
///
/// # Errors
/// [`Error::Image`].
pub fn read_image(bytes: &[u8], path: &Path, raw: bool) -> Result<Image, Error> {
    let image = decode(bytes, raw).map_err(error(path))?;
    match image.pixels.iter().position(|p| !p.is_finite()) {
        None => Ok(image),
        Some(i) => Err(error(path)(ImageProblem::NotFinite { x: i % image.width, y: i / image.width })),
    }
}

/// Reads an OpenEXR image as it is: negative values, NaN and infinities are kept.
///
/// # Errors
/// [`Error::File`], or [`Error::Image`].
pub fn read_exr(path: &Path) -> Result<Image, Error> {
    let bytes = files::read(path)?;
    if image::guess_format(&bytes).ok() != Some(ImageFormat::OpenExr) {
        return Err(error(path)(ImageProblem::Format));
    }
    decode(&bytes, true).map_err(error(path))
}

fn decode(bytes: &[u8], raw: bool) -> Result<Image, ImageProblem> {
    let mut reader =
        ImageReader::new(Cursor::new(bytes)).with_guessed_format().map_err(|_| ImageProblem::Format)?;
    if !matches!(reader.format(), Some(ImageFormat::Png | ImageFormat::OpenExr | ImageFormat::Hdr)) {
        return Err(ImageProblem::Format);
    }
    reader.limits(Limits::default());
    let decoder = reader.into_decoder()?;
    let (width, height) = decoder.dimensions();
    let (width, height) = (width as usize, height as usize);
    check_size(width, height)?;
    let image = DynamicImage::from_decoder(decoder)?;
    let is_linear = raw || matches!(image, DynamicImage::ImageRgb32F(_) | DynamicImage::ImageRgba32F(_));
    let linear = |x: f64| if is_linear { x } else { from_srgb(x) };
    let pixels: Vec<DVec3> = match image {
        DynamicImage::ImageRgb32F(_) | DynamicImage::ImageRgba32F(_) => {
            image.into_rgb32f().pixels().map(|p| DVec3::from_array(p.0.map(f64::from))).collect()
        }
        // Exact for 8 bits as well: x · 257/65535 = x/255.
        _ => (image.into_rgb16().pixels())
            .map(|p| DVec3::from_array(p.0.map(|x| linear(f64::from(x) / 65535.0))))
            .collect(),
    };
    Ok(Image { width, height, pixels })
}
