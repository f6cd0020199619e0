//! Image encoding.

use std::io::Cursor;
use std::path::Path;

use exr::prelude::{SpecificChannels, Text, Vec2, WritableImage};

use super::{check, error, to_srgb};
use crate::Image;
use crate::io::{Error, ImageProblem, files};

/// Writes linear RGB as OpenEXR, single precision, atomically. Negative values, NaN and infinities are kept.
///
/// # Errors
/// [`Error::File`], or [`Error::Image`] if the number of pixels is not that of the size.
pub fn write_exr(path: &Path, image: &Image) -> Result<(), Error> {
    write_exr_with_comments(path, image, "")
}

/// `write_exr` with a comment: the attribute `comments` of the header, in which characters beyond Latin-1
/// become question marks. An empty text writes none.
///
/// # Errors
/// [`Error::File`], or [`Error::Image`] if the number of pixels is not that of the size.
pub fn write_exr_with_comments(path: &Path, image: &Image, comments: &str) -> Result<(), Error> {
    check(image).map_err(error(path))?;
    let channels = SpecificChannels::rgb(|Vec2(x, y): Vec2<usize>| {
        let [r, g, b] = image.pixels[y * image.width + x].to_array().map(|x| x as f32);
        (r, g, b)
    });
    let mut file = exr::prelude::Image::from_channels(image.size(), channels);
    if !comments.is_empty() {
        let latin = |c: char| u8::try_from(u32::from(c)).unwrap_or(b'?');
        file.layer_data.attributes.comments =
            Some(Text::from_bytes_unchecked(comments.chars().map(latin).collect()));
    }
    let mut bytes = vec![];
    file.write().to_buffered(Cursor::new(&mut bytes)).map_err(|e| error(path)(e.into()))?;
    files::write_bytes(path, &bytes)
}

/// Writes radiance as an 8-bit sRGB PNG, atomically: values outside [0, 1] are clamped, NaN is black.
///
/// Exposure and tone curve are not applied; scale the image beforehand.
///
/// # Errors
/// [`Error::File`], or [`Error::Image`] if the number of pixels is not that of the size.
pub fn write_png(path: &Path, image: &Image) -> Result<(), Error> {
    write_png_with_comments(path, image, "")
}

/// `write_png` with a text chunk named "Comment". An empty text writes none.
///
/// # Errors
/// [`Error::File`], or [`Error::Image`] if the number of pixels is not that of the size.
pub fn write_png_with_comments(path: &Path, image: &Image, comments: &str) -> Result<(), Error> {
    check(image).map_err(error(path))?;
    write_png_bytes(path, image, &srgb_bytes(image), &[(COMMENT, comments.to_owned())])
}

/// [`write_png`] to memory.
///
/// # Errors
/// An [`ImageProblem`] if the number of pixels is not that of the size.
pub fn encode_png(image: &Image) -> Result<Vec<u8>, ImageProblem> {
    check(image)?;
    png_bytes(image, &srgb_bytes(image), &[])
}

/// The keyword of comments in a PNG.
pub(super) const COMMENT: &str = "Comment";

fn srgb_bytes(image: &Image) -> Vec<u8> {
    let byte = |x: f64| (255.0 * to_srgb(x.clamp(0.0, 1.0))).round() as u8;
    image.pixels.iter().flat_map(|p| p.to_array().map(byte)).collect()
}

/// Writes images of equal size as a looping animated PNG, each shown for `milliseconds`, atomically; encoded
/// as by [`write_png`].
///
/// # Errors
/// [`Error::File`], or [`Error::Image`] if there are none, or their sizes differ.
pub fn write_animation(path: &Path, images: &[Image], milliseconds: u16) -> Result<(), Error> {
    let nothing = Image::default();
    let first = images.first().unwrap_or(&nothing);
    for image in std::iter::once(first).chain(images) {
        check(image).map_err(error(path))?;
        let (width, height) = first.size();
        if image.size() != (width, height) {
            return Err(error(path)(ImageProblem::Length { width, height, found: image.pixels.len() }));
        }
    }
    let mut bytes = vec![];
    let mut encode = || {
        let mut encoder = encoder(&mut bytes, first);
        encoder.set_animated(images.len() as u32, 0)?;
        encoder.set_frame_delay(milliseconds, 1000)?;
        let mut writer = encoder.write_header()?;
        images.iter().try_for_each(|image| writer.write_image_data(&srgb_bytes(image)))?;
        writer.finish()
    };
    encode().map_err(|e| error(path)(e.into()))?;
    files::write_bytes(path, &bytes)
}

/// An encoder of 8-bit sRGB.
fn encoder<'a>(bytes: &'a mut Vec<u8>, image: &Image) -> png::Encoder<'static, &'a mut Vec<u8>> {
    let mut encoder = png::Encoder::new(bytes, image.width as u32, image.height as u32);
    encoder.set_color(png::ColorType::Rgb);
    encoder.set_depth(png::BitDepth::Eight);
    encoder.set_source_srgb(png::SrgbRenderingIntent::RelativeColorimetric);
    encoder
}

/// Writes 8-bit RGB with text chunks.
pub(super) fn write_png_bytes(
    path: &Path,
    image: &Image,
    rgb: &[u8],
    texts: &[(&str, String)],
) -> Result<(), Error> {
    files::write_bytes(path, &png_bytes(image, rgb, texts).map_err(error(path))?)
}

/// 8-bit RGB with text chunks as a PNG.
pub(super) fn png_bytes(
    image: &Image,
    rgb: &[u8],
    texts: &[(&str, String)],
) -> Result<Vec<u8>, ImageProblem> {
    let mut bytes = vec![];
    let mut encode = || {
        let mut encoder = encoder(&mut bytes, image);
        for (keyword, text) in texts.iter().filter(|(_, text)| !text.is_empty()) {
            encoder.add_itxt_chunk((*keyword).to_owned(), text.clone())?;
        }
        let mut writer = encoder.write_header()?;
        writer.write_image_data(rgb)?;
        writer.finish()
    };
    encode()?;
    Ok(bytes)
}
