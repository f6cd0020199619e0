//! Image decoding.

use std::io::{BufRead, Cursor, Seek};
use std::path::Path;

use exr::meta::{BlockDescription, MetaData};
use glam::DVec3;
use image::{DynamicImage, ImageDecoder, ImageFormat, ImageReader, Limits};

use super::layers::{self, Picture};
use super::transfer::{Encoding, Transfer};
use super::{MAX_PIXELS, MAX_PIXELS_PER_BYTE, check_size, error};
use crate::Image;
use crate::io::memory::with_room;
use crate::io::{Error, ImageProblem, files};

/// Reads a PNG, JPEG, BMP, OpenEXR or Radiance HDR image for use as a texture.
///
/// Integers (8 or 16 bits) are converted from sRGB to linear, unless `raw` is set; floating-point values are
/// already linear. Alpha is dropped, grey becomes RGB. An OpenEXR image must have the channels R, G and B, or
/// a single one, in no layer or in the only one.
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
    check_finite(decode(bytes, by(raw), None, None).map_err(error(path))?, path)
}

/// [`load_image`] for a picture that is compared with a rendering: it is composited over `background`, linear
/// RGB. OpenEXR colours are premultiplied by alpha, as that format defines. `encoding` is the transfer
/// function of integers, and `layer` selects a layer of an OpenEXR image, or a channel by its full name.
///
/// # Errors
/// [`Error::File`], or [`Error::Image`]; also for pixels that are not finite.
pub fn load_image_over(
    path: &Path,
    background: DVec3,
    encoding: Encoding,
    layer: Option<&str>,
) -> Result<Image, Error> {
    let image = decode(&files::read(path)?, encoding, Some(background), layer).map_err(error(path))?;
    check_finite(image, path)
}

/// Columns and rows of an image that [`load_image_over`] reads, from the beginning of the file.
///
/// # Errors
/// [`Error::File`], or [`Error::Image`].
pub fn image_size(path: &Path) -> Result<(usize, usize), Error> {
    let reader = ImageReader::new(files::open(path)?).with_guessed_format();
    let reader = reader.map_err(|source| Error::File { action: "read", path: path.to_path_buf(), source })?;
    if reader.format() == Some(ImageFormat::OpenExr) {
        // The size may depend on the layer.
        return load_image_over(path, DVec3::ZERO, Encoding::File, None).map(|image| image.size());
    }
    let size = limited(reader, MAX_PIXELS as u64).and_then(|reader| {
        let (width, height) = reader.into_decoder()?.dimensions();
        Ok((width as usize, height as usize))
    });
    let checked = size.and_then(|(width, height)| check_size(width, height).map(|()| (width, height)));
    checked.map_err(error(path))
}

/// Refuses formats that are not read, and decoders that would take more memory than for so many pixels.
fn limited<R: BufRead + Seek>(
    mut reader: ImageReader<R>,
    pixels: u64,
) -> Result<ImageReader<R>, ImageProblem> {
    // A colour profile may be compressed to a few bytes.
    const PROFILE: u64 = 1 << 24;
    if !matches!(
        reader.format(),
        Some(
            ImageFormat::Png | ImageFormat::Jpeg | ImageFormat::Bmp | ImageFormat::OpenExr | ImageFormat::Hdr
        )
    ) {
        return Err(ImageProblem::Format);
    }
    let mut limits = Limits::default();
    // Four channels of single precision.
    limits.max_alloc = Some(16 * pixels.min(MAX_PIXELS as u64) + PROFILE);
    reader.limits(limits);
    Ok(reader)
}

fn check_finite(image: Image, path: &Path) -> Result<Image, Error> {
    match image.pixels.iter().position(|p| !p.is_finite()) {
        None => Ok(image),
        Some(i) => Err(error(path)(ImageProblem::NotFinite { x: i % image.width, y: i / image.width })),
    }
}

/// Reads an OpenEXR image without validation: negative values, NaN and infinities are kept.
///
/// # Errors
/// [`Error::File`], or [`Error::Image`].
pub fn read_exr(path: &Path) -> Result<Image, Error> {
    let bytes = files::read(path)?;
    if image::guess_format(&bytes).ok() != Some(ImageFormat::OpenExr) {
        return Err(error(path)(ImageProblem::Format));
    }
    decode(&bytes, by(true), None, None).map_err(error(path))
}

/// Checks whether a file of this length can hold that many pixels.
fn check_room(width: usize, height: usize, bytes: &[u8]) -> Result<(), ImageProblem> {
    check_size(width, height)?;
    if width * height <= bytes.len().saturating_mul(MAX_PIXELS_PER_BYTE) {
        Ok(())
    } else {
        Err(ImageProblem::Truncated { width, height })
    }
}

