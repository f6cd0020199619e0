//! Groups of samples: which share random numbers, and which are independent.
//!
//! Each cell of an image has its own random numbers; cells of a gradient share theirs within squares.

use std::cell::OnceCell;
use std::ops::Range;

use flatland::random::stream;
use rand::Rng as _;

use crate::path::{Draws, PreparedSequence, Sequence};

/// Number of groups of a cell's samples. Samples of one group are stratified against one another; groups are
/// independent, and the standard error is estimated from their spread.
pub(in crate::gradient) const GROUPS: usize = 8;

/// Side, in cells, of the squares that share a gradient's random numbers: positions within the cell, and
/// paths.
///
/// A pixel's derivative weighs the radiance on its two sides with opposite signs, h′ V. Antithetic samples on
/// the film help there (Bangaru et al. 2020), but samples reflected at one pixel's centre serve only that
/// pixel. As Σ h(u + k) over integer offsets k is 1, noise common to neighbouring cells cancels in the
/// derivatives of all pixels at once. The price is noise that is correlated within a square.
pub(in crate::gradient) const TILE: usize = 16;

/// Number of groups: 8, or one per sample if there are fewer samples.
pub(in crate::gradient) fn groups(samples: usize) -> usize {
    samples.min(GROUPS)
}

/// Samples of a group; group sizes differ by at most one.
pub(in crate::gradient) fn group_range(group: usize, samples: usize) -> Range<usize> {
    let start = |group: usize| group * samples / groups(samples);
    start(group)..start(group + 1)
}

/// Size of the largest group.
pub(in crate::gradient) fn group_size(samples: usize) -> usize {
    samples.div_ceil(GROUPS).max(1)
}

/// Group of a sample.
pub(in crate::gradient) fn group(sample: usize, samples: usize) -> usize {
    ((sample + 1) * groups(samples) - 1) / samples
}

/// Fractions nₖ/n of the samples in each group.
pub(in crate::gradient) fn parts(samples: usize) -> impl Iterator<Item = f64> + Clone {
    (0..groups(samples)).map(move |k| group_range(k, samples).len() as f64 / samples as f64)
}

/// Factor from Σₖ (sₖ − nₖ m)² to the variance of m, with sₖ the sums of groups and m the mean of all
/// samples; infinite for one group.
///
/// If the sums have variances nₖ σ², the expectation is σ² (n − Σ nₖ²/n), and the variance of m is σ²/n.
pub(in crate::gradient) fn scatter_to_variance(samples: usize) -> f64 {
    let squares: f64 = parts(samples).map(|part| part * part).sum();
    if squares < 1.0 { 1.0 / ((samples as f64).powi(2) * (1.0 - squares)) } else { f64::INFINITY }
}

/// Random numbers of a sample.
pub(in crate::gradient) fn numbers(
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

/// Prepared sequences, by group of samples.
#[derive(Default)]
struct Nets {
    samples: usize,
    /// Paths per sample; all paths of a group are stratified against one another.
    paths: usize,
    /// Pairs prepared per path.
    depth: usize,
    /// Sequences, prepared when first needed.
    groups: Vec<OnceCell<PreparedSequence>>,
}

/// Largest number of prepared pairs: 16 MiB.
const MOST_PREPARED: usize = 1 << 20;

impl Nets {
    /// `paths` per sample, each drawing about `pairs` 2-D samples.
    fn new(samples: usize, paths: usize, pairs: usize) -> Self {
        let groups = (0..groups(samples)).map(|_| OnceCell::new()).collect();
        Self { samples, paths, depth: pairs.min(MOST_PREPARED / (samples * paths)), groups }
    }

    /// Group of a sample and random numbers of one of its paths, given the address of a group's sequence.
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

/// Random numbers of a cell's samples; those that cells share are prepared once.
pub(in crate::gradient) struct CellNumbers {
    seed: u64,
    purpose: u64,
    paths: usize,
    pairs: usize,
    /// The prepared square of cells, and its sequences.
    place: (usize, usize),
    nets: Nets,
}

impl CellNumbers {
    /// `paths` per sample, each drawing about `pairs` 2-D samples.
    pub(in crate::gradient) fn new(seed: u64, purpose: u64, paths: usize, pairs: usize) -> Self {
        Self { seed, purpose, paths, pairs, place: (0, 0), nets: Nets::default() }
    }

    /// Prepares a cell with the given number of samples.
    pub(in crate::gradient) fn prepare(&mut self, (i, j): (usize, usize), samples: usize) {
        let place = (i / TILE, j / TILE);
        if self.nets.samples != samples || self.place != place {
            (self.place, self.nets) = (place, Nets::new(samples, self.paths, self.pairs));
        }
    }

    /// Group of a sample and random numbers of one of its paths in the prepared cell; with one path they
    /// equal [`numbers`], bit for bit.
    pub(in crate::gradient) fn of(&self, sample: usize, path: usize) -> (usize, Draws<'_>) {
        self.nets.of(self.seed, (sample, path), |group| address(self.place, group, self.purpose))
    }
}

/// Random numbers of an image: all cells share sequences, each with its own digital shift. Samples of
/// different cells are uncorrelated; neighbouring pixels share only the noise of samples in both of their
/// filters.
pub(in crate::gradient) struct ImageNumbers {
    seed: u64,
    purpose: u64,
    nets: Nets,
}

impl ImageNumbers {
    /// `samples` per cell, each drawing about `pairs` 2-D samples.
    pub(in crate::gradient) fn new(seed: u64, purpose: u64, samples: usize, pairs: usize) -> Self {
        Self { seed, purpose, nets: Nets::new(samples, 1, pairs) }
    }

    /// Key of a cell's shift of the common sequence.
    pub(in crate::gradient) fn key(&self, (i, j): (usize, usize)) -> u64 {
        stream(self.seed, &[i as u64, j as u64, self.purpose]).next_u64()
    }

    /// Group of a sample, and its random numbers in the cell with a key.
    pub(in crate::gradient) fn of(&self, key: u64, sample: usize) -> (usize, Draws<'_>) {
        let (group, numbers) =
            self.nets.of(self.seed, (sample, 0), |group| [0, 0, group as u64, self.purpose]);
        (group, numbers.shifted(key))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// From 8 samples on there are 8 groups, whose sizes differ by at most one.
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

    /// Holds for any number of prepared pairs.
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

    /// Variances of means of independent numbers, for any number of samples; often the groups differ in size.
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
            // The relative standard deviation of a variance from g groups is at most √(2/(g − 1)); tolerance:
            // five times 1.4/√20,000.
            assert!((ratio - 1.0).abs() < 0.05, "{samples}: {ratio}");
        }
        assert!(scatter_to_variance(1).is_infinite());
    }
}
