//! Errors of the mask loss.

use glam::DVec3;

/// Why the mask loss cannot be computed.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum MaskLossError {
    /// The size of the mask is not that of the film.
    #[error("a mask of {found} pixels for a film of {width} x {height}")]
    Size {
        /// Columns of the film.
        width: usize,
        /// Rows of the film.
        height: usize,
        /// Pixels of the mask.
        found: usize,
    },
    /// The scene has no such implicit surface.
    #[error("implicit surface {index} is asked for, of {count}, counted from 0")]
    Surface {
        /// The index of the surface.
        index: usize,
        /// The number of implicit surfaces.
        count: usize,
    },
    /// The list of pixels is empty, so that no mean exists.
    #[error("a loss of no pixels")]
    NoPixels,
    /// The film has no such pixel.
    #[error("pixel {index} is asked for, of {count}, counted from 0")]
    Pixel {
        /// The index of the pixel.
        index: usize,
        /// The number of pixels.
        count: usize,
    },
    /// A setting is out of its range.
    #[error("the {what} of a loss of masks is {value}, but must be {range}")]
    Range {
        /// The name of the setting.
        what: &'static str,
        /// Its value.
        value: f64,
        /// The allowed range.
        range: &'static str,
    },
    /// φ or its gradient is not finite.
    #[error(
        "along the ray of the pixel in column {x}, row {y} φ or its gradient is not finite: φ = {value} at {point}"
    )]
    NotFinite {
        /// The pixel's column, from the left.
        x: usize,
        /// The pixel's row, from the top.
        y: usize,
        /// The point along the ray.
        point: DVec3,
        /// φ there.
        value: f64,
    },
}