/// Checks the sizes for which the OpenEXR decoder allocates without checking them itself: of the stored data
/// window, which may differ from the image's, and of tiles.
fn check_exr(bytes: &[u8]) -> Result<(), ImageProblem> {
    let meta = MetaData::read_from_buffered(bytes, false)?;
    for header in &meta.headers {
        let window = header.shared_attributes.display_window.size;
        check_room(window.width(), window.height(), bytes)?;
        check_room(header.layer_size.width(), header.layer_size.height(), bytes)?;
        if let BlockDescription::Tiles(tiles) = header.blocks {
            check_room(tiles.tile_size.width(), tiles.tile_size.height(), bytes)?;
        }
    }
    Ok(())
}

/// The number of pixels that a PNG states first; the largest for other formats.
fn stated_pixels(bytes: &[u8]) -> u64 {
    // The signature, the length and the name of the first chunk; then columns and rows.
    let side = |at: usize| {
        let side = bytes.get(at..)?.first_chunk()?;
        Some(u64::from(u32::from_be_bytes(*side)))
    };
    match (image::guess_format(bytes), side(16), side(20)) {
        (Ok(ImageFormat::Png), Some(width), Some(height)) => width.saturating_mul(height),
        _ => MAX_PIXELS as u64,
    }
}

/// Textures are sRGB whatever their file declares, as in Mitsuba.
fn by(raw: bool) -> Encoding {
    if raw { Encoding::Linear } else { Encoding::Srgb }
}

fn decode(
    bytes: &[u8],
    encoding: Encoding,
    background: Option<DVec3>,
    layer: Option<&str>,
) -> Result<Image, ImageProblem> {
    let reader =
        ImageReader::new(Cursor::new(bytes)).with_guessed_format().map_err(|_| ImageProblem::Format)?;
    let reader = limited(reader, stated_pixels(bytes))?;
    if reader.format() == Some(ImageFormat::OpenExr) {
        return decode_exr(bytes, background, layer);
    }
    if let Some(layer) = layer {
        return Err(ImageProblem::NoLayers { layer: layer.to_owned() });
    }
    let decoder = reader.into_decoder()?;
    let (width, height) = decoder.dimensions();
    let (width, height) = (width as usize, height as usize);
    check_room(width, height, bytes)?;
    let mut pixels: Vec<DVec3> = with_room(width * height, "the pixels")?;
    // The decoder and the conversion below abort when an allocation fails, so that the memory is checked
    // first.
    let converted = (width * height).saturating_mul(size_of::<[f32; 4]>());
    let decoded = usize::try_from(decoder.total_bytes()).unwrap_or(usize::MAX);
    drop(with_room::<u8>(decoded.saturating_add(converted), "decoding the pixels")?);
    let image = DynamicImage::from_decoder(decoder)?;
    let transfer = match image {
        DynamicImage::ImageRgb32F(_) | DynamicImage::ImageRgba32F(_) => Transfer::LINEAR,
        _ => Transfer::of(encoding, bytes)?,
    };
    let linear = |x: f64| transfer.linear(x);
    match image {
        image if image.color().has_alpha() && background.is_some() => {
            let background = background.unwrap_or_default();
            let over = |p: [f32; 4]| {
                let [r, g, b, a] = p.map(f64::from);
                let colour = DVec3::new(r, g, b).map(linear);
                a * colour + (1.0 - a) * background
            };
            pixels.extend(image.into_rgba32f().pixels().map(|p| over(p.0)));
        }
        DynamicImage::ImageRgb32F(_) | DynamicImage::ImageRgba32F(_) => {
            pixels.extend(image.into_rgb32f().pixels().map(|p| DVec3::from_array(p.0.map(f64::from))));
        }
        // Exact for 8 bits as well: x · 257/65535 = x/255.
        _ => {
            let pixel = |x: u16| linear(f64::from(x) / 65535.0);
            pixels.extend(image.into_rgb16().pixels().map(|p| DVec3::from_array(p.0.map(pixel))));
        }
    }
    Ok(Image { width, height, pixels })
}

/// Colours are linear, and premultiplied by alpha.
fn decode_exr(bytes: &[u8], background: Option<DVec3>, layer: Option<&str>) -> Result<Image, ImageProblem> {
    check_exr(bytes)?;
    let Picture { width, height, pixels: stored, has_alpha } = layers::read(bytes, layer)?;
    let behind = background.filter(|_| has_alpha).unwrap_or(DVec3::ZERO);
    let mut pixels: Vec<DVec3> = with_room(width * height, "the pixels")?;
    pixels.extend(stored.iter().map(|p| {
        let [r, g, b, a] = p.map(f64::from);
        let colour = DVec3::new(r, g, b);
        if behind == DVec3::ZERO { colour } else { colour + (1.0 - a) * behind }
    }));
    Ok(Image { width, height, pixels })
}
