//! Errors of image files.

use super::MemoryError;

/// Problem with an image.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum ImageProblem {
    /// The image does not fit into memory.
    #[error(transparent)]
    Memory(#[from] MemoryError),
    /// The file cannot be decoded or encoded.
    #[error("{0}")]
    Codec(#[from] image::ImageError),
    /// An OpenEXR image cannot be encoded.
    #[error("{0}")]
    Exr(#[from] exr::error::Error),
    /// A PNG cannot be encoded.
    #[error("{0}")]
    Png(#[from] png::EncodingError),
    /// The colour space of a PNG is not supported.
    #[error(
        "its cICP chunk says colour primaries {primaries} and transfer function {transfer}; supported: primaries 1 with transfer \
         8 (linear) or 13 (sRGB): convert it, or give encoding = \"srgb\" or \"linear\""
    )]
    Colours {
        /// Colour primaries by ITU-T H.273.
        primaries: u8,
        /// Transfer characteristics by ITU-T H.273.
        transfer: u8,
    },
    /// An OpenEXR image without a picture, with several, or without the requested one.
    #[error(
        "{}: its channels are {channels}",
        asked.as_ref().map_or_else(
            || "which layer is the picture is not clear; expected channels R, G and B, or one, or the name of a layer".to_owned(),
            |layer| format!("no layer `{layer}` with channels R, G and B, or one"),
        )
    )]
    Layer {
        /// The requested layer, if any.
        asked: Option<String>,
        /// All channels of the file.
        channels: String,
    },
    /// A layer is requested of a format without layers.
    #[error("layer = \"{layer}\" is given, but only OpenEXR images have layers")]
    NoLayers {
        /// The layer.
        layer: String,
    },
    /// An OpenEXR image with subsampled channels.
    #[error("its channels do not have one number for each pixel; write them at full size, and not deep")]
    Sampling,
    /// The format is not supported.
    #[error("not a PNG, JPEG, BMP, OpenEXR or Radiance HDR image")]
    Format,
    /// An image without pixels, or with too many.
    #[error("{width}×{height} pixels; expected at least 1×1 and at most {limit} in all")]
    Size {
        /// Columns.
        width: usize,
        /// Rows.
        height: usize,
        /// The maximum number of pixels.
        limit: usize,
    },
    /// The number of pixels does not match the size.
    #[error("{found} pixels given for {width}×{height}")]
    Length {
        /// Columns.
        width: usize,
        /// Rows.
        height: usize,
        /// The number of pixels found.
        found: usize,
    },
    /// A pixel is NaN or infinite.
    #[error("the pixel in column {x}, row {y} (from the top left, from 0) is not finite")]
    NotFinite {
        /// Its column.
        x: usize,
        /// Its row.
        y: usize,
    },
    /// The file is too short for its size.
    #[error("{width}×{height} pixels are announced, which the file is too short for")]
    Truncated {
        /// Columns.
        width: usize,
        /// Rows.
        height: usize,
    },
    /// A pixel is negative where radiance is expected.
    #[error("the pixel in column {x}, row {y} (from the top left, from 0) is negative")]
    Negative {
        /// Its column.
        x: usize,
        /// Its row.
        y: usize,
    },
    /// A pixel of a reflectance or material parameter is negative or above its maximum, usually 1.
    #[error("the pixel in column {x}, row {y} (from the top left, from 0) is outside [0, {most}]")]
    Range {
        /// Its column.
        x: usize,
        /// Its row.
        y: usize,
        /// The maximum.
        most: f64,
    },
}
