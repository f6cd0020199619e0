//! Samples of warped area forward: the derivatives of their numbers, by pixel.

use flatland::calculus::Dual;
use glam::DVec3;

use super::job::{Job, PathNumbers, Place};
use crate::gradient::auxiliary::{Auxiliary, work};
use crate::gradient::driver::{CellSink, finish, over_film, quantities};
use crate::gradient::forward::Forward;
use crate::gradient::groups::group;
use crate::gradient::motion::Motion;
use crate::gradient::{GradientImage, Progress, Stopped};
use crate::path::Frame;

/// What one sample adds: the row of the neighbourhood, the column, and the quantities.
type Added<const K: usize> = (usize, usize, [f64; K]);

/// What computes the cells of a row.
struct Worker<'s, const N: usize, const K: usize> {
    calculus: Forward<'s, N>,
    numbers: PathNumbers,
    added: Vec<Added<K>>,
}

impl Job<'_> {
    /// The derivative of every pixel, but for the boundary terms that go with the warp.
    pub(super) fn forward<const N: usize, const K: usize>(
        &self,
        motion: &Motion<'_>,
        progress: &Progress,
    ) -> Result<GradientImage, Stopped> {
        let (scene, film) = (self.paths.scene, self.film);
        let done = |worker: &Worker<'_, N, K>| work(worker.calculus.auxiliary.as_ref());
        let begin = || {
            let auxiliary = self.auxiliary(&motion.bounds);
            let calculus = Forward::<N> { scene, motion, auxiliary };
            Worker { calculus, numbers: self.path_numbers(), added: vec![] }
        };
        let cell = |worker: &mut Worker<'_, N, K>, (i, j), mut sink: CellSink<'_, K>| {
            let frame = film.moving_frame(&worker.calculus);
            worker.numbers.prepare((i, j), self.samples((i, j)));
            let before = done(worker);
            for sample in 0..self.samples((i, j)) {
                if sink.stopped() {
                    return;
                }
                let place = (i, j, sample);
                if film.cell_counts(i, j) {
                    self.add_sample(worker, &frame, place, &mut sink);
                }
                if self.has_edges() {
                    self.add_edge(worker, place, &mut sink);
                }
            }
            *sink.work = done(worker) - before;
            *sink.rays = worker.calculus.auxiliary.as_ref().map_or(0, Auxiliary::rays);
        };
        let mut sums = over_film(&film, self.counted(), progress, begin, cell)?;
        if let Some(largest) = &mut sums.largest {
            let (columns, rows) = film.cells();
            let cells = (0..rows).flat_map(|j| (0..columns).map(move |i| (i, j)));
            largest.among = cells.map(|cell| self.samples(cell)).sum();
        }
        Ok(finish::<N, K>(&film, sums, self.counted()))
    }

    fn add_sample<const N: usize, const K: usize>(
        &self,
        worker: &mut Worker<'_, N, K>,
        frame: &Frame<Dual<N>>,
        place: Place,
        sink: &mut CellSink<'_, K>,
    ) {
        let sample = self.sample(&mut worker.calculus, frame, place, &mut worker.numbers);
        self.for_each_pixel(place, &sample, |[b, x, _], value, integrand| {
            worker.added.push((b, x, quantities(value, integrand.map(|l| l.tangent))));
        });
        self.keep(worker, place, sink);
    }

    fn add_edge<const N: usize, const K: usize>(
        &self,
        worker: &mut Worker<'_, N, K>,
        place: Place,
        sink: &mut CellSink<'_, K>,
    ) {
        if let Some(sample) = self.edge_sample(&mut worker.calculus, place) {
            self.for_each_side(place, &sample, |[b, x, _], light| {
                let moved = light.to_array().map(|l| (sample.across * l).tangent);
                worker.added.push((b, x, quantities(DVec3::ZERO, moved)));
            });
            self.keep(worker, place, sink);
        }
    }

    /// Adds what a sample has found, if all of it is finite.
    fn keep<const N: usize, const K: usize>(
        &self,
        worker: &mut Worker<'_, N, K>,
        (i, j, sample): Place,
        sink: &mut CellSink<'_, K>,
    ) {
        let at = self.film.located(i, j, sample);
        if worker.added.iter().all(|(.., q)| q.iter().all(|q| q.is_finite())) {
            let (mut amount, samples) = (0.0, self.samples((i, j)));
            let (group, counts) = (group(sample, samples), self.counted() as f64 / samples as f64);
            for (b, x, q) in &mut worker.added {
                q.iter_mut().for_each(|q| *q *= counts);
                amount += q[3..6].iter().map(|d| d.abs()).sum::<f64>();
                sink.row_sums.add(group, *b, *x, q);
            }
            sink.contributed(at, amount);
        } else {
            sink.non_finite.push(at);
        }
        worker.added.clear();
    }
}
