//! Image losses and their adjoints.

use glam::DVec3;

use crate::Image;

/// Loss of an image I against a target T: a mean over pixels and channels.
///
/// All are functions of the *noisy* image: a squared loss of an unbiased image with variance σ² is too large
/// by σ². The adjoints of [`L2`](Self::L2), [`Relative`](Self::Relative) and [`Multiscale`](Self::Multiscale)
/// are linear in I, so that the gradient, from samples independent of I, is an unbiased estimate of that of
/// the loss of the true image; that of [`L1`](Self::L1) has a bias that vanishes with the number of samples.
#[derive(Clone, Copy, Debug, PartialEq)]
#[non_exhaustive]
pub enum Loss {
    /// Mean of (I − T)². The gradient is unbiased. Bright pixels weigh most.
    L2,
    /// Mean of |I − T|: outliers weigh less, and noise of the image near the target pulls both ways.
    L1,
    /// Mean of (I − T)²/(T² + ε²): dark pixels weigh as much as bright ones. The denominator depends on the
    /// target only and has no derivative: the gradient is unbiased. ε > 0 is the radiance below which
    /// darkness no longer counts, such as 0.01.
    Relative {
        /// ε.
        epsilon: f64,
    },
    /// The mean of L2 over `levels` resolutions, each half the one before: means over blocks of 2 × 2, so
    /// that displacements of many pixels have a gradient as well. The gradient is unbiased. 1 level is L2.
    Multiscale {
        /// The number of resolutions.
        levels: usize,
    },
}

/// Images that cannot be compared.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum LossError {
    /// An image whose number of pixels is not that of its size, or an empty one.
    #[error("the {what} is stated to have {} x {} pixels, but holds {pixels}", size.0, size.1)]
    Pixels {
        /// "image" or "target".
        what: &'static str,
        /// Columns and rows.
        size: (usize, usize),
        /// Its pixels.
        pixels: usize,
    },
    /// The sizes differ.
    #[error("an image of {} x {} pixels cannot be compared with a target of {} x {}", image.0, image.1, target.0, target.1)]
    Size {
        /// Columns and rows of the image.
        image: (usize, usize),
        /// Columns and rows of the target.
        target: (usize, usize),
    },
    /// The ε of a relative loss is not positive.
    #[error("the epsilon of a relative loss is {epsilon}, but must be positive")]
    Epsilon {
        /// ε.
        epsilon: f64,
    },
    /// A pixel is not finite.
    #[error("the {what} in column {x}, row {y} (from the top left, from 0) is not finite")]
    NotFinite {
        /// "image" or "target".
        what: &'static str,
        /// Its column.
        x: usize,
        /// Its row.
        y: usize,
    },
}

impl Loss {
    /// The loss of an image, and the adjoint ∂L/∂I of every pixel.
    ///
    /// # Errors
    /// A [`LossError`] if sizes differ, a pixel is not finite, or ε is not positive.
    pub fn of(self, image: &Image, target: &Image) -> Result<(f64, Image), LossError> {
        for (what, i) in [("image", image), ("target", target)] {
            if i.pixels.len() != i.width * i.height || i.pixels.is_empty() {
                return Err(LossError::Pixels { what, size: i.size(), pixels: i.pixels.len() });
            }
        }
        if image.size() != target.size() {
            return Err(LossError::Size { image: image.size(), target: target.size() });
        }
        for (what, image) in [("image", image), ("target", target)] {
            if let Some(at) = image.pixels.iter().position(|p| !p.is_finite()) {
                return Err(LossError::NotFinite { what, x: at % image.width, y: at / image.width });
            }
        }
        if let Self::Relative { epsilon } = self
            && !(epsilon > 0.0 && epsilon.is_finite())
        {
            return Err(LossError::Epsilon { epsilon });
        }
        let count = 3.0 * image.pixels.len() as f64;
        let each = |f: &dyn Fn(DVec3, DVec3) -> (f64, DVec3)| {
            let (mut loss, mut adjoint) = (0.0, Vec::with_capacity(image.pixels.len()));
            for (i, t) in image.pixels.iter().zip(&target.pixels) {
                let (value, slope) = f(*i - *t, *t);
                loss += value;
                adjoint.push(slope / count);
            }
            (loss / count, image.with_pixels(adjoint))
        };
        Ok(match self {
            Self::L2 => each(&|d, _| (d.length_squared(), 2.0 * d)),
            Self::L1 => each(&|d, _| (d.abs().element_sum(), d.signum() * sign_of_nothing(d))),
            Self::Relative { epsilon } => each(&|d, t| {
                let scale = t * t + epsilon * epsilon;
                ((d * d / scale).element_sum(), 2.0 * d / scale)
            }),
            Self::Multiscale { levels } => {
                let difference: Vec<DVec3> =
                    image.pixels.iter().zip(&target.pixels).map(|(i, t)| *i - *t).collect();
                let (loss, adjoint) = multiscale(image.size(), &difference, levels.max(1));
                (loss, image.with_pixels(adjoint))
            }
        })
    }
}

/// 0 where a number is 0, else 1.
fn sign_of_nothing(d: DVec3) -> DVec3 {
    DVec3::from_array(d.to_array().map(|x| f64::from(x != 0.0)))
}

/// The mean over levels of the mean square, and its derivative by every pixel.
fn multiscale(size: (usize, usize), difference: &[DVec3], levels: usize) -> (f64, Vec<DVec3>) {
    let (mut loss, mut pyramid) = (0.0, vec![(size, difference.to_vec())]);
    for _ in 1..levels {
        let (size, finer) = pyramid.last().expect("the image itself");
        if *size == (1, 1) {
            break;
        }
        let coarser = halved(*size, finer);
        pyramid.push(coarser);
    }
    let count = pyramid.len() as f64;
    let mut adjoint: Option<((usize, usize), Vec<DVec3>)> = None;
    for (size, level) in pyramid.into_iter().rev() {
        let scale = 1.0 / (3.0 * level.len() as f64 * count);
        loss += scale * level.iter().map(|d| d.length_squared()).sum::<f64>();
        let mut slopes: Vec<DVec3> = level.iter().map(|d| 2.0 * scale * *d).collect();
        if let Some((coarse, above)) = adjoint {
            for (i, slope) in slopes.iter_mut().enumerate() {
                let block = (i / size.0 / 2) * coarse.0 + (i % size.0) / 2;
                *slope += above[block] / block_size(size, block % coarse.0, block / coarse.0);
            }
        }
        adjoint = Some((size, slopes));
    }
    (loss, adjoint.expect("the image itself").1)
}

/// Means over blocks of 2 × 2; at an odd border the blocks are smaller.
fn halved(size: (usize, usize), image: &[DVec3]) -> ((usize, usize), Vec<DVec3>) {
    let half = (size.0.div_ceil(2), size.1.div_ceil(2));
    let mut means = vec![DVec3::ZERO; half.0 * half.1];
    for (i, pixel) in image.iter().enumerate() {
        let (x, y) = ((i % size.0) / 2, i / size.0 / 2);
        means[y * half.0 + x] += *pixel / block_size(size, x, y);
    }
    (half, means)
}

/// The number of pixels of a block.
fn block_size(size: (usize, usize), x: usize, y: usize) -> f64 {
    ((size.0 - 2 * x).min(2) * (size.1 - 2 * y).min(2)) as f64
}
