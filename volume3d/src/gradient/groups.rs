//! Which samples share random numbers, and which are independent.
//!
//! Cells of an image have numbers of their own; cells of a gradient share theirs in squares.

use std::cell::OnceCell;
use std::ops::Range;

use flatland::random::stream;
use rand::Rng as _;

use crate::path::{Draws, PreparedSequence, Sequence};

/// The samples of a cell are this many groups. Samples within a group are stratified against one another; groups
/// are independent, and their spread is the standard error.
pub(super) const GROUPS: usize = 8;

/// Cells in squares of this many a side share the random numbers of a gradient: places within the cell and
/// paths.
///
/// A pixel's derivative weighs the radiance on both sides of it with opposite signs, h′ V. That is where
/// antithetic samples on the film help (Bangaru et al. 2020); but samples that are reflected through one pixel's
/// centre serve that pixel alone. As Σ h(u + k) over whole pixels k is 1, noise that cells have in common drops out
/// of the derivative of all pixels at once. The price is noise that is correlated within a square.
pub(super) const TILE: usize = 16;

/// Number of groups: 8, or one a sample if there are fewer samples.
pub(super) fn groups(samples: usize) -> usize {
    samples.min(GROUPS)
}

/// The samples of a group: groups differ by one sample at most.
pub(super) fn group_range(group: usize, samples: usize) -> Range<usize> {
    let start = |group: usize| group * samples / groups(samples);
    start(group)..start(group + 1)
}

/// Samples of the largest group.
pub(super) fn group_size(samples: usize) -> usize {
    samples.div_ceil(GROUPS).max(1)
}

/// The group of a sample: the last that begins at it or before.
pub(super) fn group(sample: usize, samples: usize) -> usize {
    ((sample + 1) * groups(samples) - 1) / samples
}

/// The parts nₖ/n that groups are of all samples.
pub(super) fn parts(samples: usize) -> impl Iterator<Item = f64> + Clone {
    (0..groups(samples)).map(move |k| group_range(k, samples).len() as f64 / samples as f64)
}

/// What Σₖ (sₖ − nₖ m)² is to be multiplied with for the variance of m, the mean of all samples, if sₖ are the sums of groups: infinite for
/// one group.
///
/// With a variance nₖ σ² of each sum the expectation is σ² (n − Σ nₖ²/n), and the variance of m is σ²/n.
pub(super) fn scatter_to_variance(samples: usize) -> f64 {
    let squares: f64 = parts(samples).map(|part| part * part).sum();
    if squares < 1.0 { 1.0 / ((samples as f64).powi(2) * (1.0 - squares)) } else { f64::INFINITY }
}

/// The random numbers of a sample.
pub(super) fn numbers(
    seed: u64,
    (i, j): (usize, usize),
    sample: usize,
    samples: usize,
    purpose: u64,
) -> Sequence {
    let group = group(sample, samples);
    let address = address((i / TILE, j / TILE), group, purpose);
    Sequence::new(seed, &address, sample - group_range(group, samples).start)
}

fn address((i, j): (usize, usize), group: usize, purpose: u64) -> [u64; 4] {
    [i as u64, j as u64, group as u64, purpose]
}

/// Sequences that are made once, by group of samples.
#[derive(Default)]
struct Nets {
    samples: usize,
    /// Paths of a sample: all those of a group are stratified against one another.
    paths: usize,
    /// Pairs of a path that are made ahead of time.
    depth: usize,
    /// Made when first asked for.
    groups: Vec<OnceCell<PreparedSequence>>,
}

/// Most pairs that are kept: 16 MiB of them.
const MOST_PREPARED: usize = 1 << 20;

impl Nets {
    /// `paths` per sample, each drawing about `pairs` pairs.
    fn new(samples: usize, paths: usize, pairs: usize) -> Self {
        let groups = (0..groups(samples)).map(|_| OnceCell::new()).collect();
        Self { samples, paths, depth: pairs.min(MOST_PREPARED / (samples * paths)), groups }
    }

    /// The group of a sample, and the numbers of one of its paths, given the address of the sequence of a
    /// group.
    fn of(
        &self,
        seed: u64,
        (sample, path): (usize, usize),
        address: impl Fn(usize) -> [u64; 4],
    ) -> (usize, Draws<'_>) {
        let &Self { samples, paths, depth, .. } = self;
        let group = group(sample, samples);
        let of_group = group_range(group, samples);
        let prepared = self.groups[group]
            .get_or_init(|| PreparedSequence::new(seed, &address(group), of_group.len() * paths, depth));
        (group, prepared.sample((sample - of_group.start) * paths + path))
    }
}

/// The random numbers of all samples of a cell, those that cells share made once for them all.
pub(super) struct CellNumbers {
    seed: u64,
    purpose: u64,
    paths: usize,
    pairs: usize,
    /// The square of the cell that has been prepared, and its sequences.
    place: (usize, usize),
    nets: Nets,
}

