//! Film accumulator: sums of samples per pixel, with the variance of their mean.

use std::collections::VecDeque;

use glam::DVec3;

use super::unit_weights::{Level, UnitWeights, even_parts, nearness};
use crate::gradient::film::FilmPlane;
use crate::gradient::results::regions::RegionSums;
use crate::gradient::run::groups::{groups, parts, scatter_to_variance};

/// Sums of K quantities that one row of cells contributes to the pixel rows it reaches, separate for each
/// class of samples.
#[derive(Clone, Debug)]
pub(crate) struct RowSums<const K: usize> {
    columns: usize,
    classes: usize,
    samples: usize,
    reach: usize,
    weights: UnitWeights,
    /// Sums, by row of the neighbourhood, column and class.
    sums: Vec<[f64; K]>,
    /// Sums of weights in the same order; empty if not needed.
    levels: Vec<Level>,
}

impl<const K: usize> RowSums<K> {
    pub(crate) fn new(film: &FilmPlane, samples: usize, weights: UnitWeights) -> Self {
        let (classes, reach) = (weights.classes(samples), film.reach);
        let size = (2 * reach + 1) * film.columns * classes;
        let levels = vec![[0.0; 4]; if weights.estimates() { size } else { 0 }];
        Self { columns: film.columns, classes, samples, reach, weights, sums: vec![[0.0; K]; size], levels }
    }

    /// Class of a group's samples in a cell.
    #[inline]
    pub(crate) fn class(&self, cell: (usize, usize), group: usize) -> usize {
        self.weights.class(cell, group)
    }

    /// Adds the quantities of a sample of a class, and its weight, to image column x in row b of the
    /// neighbourhood.
    pub(crate) fn add(&mut self, class: usize, b: usize, x: usize, quantities: &[f64; K], weight: f64) {
        for (sum, quantity) in self.at(class, b, x).iter_mut().zip(quantities) {
            *sum += quantity;
        }
        if let Some(own) = self.weight_at(class, b, x) {
            *own += weight;
        }
    }

    /// The sums so far.
    #[inline]
    pub(crate) fn at(&mut self, class: usize, b: usize, x: usize) -> &mut [f64; K] {
        &mut self.sums[(b * self.columns + x) * self.classes + class]
    }

    /// The sum of weights so far; `None` if not needed.
    #[inline]
    pub(crate) fn weight_at(&mut self, class: usize, b: usize, x: usize) -> Option<&mut f64> {
        self.levels.get_mut((b * self.columns + x) * self.classes + class).map(|level| &mut level[0])
    }

    /// Adds the light of samples of a class in a cell to the estimates of light near the pixels
    /// around it.
    pub(crate) fn add_light(&mut self, film: &FilmPlane, (i, j): (usize, usize), class: usize, light: DVec3) {
        if !self.weights.estimates() {
            return;
        }
        for b in self.reach - 1..self.reach + 2 {
            let Some(y) = film.pixel_row(j, b) else { continue };
            let along = nearness(film, 1, y, self.reach as isize - b as isize);
            for a in self.reach - 1..self.reach + 2 {
                let Some(x) = film.pixel_column(i, a) else { continue };
                let across = nearness(film, 0, x, self.reach as isize - a as isize);
                let at = (b * self.columns + x) * self.classes + class;
                for (sum, light) in self.levels[at][1..].iter_mut().zip(light.to_array()) {
                    *sum += along * across * light;
                }
            }
        }
    }
}

/// The whole image: mean of each quantity, and variance of that mean.
///
/// Row sums arrive in order, and a pixel row is complete once the last row of cells that reaches it has
/// arrived: only incomplete rows keep separate sums by group.
#[derive(Clone, Debug)]
pub(crate) struct FilmAccumulator<const K: usize> {
    pub(crate) mean: Vec<[f64; K]>,
    pub(crate) variance: Vec<[f64; K]>,
    /// Sums of the derivative, or of the image if there is no derivative.
    pub(crate) regions: RegionSums,
    open: VecDeque<Vec<[f64; K]>>,
    open_levels: VecDeque<Vec<Level>>,
    /// Row sums still to come before the first open row is a row of the image.
    before: usize,
    /// By column and by row, of classes that are parities of cells.
    even: [Vec<f64>; 2],
}

impl<const K: usize> FilmAccumulator<K> {
    /// Index of the quantity whose regions are summed: the derivative if there is one, else radiance.
    const REGARDED: usize = if K > 3 { 3 } else { 0 };

    pub(crate) fn new(film: &FilmPlane, samples: usize) -> Self {
        let regions = RegionSums::new(film.columns, film.rows, groups(samples));
        let (open, open_levels, before) = (VecDeque::new(), VecDeque::new(), 2 * film.reach);
        let even = [0, 1].map(|axis| match UnitWeights::of_own_numbers(film, samples) {
            UnitWeights::Parities => even_parts(film, axis),
            _ => vec![0.0; film.size()[axis]],
        });
        Self { mean: vec![], variance: vec![], regions, open, open_levels, before, even }
    }

    /// Adds the next row sums, in order.
    pub(crate) fn absorb(&mut self, row_sums: &RowSums<K>) {
        let &RowSums { columns, classes, samples, reach, weights, .. } = row_sums;
        let row = columns * classes;
        add_rows(&mut self.open, row_sums.sums.chunks(row), 2 * reach + 1, row);
        let levelled = if row_sums.levels.is_empty() { 0 } else { row };
        add_rows(&mut self.open_levels, row_sums.levels.chunks(row), 2 * reach + 1, levelled);
        let (Some(mut complete), Some(levels)) = (self.open.pop_front(), self.open_levels.pop_front()) else {
            return;
        };
        if self.before > 0 {
            self.before -= 1;
            return;
        }
        let y = self.mean.len() / columns;
        for (x, sums) in complete.chunks_mut(classes).enumerate() {
            let levels = levels.get(x * classes..(x + 1) * classes).unwrap_or_default();
            let pixel = ((x + reach, y + reach), [self.even[0][x], self.even[1][y]]);
            let groups = weights.correct(samples, pixel, sums, levels);
            let sums = &sums[..groups];
            for (group, sum) in sums.iter().enumerate() {
                let at = |c: usize| sum[Self::REGARDED + c];
                self.regions.add((x, y), group, DVec3::new(at(0), at(1), at(2)));
            }
            let (mean, variance) = statistics(sums, samples);
            self.mean.push(mean);
            self.variance.push(variance);
        }
    }
}

/// Adds rows to the `count` open rows.
fn add_rows<'a, const K: usize>(
    open: &mut VecDeque<Vec<[f64; K]>>,
    added: impl Iterator<Item = &'a [[f64; K]]>,
    count: usize,
    length: usize,
) {
    while open.len() < count {
        open.push_back(vec![[0.0; K]; length]);
    }
    for (open, added) in open.iter_mut().zip(added) {
        for (sum, more) in open.iter_mut().zip(added) {
            for k in 0..K {
                sum[k] += more[k];
            }
        }
    }
}

/// The mean over n samples from sums of groups, and the variance of that mean.
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
