//! Which samples share random numbers, and which are independent.

use std::cell::OnceCell;
use std::ops::Range;

use crate::path::{Draws, PreparedSequence, Sequence};

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

/// How many groups there are: 8, or as many as there are samples if these are fewer.
pub(super) fn groups(samples: usize) -> usize {
    samples.min(GROUPS)
}

/// The samples of a group: groups differ by one sample at most.
pub(super) fn group_range(group: usize, samples: usize) -> Range<usize> {
    let start = |group: usize| group * samples / groups(samples);
    start(group)..start(group + 1)
}

/// How many samples the largest group has.
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

/// The random numbers of all samples of a cell, those that cells share made once for them all.
pub(super) struct CellNumbers {
    seed: u64,
    purpose: u64,
    /// Paths of a sample: all those of a group are stratified against one another.
    paths: usize,
    /// How many pairs of a path are made ahead of time, if they are not too many.
    pairs: usize,
    keeps_row: bool,
    samples: usize,
    /// Some squares of one row, in no order.
    tiles: Vec<TileNumbers>,
    /// The place among them of the one that has been prepared.
    current: usize,
}

/// The random numbers of a square of cells.
struct TileNumbers {
    place: (usize, usize),
    /// Made when first asked for.
    groups: Vec<OnceCell<PreparedSequence>>,
}

/// Most pairs that are kept: 16 MiB of them.
const MOST_PREPARED: usize = 1 << 20;

impl CellNumbers {
    /// Of so many paths a sample that draw about so many pairs each; it may be less or more.
    pub(super) fn new(seed: u64, purpose: u64, paths: usize, pairs: usize) -> Self {
        Self { seed, purpose, paths, pairs, keeps_row: false, samples: 0, tiles: vec![], current: 0 }
    }

    /// The same for whom takes cells row by row: squares are kept until the rows have passed them.
    pub(super) fn keeping_row(self) -> Self {
        Self { keeps_row: true, ..self }
    }

    /// Begins those of a cell with so many samples.
    pub(super) fn prepare(&mut self, (i, j): (usize, usize), samples: usize) {
        let place = (i / TILE, j / TILE);
        let is_of_row = |tile: &TileNumbers| tile.place.1 == place.1;
        if !(self.samples == samples && self.tiles.first().is_some_and(is_of_row)) {
            self.tiles.clear();
        }
        self.samples = samples;
        if self.tiles.get(self.current).is_some_and(|tile| tile.place == place) {
            return;
        }
        let known = self.tiles.iter().position(|tile| tile.place == place);
        self.current = known.unwrap_or_else(|| {
            // Where not all are kept, it is the first ones: the oldest is the one that is asked for next.
            self.tiles.truncate(self.most_kept() - 1);
            let mut groups = vec![];
            groups.resize_with(self::groups(samples), OnceCell::new);
            self.tiles.push(TileNumbers { place, groups });
            self.tiles.len() - 1
        });
    }

    /// How many pairs of a path are made ahead of time.
    fn depth(&self) -> usize {
        self.pairs.min(MOST_PREPARED / (self.samples * self.paths))
    }

    /// How many squares are kept.
    fn most_kept(&self) -> usize {
        let pairs = self.samples * self.paths * self.depth();
        if self.keeps_row { (MOST_PREPARED / pairs.max(1)).max(1) } else { 1 }
    }

    /// The group of a sample, and the numbers of one of its paths in the cell that has been prepared; of the only one they are its
    /// [`numbers`], bit for bit.
    pub(super) fn of(&self, sample: usize, path: usize) -> (usize, Draws<'_>) {
        let &Self { seed, purpose, paths, samples, .. } = self;
        let tile = self.tiles.get(self.current).expect("a cell has been prepared");
        let group = group(sample, samples);
        let of_group = group_range(group, samples);
        let prepared = tile.groups[group].get_or_init(|| {
            let size = of_group.len() * paths;
            PreparedSequence::new(seed, &address(tile.place, group, purpose), size, self.depth())
        });
        (group, prepared.sample((sample - of_group.start) * paths + path))
    }
}

#[cfg(test)]
mod tests {
    use rand::Rng as _;

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

    /// Whatever is kept, and however few: many samples leave room for two squares.
    #[test]
    fn kept_numbers_are_those_of_the_cell() {
        let mut kept = CellNumbers::new(3, 1, 1, 2).keeping_row();
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
            let mut rng = flatland::random::stream(1, &[samples as u64]);
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