impl CellNumbers {
    /// `paths` per sample, each drawing about `pairs` pairs.
    pub(super) fn new(seed: u64, purpose: u64, paths: usize, pairs: usize) -> Self {
        Self { seed, purpose, paths, pairs, place: (0, 0), nets: Nets::default() }
    }

    /// Begins those of a cell with so many samples.
    pub(super) fn prepare(&mut self, (i, j): (usize, usize), samples: usize) {
        let place = (i / TILE, j / TILE);
        if self.nets.samples != samples || self.place != place {
            (self.place, self.nets) = (place, Nets::new(samples, self.paths, self.pairs));
        }
    }

    /// The group of a sample, and the numbers of one of its paths in the cell that has been prepared; of the
    /// only one they are its [`numbers`], bit for bit.
    pub(super) fn of(&self, sample: usize, path: usize) -> (usize, Draws<'_>) {
        self.nets.of(self.seed, (sample, path), |group| address(self.place, group, self.purpose))
    }
}

/// The random numbers of an image: all cells share sequences, which each shifts by numbers of its own.
/// Samples of different cells are uncorrelated, and neighbouring pixels have no noise in common but that of
/// samples that both see.
pub(super) struct ImageNumbers {
    seed: u64,
    purpose: u64,
    nets: Nets,
}

impl ImageNumbers {
    /// `samples` per cell, each drawing about `pairs` pairs.
    pub(super) fn new(seed: u64, purpose: u64, samples: usize, pairs: usize) -> Self {
        Self { seed, purpose, nets: Nets::new(samples, 1, pairs) }
    }

    /// Key by which a cell shifts the common sequence.
    pub(super) fn key(&self, (i, j): (usize, usize)) -> u64 {
        stream(self.seed, &[i as u64, j as u64, self.purpose]).next_u64()
    }

    /// The group of a sample, and its numbers in the cell with a key.
    pub(super) fn of(&self, key: u64, sample: usize) -> (usize, Draws<'_>) {
        let (group, numbers) =
            self.nets.of(self.seed, (sample, 0), |group| [0, 0, group as u64, self.purpose]);
        (group, numbers.shifted(key))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Of 8 samples on there are 8 groups, which differ by one sample at most.
    #[test]
    fn groups_are_eight_of_nearly_one_size() {
        for samples in 1..300 {
            assert_eq!(groups(samples), samples.min(8));
            let sizes: Vec<usize> = (0..groups(samples)).map(|k| group_range(k, samples).len()).collect();
            let (least, most) = (sizes.iter().min().unwrap(), sizes.iter().max().unwrap());
            assert!(*least >= 1 && most - least <= 1 && *most == group_size(samples), "{samples}: {sizes:?}");
            assert_eq!(sizes.iter().sum::<usize>(), samples);
            for sample in 0..samples {
                assert!(
                    group_range(group(sample, samples), samples).contains(&sample),
                    "{sample} of {samples}"
                );
            }
            assert!((parts(samples).sum::<f64>() - 1.0).abs() < 1e-12);
        }
    }

    /// Whatever is kept, and however few pairs.
    #[test]
    fn kept_numbers_are_those_of_the_cell() {
        let mut kept = CellNumbers::new(3, 1, 1, 2);
        for samples in [3, MOST_PREPARED / 5, 3] {
            for (i, j) in (0..3).flat_map(|j| (0..4).map(move |i| (i * TILE, j * TILE / 2))) {
                kept.prepare((i, j), samples);
                let (_, mut own) = kept.of(samples - 1, 0);
                let mut expected = numbers(3, (i, j), samples - 1, samples, 1);
                for _ in 0..3 {
                    assert_eq!(own.pair(), expected.pair());
                }
            }
        }
    }

    /// Of means of independent numbers, whatever their number: as often as not a last group is smaller.
    #[test]
    fn variances_are_told_without_bias() {
        const RUNS: usize = 20_000;
        for samples in [2, 7, 8, 9, 17, 33, 65, 81] {
            let mut rng = stream(1, &[samples as u64]);
            let mut told = 0.0;
            for _ in 0..RUNS {
                let mut sums = vec![0.0; groups(samples)];
                for k in 0..samples {
                    sums[group(k, samples)] += (rng.next_u64() >> 11) as f64 / (1u64 << 53) as f64;
                }
                let sum: f64 = sums.iter().sum();
                let scatter: f64 = sums.iter().zip(parts(samples)).map(|(s, p)| (s - sum * p).powi(2)).sum();
                told += scatter * scatter_to_variance(samples) / RUNS as f64;
            }
            let ratio = told * 12.0 * samples as f64;
            // A variance from g groups scatters by the root of 2/(g − 1) at most: 1.4/√20,000, five times.
            assert!((ratio - 1.0).abs() < 0.05, "{samples}: {ratio}");
        }
        assert!(scatter_to_variance(1).is_infinite());
    }
}
