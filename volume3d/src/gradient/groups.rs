//! Which samples share random numbers, and which are independent.

use crate::path::Sequence;

/// The samples of a cell are this many groups. Samples within a group are stratified against one another; groups
/// are independent, and their spread is the standard error.
pub(super) const GROUPS: usize = 8;

/// Cells in squares of this many a side share their random numbers: places within the cell and paths.
///
/// A pixel's derivative weighs the radiance on both sides of it with opposite signs, h′ V. That is where
/// antithetic samples on the film help (Bangaru et al. 2020); but samples that are reflected through one pixel's
/// centre serve that pixel alone. As Σ h(u + k) over whole pixels k is 1, noise that cells have in common drops out
/// of the derivative of all pixels at once. The price is noise that is correlated within a square.
pub(super) const TILE: usize = 16;

fn group_size(samples: usize) -> usize {
    samples.div_ceil(GROUPS).max(1)
}

/// The group of a sample.
pub(super) fn group(sample: usize, samples: usize) -> usize {
    sample / group_size(samples)
}

/// How many groups there are.
pub(super) fn groups(samples: usize) -> usize {
    samples.div_ceil(group_size(samples))
}

/// The random numbers of a sample.
pub(super) fn numbers(
    seed: u64,
    cell: (usize, usize),
    sample: usize,
    samples: usize,
    purpose: u64,
) -> Sequence {
    split_numbers(seed, cell, sample, samples, purpose, (0, 1))
}

/// The random numbers of one of several paths of a sample.
pub(super) fn split_numbers(
    seed: u64,
    (i, j): (usize, usize),
    sample: usize,
    samples: usize,
    purpose: u64,
    (path, paths): (usize, usize),
) -> Sequence {
    let size = group_size(samples);
    let address = [(i / TILE) as u64, (j / TILE) as u64, (sample / size) as u64, purpose];
    Sequence::new(seed, &address, (sample % size) * paths + path)
}
