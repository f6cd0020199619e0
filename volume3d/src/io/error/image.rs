//! Why an image cannot be read or written.

use super::MemoryError;

/// What is wrong with an image.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum ImageProblem {
    /// There is no room for it in memory.
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
    /// A PNG in colours that are not read.
    #[error(
        "its cICP chunk says colour primaries {primaries} and transfer function {transfer}; supported: primaries 1 with transfer \
         8 (linear) or 13 (sRGB): convert it, or give encoding = \"srgb\" or \"linear\""
    )]
    Colours {
        /// By ITU-T H.273.
        primaries: u8,
        /// By ITU-T H.273.
        transfer: u8,
    },
    /// An OpenEXR image with none, or with several pictures, or not with that which is asked for.
    #[error(
        "{}: its channels are {channels}",
        asked.as_ref().map_or_else(
            || "which layer is the picture is not clear; expected channels R, G and B, or one, or the name of a layer".to_owned(),
            |layer| format!("no layer `{layer}` with channels R, G and B, or one"),
        )
    )]
    Layer {
        /// The layer that is asked for, if one is.
        asked: Option<String>,
        /// All channels of the file.
        channels: String,
    },
    /// A layer is asked for of what has none.
    #[error("layer = \"{layer}\" is given, but only OpenEXR images have layers")]
    NoLayers {
        /// The layer.
        layer: String,
    },
    /// An OpenEXR image whose channels do not have one number for each pixel.
    #[error("its channels do not have one number for each pixel; write them at full size, and not deep")]
    Sampling,
    /// Not one of the formats that are read.
    #[error("not a PNG, JPEG, BMP, OpenEXR or Radiance HDR image")]
    Format,
    /// An image without pixels, or with more than can be dealt with.
    #[error("{width}×{height} pixels; expected at least 1×1 and at most {limit} in all")]
    Size {
        /// Columns.
        width: usize,
        /// Rows.
        height: usize,
        /// The largest number of pixels.
        limit: usize,
    },
    /// The number of pixels is not that of the size.
    #[error("{found} pixels given for {width}×{height}")]
    Length {
        /// Columns.
        width: usize,
        /// Rows.
        height: usize,
        /// How many pixels there are.
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
    /// A pixel is negative or above 1, or what else it may be at most, where reflectance or a number of a material is expected.
    #[error("the pixel in column {x}, row {y} (from the top left, from 0) is outside [0, {most}]")]
    Range {
        /// Its column.
        x: usize,
        /// Its row.
        y: usize,
        /// What it may be at most.
        most: f64,
    },
}
