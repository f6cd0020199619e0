//! Why a loss of masks cannot be computed.

use glam::DVec3;

/// Why there is no loss.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum MaskLossError {
    /// The mask is that of another film.
    #[error("a mask of {found} pixels for a film of {width} x {height}")]
    Size {
        /// Columns of the film.
        width: usize,
        /// Its rows.
        height: usize,
        /// Pixels of the mask.
        found: usize,
    },
    /// The scene has no such implicit surface.
    #[error("implicit surface {index} is asked for, of {count}, counted from 0")]
    Surface {
        /// The surface.
        index: usize,
        /// How many there are.
        count: usize,
    },
    /// There are no pixels, over which a mean could be taken.
    #[error("a loss of no pixels")]
    NoPixels,
    /// The film has no such pixel.
    #[error("pixel {index} is asked for, of {count}, counted from 0")]
    Pixel {
        /// The pixel.
        index: usize,
        /// How many there are.
        count: usize,
    },
    /// A number is out of its range.
    #[error("the {what} of a loss of masks is {value}, but must be {range}")]
    Range {
        /// Which number.
        what: &'static str,
        /// Its value.
        value: f64,
        /// What it must be.
        range: &'static str,
    },
    /// The function of the surface, or its gradient, is not a number.
    #[error(
        "along the ray of the pixel in column {x}, row {y} φ or its gradient is not finite: φ = {value} at {point}"
    )]
    NotFinite {
        /// The pixel's column, from the left.
        x: usize,
        /// Its row, from the top.
        y: usize,
        /// Where along the ray.
        point: DVec3,
        /// φ there.
        value: f64,
    },
}
