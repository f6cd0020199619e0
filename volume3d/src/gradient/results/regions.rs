//! Sums over regions of an image, with standard errors.

use glam::DVec3;

use crate::gradient::run::groups::{parts, scatter_to_variance};

/// Side of a block in pixels.
const BLOCK: usize = 8;

/// The whole image and its blocks of 8 × 8 pixels, each with its standard error.
///
/// Noise is correlated between pixels: they share samples through the filter, and in gradients random numbers
/// by design. The standard error of a sum of pixels therefore does **not** follow from those of the pixels;
/// it may be from a tenth of the root of the sum of their squares to twice that. Here it is estimated from 8
/// independent groups of samples over the whole region (fewer groups if there are fewer samples; infinite for
/// one sample), and is itself known to about 25 %.
#[derive(Clone, Debug, PartialEq)]
pub struct Regions {
    /// Sum of all pixels, by channel.
    pub total: DVec3,
    /// Standard error of `total`.
    pub total_error: DVec3,
    /// Standard error of the sum over pixels and channels, which share noise as well.
    pub sum_error: f64,
    /// Columns of blocks; the last may be narrower than 8 pixels.
    pub columns: usize,
    /// Rows of blocks.
    pub rows: usize,
    /// Mean of each block's pixels, row by row from the top.
    pub blocks: Vec<DVec3>,
    /// Standard error of each block's mean.
    pub block_errors: Vec<DVec3>,
}

impl Regions {
    /// Adds an independent estimate of another term.
    pub(in crate::gradient) fn add(&mut self, other: &Self) {
        let both = |a: DVec3, b: DVec3| (a * a + b * b).map(f64::sqrt);
        self.total += other.total;
        self.total_error = both(self.total_error, other.total_error);
        self.sum_error = self.sum_error.hypot(other.sum_error);
        self.blocks.iter_mut().zip(&other.blocks).for_each(|(a, b)| *a += *b);
        self.block_errors.iter_mut().zip(&other.block_errors).for_each(|(a, b)| *a = both(*a, *b));
    }
}

/// Accumulator of regions: sums by groups of samples.
#[derive(Clone, Debug)]
pub(in crate::gradient) struct RegionSums {
    width: usize,
    columns: usize,
    rows: usize,
    height: usize,
    groups: usize,
    whole: Vec<DVec3>,
    /// Sums by block and group.
    blocks: Vec<DVec3>,
}

impl RegionSums {
    pub(in crate::gradient) fn new(width: usize, height: usize, groups: usize) -> Self {
        let (columns, rows) = (width.div_ceil(BLOCK), height.div_ceil(BLOCK));
        let zeros = |n| vec![DVec3::ZERO; n];
        Self {
            width,
            columns,
            rows,
            height,
            groups,
            whole: zeros(groups),
            blocks: zeros(columns * rows * groups),
        }
    }

    /// Adds the sum of a group's samples in a pixel.
    pub(in crate::gradient) fn add(&mut self, (x, y): (usize, usize), group: usize, sum: DVec3) {
        self.whole[group] += sum;
        let block = y / BLOCK * self.columns + x / BLOCK;
        self.blocks[block * self.groups + group] += sum;
    }

    /// The result for `samples` samples per pixel.
    pub(in crate::gradient) fn finish(&self, samples: usize) -> Regions {
        let (total, total_error) = statistics(&self.whole, samples);
        let of_channels: Vec<DVec3> = self.whole.iter().map(|s| DVec3::splat(s.element_sum())).collect();
        let (_, sum_error) = statistics(&of_channels, samples);
        let side = |i: usize, n: usize| (n - i * BLOCK).min(BLOCK) as f64;
        let block = |(b, sums): (usize, &[DVec3])| {
            let pixels = side(b % self.columns, self.width) * side(b / self.columns, self.height);
            let (sum, error) = statistics(sums, samples);
            (sum / pixels, error / pixels)
        };
        let (blocks, block_errors) = self.blocks.chunks(self.groups).enumerate().map(block).unzip();
        let (columns, rows) = (self.columns, self.rows);
        Regions { total, total_error, sum_error: sum_error.x, columns, rows, blocks, block_errors }
    }
}

/// The mean over samples from sums of independent groups, and its standard error.
fn statistics(sums: &[DVec3], samples: usize) -> (DVec3, DVec3) {
    let (sum, factor): (DVec3, f64) = (sums.iter().sum(), scatter_to_variance(samples));
    let scatter: DVec3 = sums.iter().zip(parts(samples)).map(|(s, part)| (*s - sum * part).powf(2.0)).sum();
    let error = if factor.is_finite() { (scatter * factor).map(f64::sqrt) } else { DVec3::INFINITY };
    (sum / samples as f64, error)
}
