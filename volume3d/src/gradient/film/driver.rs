//! Driver over the film: rows of cells computed in parallel and summed in order.

use glam::DVec3;

use super::film_accumulator::{FilmAccumulator, RowSums};
use super::unit_weights::UnitWeights;
use crate::Image;
use crate::gradient::film::FilmPlane;
use crate::gradient::results::contribution::{Contribution, Source};
use crate::gradient::results::result::{GradientImage, Noise, Terms};
use crate::gradient::run::non_finite::NonFinite;
use crate::gradient::run::parts::in_order;
use crate::gradient::run::progress::{Progress, Stopped};
use crate::scene::{TraceCounts, lost_by_this_thread};

/// Sums over a film.
pub(in crate::gradient) struct FilmSums<const K: usize> {
    pub(in crate::gradient) accumulator: FilmAccumulator<K>,
    /// Number of auxiliary rays.
    pub(in crate::gradient) rays: u64,
    pub(in crate::gradient) non_finite: Vec<NonFinite>,
    /// Lost rays by cell.
    lost: Vec<((usize, usize), u64)>,
    /// The sample with the largest contribution to the derivative.
    pub(in crate::gradient) largest: Option<Contribution>,
    /// Cost of each cell's samples, in rays.
    work: Vec<f64>,
}

impl<const K: usize> FilmSums<K> {
    /// Lost rays by pixel; those of cells outside the image count for the nearest pixel.
    pub(in crate::gradient) fn lost_rays(&self, film: &FilmPlane) -> Option<Image> {
        if self.lost.is_empty() {
            return None;
        }
        let mut image = Image::constant(film.columns, film.rows, DVec3::ZERO);
        let reach = film.reach;
        for &((i, j), rays) in &self.lost {
            let (x, y) =
                (i.saturating_sub(reach).min(film.columns - 1), j.saturating_sub(reach).min(film.rows - 1));
            image.pixels[y * film.columns + x] += DVec3::splat(rays as f64);
        }
        Some(image)
    }
}

/// Destination of a cell's samples.
pub(in crate::gradient) struct CellSink<'a, const K: usize> {
    pub(in crate::gradient) row_sums: &'a mut RowSums<K>,
    pub(in crate::gradient) non_finite: &'a mut Vec<NonFinite>,
    /// Auxiliary rays of the row.
    pub(in crate::gradient) rays: &'a mut u64,
    /// Cost of each cell's samples, in rays.
    pub(in crate::gradient) work: &'a mut [f64],
    largest: &'a mut Option<Contribution>,
    progress: &'a Progress,
}

impl<const K: usize> CellSink<'_, K> {
    /// Whether the computation is cancelled. Ask before every sample, as one cell may have many; the partial
    /// sums of a cancelled cell are discarded.
    pub(in crate::gradient) fn stopped(&self) -> bool {
        self.progress.stopped()
    }

    /// Records Σ |·| of a path's contribution to the derivative.
    pub(in crate::gradient) fn contributed(&mut self, at: NonFinite, amount: f64) {
        Contribution::keep_larger(self.largest, Some(Contribution::new(at, Source::Path, amount)));
    }
}

/// Computes all rows of cells. `begin` starts a row and returns the closure that computes its cells.
pub(in crate::gradient) fn over_film<const K: usize, W>(
    film: &FilmPlane,
    (samples, weights): (usize, UnitWeights),
    progress: &Progress,
    begin: impl Fn() -> W + Sync,
    cell: impl Fn(&mut W, (usize, usize), CellSink<'_, K>) + Sync,
) -> Result<FilmSums<K>, Stopped> {
    let mut sums = FilmSums {
        accumulator: FilmAccumulator::new(film, samples),
        rays: 0,
        non_finite: vec![],
        lost: vec![],
        largest: None,
        work: vec![],
    };
    let (columns, rows) = film.cells();
    let row = |j| {
        let (mut worker, mut row_sums) = (begin(), RowSums::new(film, samples, weights));
        let (mut non_finite, mut lost, mut largest, mut rays) = (vec![], vec![], None, 0);
        let mut work = vec![0.0; columns];
        for i in 0..columns {
            if progress.stopped() {
                break;
            }
            let sink = CellSink {
                row_sums: &mut row_sums,
                non_finite: &mut non_finite,
                rays: &mut rays,
                work: &mut work,
                largest: &mut largest,
                progress,
            };
            let before = lost_by_this_thread();
            cell(&mut worker, (i, j), sink);
            let more = lost_by_this_thread() - before;
            if more > 0 {
                lost.push(((i, j), more));
            }
        }
        (row_sums, non_finite, lost, largest, rays, work)
    };
    in_order(rows, progress, row, |_, (row_sums, non_finite, lost, largest, rays, work)| {
        sums.accumulator.absorb(&row_sums);
        sums.non_finite.extend(non_finite);
        sums.lost.extend(lost);
        Contribution::keep_larger(&mut sums.largest, largest);
        sums.rays += rays;
        sums.work.extend(work);
    })?;
    if let Some(largest) = &mut sums.largest {
        largest.amount /= samples as f64;
        largest.among = rows * columns * samples;
    }
    Ok(sums)
}

/// Quantities of one sample: radiance, total derivative, and, with three lanes, its terms.
pub(in crate::gradient) fn quantities<const N: usize, const K: usize>(
    value: DVec3,
    channels: [[f64; N]; 3],
) -> [f64; K] {
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

/// The result of sums over a film.
pub(in crate::gradient) fn finish<const N: usize, const K: usize>(
    film: &FilmPlane,
    sums: FilmSums<K>,
    samples: usize,
) -> GradientImage {
    let lost_rays = sums.lost_rays(film);
    let FilmSums { accumulator, rays, non_finite, largest, work, .. } = sums;
    let pick = |table: &[[f64; K]], at: usize| -> Image {
        let pixels = table.iter().map(|q| DVec3::new(q[at], q[at + 1], q[at + 2])).collect();
        Image { width: film.columns, height: film.rows, pixels }
    };
    let root = |mut image: Image| -> Image {
        image.pixels.iter_mut().for_each(|v| *v = v.map(f64::sqrt));
        image
    };
    let standard_error = root(pick(&accumulator.variance, 3));
    GradientImage {
        image: pick(&accumulator.mean, 0),
        image_error: root(pick(&accumulator.variance, 0)),
        gradient: pick(&accumulator.mean, 3),
        noise: Noise { work, ..Noise::of_area(&standard_error) },
        standard_error,
        regions: accumulator.regions.finish(samples),
        terms: (N == 3).then(|| Terms {
            interior: pick(&accumulator.mean, 6),
            primary: pick(&accumulator.mean, 9),
            secondary: pick(&accumulator.mean, 12),
        }),
        auxiliary_rays: rays,
        non_finite,
        traces: TraceCounts::default(),
        lost_rays,
        left_out: vec![],
        one_sided: None,
        largest,
    }
}
