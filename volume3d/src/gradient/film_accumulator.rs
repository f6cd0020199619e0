//! Sums of samples over a film, with the variance of their mean.

use std::collections::VecDeque;

use glam::DVec3;

use super::film::FilmPlane;
use super::groups::{groups, parts, scatter_to_variance};
use super::regions::RegionSums;

/// What the samples of one row of cells add to the rows of pixels they reach: sums of K quantities, one for each
/// group of samples.
#[derive(Clone, Debug)]
pub(crate) struct RowSums<const K: usize> {
    columns: usize,
    groups: usize,
    samples: usize,
    reach: usize,
    /// By row of the neighbourhood, column and group.
    sums: Vec<[f64; K]>,
}

impl<const K: usize> RowSums<K> {
    pub(crate) fn new(film: &FilmPlane, samples: usize) -> Self {
        let groups = groups(samples);
        let size = (2 * film.reach + 1) * film.columns * groups;
        Self { columns: film.columns, groups, samples, reach: film.reach, sums: vec![[0.0; K]; size] }
    }

    /// Adds the quantities of a sample of a group for the image's column x in row b of the neighbourhood.
    pub(crate) fn add(&mut self, group: usize, b: usize, x: usize, quantities: &[f64; K]) {
        for (sum, quantity) in self.at(group, b, x).iter_mut().zip(quantities) {
            *sum += quantity;
        }
    }

    /// What has been added so far.
    #[inline]
    pub(crate) fn at(&mut self, group: usize, b: usize, x: usize) -> &mut [f64; K] {
        &mut self.sums[(b * self.columns + x) * self.groups + group]
    }
}

/// The whole image: the mean of each quantity and the variance of that mean.
///
/// Row sums come in order, and a row is complete when the last row sums that reach it have come: only the rows under
/// way are kept by groups.
#[derive(Clone, Debug)]
pub(crate) struct FilmAccumulator<const K: usize> {
    pub(crate) mean: Vec<[f64; K]>,
    pub(crate) variance: Vec<[f64; K]>,
    /// Of the derivative, or of the image if there is none.
    pub(crate) regions: RegionSums,
    open: VecDeque<Vec<[f64; K]>>,
    /// Row sums yet to come before the first open row is one of the image.
    before: usize,
}

impl<const K: usize> FilmAccumulator<K> {
    /// Where radiance, and after it its derivative, are among the quantities.
    const REGARDED: usize = if K > 3 { 3 } else { 0 };

    pub(crate) fn new(film: &FilmPlane, samples: usize) -> Self {
        let regions = RegionSums::new(film.columns, film.rows, groups(samples));
        Self { mean: vec![], variance: vec![], regions, open: VecDeque::new(), before: 2 * film.reach }
    }

    /// Adds the next row sums.
    pub(crate) fn absorb(&mut self, row_sums: &RowSums<K>) {
        let row = row_sums.columns * row_sums.groups;
        while self.open.len() < 2 * row_sums.reach + 1 {
            self.open.push_back(vec![[0.0; K]; row]);
        }
        for (open, added) in self.open.iter_mut().zip(row_sums.sums.chunks(row)) {
            for (sum, more) in open.iter_mut().zip(added) {
                for k in 0..K {
                    sum[k] += more[k];
                }
            }
        }
        let Some(complete) = self.open.pop_front() else { return };
        if self.before > 0 {
            self.before -= 1;
            return;
        }
        let y = self.mean.len() / row_sums.columns;
        for (x, sums) in complete.chunks(row_sums.groups).enumerate() {
            for (group, sum) in sums.iter().enumerate() {
                let at = |c: usize| sum[Self::REGARDED + c];
                self.regions.add((x, y), group, DVec3::new(at(0), at(1), at(2)));
            }
            let (mean, variance) = statistics(sums, row_sums.samples);
            self.mean.push(mean);
            self.variance.push(variance);
        }
    }
}

/// The mean over n samples of the sums of groups, and the variance of that mean.
fn statistics<const K: usize>(sums: &[[f64; K]], samples: usize) -> ([f64; K], [f64; K]) {
    let (mut mean, mut variance) = ([0.0; K], [0.0; K]);
    let factor = scatter_to_variance(samples);
    for k in 0..K {
        let sum: f64 = sums.iter().map(|s| s[k]).sum();
        mean[k] = sum / samples as f64;
        let scatter: f64 = sums.iter().zip(parts(samples)).map(|(s, part)| (s[k] - sum * part).powi(2)).sum();
        variance[k] = if factor.is_finite() { scatter * factor } else { f64::INFINITY };
    }
    (mean, variance)
}
