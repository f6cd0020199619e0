//! Rows of cells, computed side by side and summed in order.

use glam::DVec3;
use rayon::prelude::*;

use super::contribution::{Contribution, Source};
use super::film::FilmPlane;
use super::film_accumulator::{FilmAccumulator, RowSums};
use super::non_finite::NonFinite;
use super::progress::{Progress, Stopped};
use super::result::{GradientImage, Terms};

/// Rows are computed in groups of this many: enough to keep many threads busy, few enough that memory does not grow
/// with the image. Sums do not depend on threads.
const WAVE: usize = 64;

/// Rows of cells in groups that are computed together.
pub(super) fn row_blocks(rows: usize) -> impl Iterator<Item = std::ops::Range<usize>> {
    (0..rows).step_by(WAVE).map(move |start| start..(start + WAVE).min(rows))
}

/// The sums over a film.
pub(super) struct Sums<const K: usize> {
    pub(super) accumulator: FilmAccumulator<K>,
    /// Auxiliary rays.
    pub(super) rays: u64,
    pub(super) non_finite: Vec<NonFinite>,
    /// The sample that contributes most to the derivative.
    pub(super) largest: Option<Contribution>,
}

/// Where the samples of a cell go.
pub(super) struct CellSink<'a, const K: usize> {
    pub(super) row_sums: &'a mut RowSums<K>,
    pub(super) non_finite: &'a mut Vec<NonFinite>,
    largest: &'a mut Option<Contribution>,
    progress: &'a Progress,
}

impl<const K: usize> CellSink<'_, K> {
    /// Whether to leave: to be asked before every sample, as one cell may have any number of them. What a cell left
    /// early has added is never looked at.
    pub(super) fn stopped(&self) -> bool {
        self.progress.stopped()
    }

    /// Takes note of Σ |·| of what a path has added to the derivative.
    pub(super) fn contributed(&mut self, at: NonFinite, amount: f64) {
        Contribution::keep_larger(self.largest, Some(Contribution::new(at, Source::Path, amount)));
    }
}

/// Computes all rows of cells. `row` begins a row and returns what computes its cells; both may keep state.
pub(super) fn over_film<const K: usize, W>(
    film: &FilmPlane,
    samples: usize,
    progress: &Progress,
    begin: impl Fn() -> W + Sync,
    cell: impl Fn(&mut W, (usize, usize), CellSink<'_, K>) + Sync,
    rays: impl Fn(&W) -> u64 + Sync,
) -> Result<Sums<K>, Stopped> {
    let mut sums =
        Sums { accumulator: FilmAccumulator::new(film, samples), rays: 0, non_finite: vec![], largest: None };
    let rows = film.rows + 2 * film.reach;
    progress.start(rows);
    for block in row_blocks(rows) {
        let parts: Vec<_> = block
            .into_par_iter()
            .map(|j| {
                let mut worker = begin();
                let (mut row_sums, mut non_finite, mut largest) = (RowSums::new(film, samples), vec![], None);
                for i in 0..film.columns + 2 * film.reach {
                    if progress.stopped() {
                        break;
                    }
                    let sink = CellSink {
                        row_sums: &mut row_sums,
                        non_finite: &mut non_finite,
                        largest: &mut largest,
                        progress,
                    };
                    cell(&mut worker, (i, j), sink);
                }
                progress.advance();
                (row_sums, non_finite, largest, rays(&worker))
            })
            .collect();
        if progress.stopped() {
            return Err(Stopped);
        }
        for (row_sums, non_finite, largest, rays) in parts {
            sums.accumulator.absorb(&row_sums);
            sums.non_finite.extend(non_finite);
            Contribution::keep_larger(&mut sums.largest, largest);
            sums.rays += rays;
        }
    }
    if let Some(largest) = &mut sums.largest {
        largest.amount /= samples as f64;
        largest.among = rows * (film.columns + 2 * film.reach) * samples;
    }
    Ok(sums)
}

/// Quantities of a sample: radiance, total derivative, and with three lanes the terms.
pub(super) fn quantities<const N: usize, const K: usize>(value: DVec3, channels: [[f64; N]; 3]) -> [f64; K] {
    let mut q = [0.0; K];
    for c in 0..3 {
        q[c] = value[c];
        q[3 + c] = channels[c].iter().sum();
        if N > 1 {
            for l in 0..N {
                q[6 + 3 * l + c] = channels[c][l];
            }
        }
    }
    q
}

/// What sums over a film mean.
pub(super) fn finish<const N: usize, const K: usize>(
    film: &FilmPlane,
    sums: Sums<K>,
    samples: usize,
) -> GradientImage {
    let Sums { accumulator, rays, non_finite, largest } = sums;
    let pick = |table: &[[f64; K]], at: usize| -> Vec<DVec3> {
        table.iter().map(|q| DVec3::new(q[at], q[at + 1], q[at + 2])).collect()
    };
    let root = |v: Vec<DVec3>| -> Vec<DVec3> { v.into_iter().map(|v| v.map(f64::sqrt)).collect() };
    GradientImage {
        width: film.columns,
        height: film.rows,
        image: pick(&accumulator.mean, 0),
        image_error: root(pick(&accumulator.variance, 0)),
        gradient: pick(&accumulator.mean, 3),
        standard_error: root(pick(&accumulator.variance, 3)),
        regions: accumulator.regions.finish(samples),
        terms: (N == 3).then(|| Terms {
            interior: pick(&accumulator.mean, 6),
            primary: pick(&accumulator.mean, 9),
            secondary: pick(&accumulator.mean, 12),
        }),
        auxiliary_rays: rays,
        non_finite,
        largest,
    }
}
