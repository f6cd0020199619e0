//! Forward mode of warped-area sampling: derivatives by pixel.

use flatland::calculus::Dual;
use glam::DVec3;

use super::job::{EdgeSample, Job, PathNumbers, Place, SPLITTING, Sample};
use super::others::Others;
use crate::gradient::auxiliary::{Auxiliary, work};
use crate::gradient::film::driver::{CellSink, finish, over_film, quantities};
use crate::gradient::film::unit_weights::UnitWeights;
use crate::gradient::modes::forward::Forward;
use crate::gradient::run::groups::{TILE, group};
use crate::gradient::warp::motion::Motion;
use crate::gradient::{GradientImage, Progress, Stopped};
use crate::path::{Frame, WaveTables};

/// Contribution of a sample: row of the neighbourhood, column, quantities and weight.
type Added<const K: usize> = (usize, usize, [f64; K], f64);

/// State for computing the cells of a row.
struct Worker<'s, const N: usize, const K: usize> {
    calculus: Forward<'s, N>,
    numbers: PathNumbers,
    /// Additional paths, if they may be traced in waves.
    others: Option<Others<'s>>,
    /// Samples not added yet, in order.
    kept: Vec<(Place, Kept<N>)>,
    added: Vec<Added<K>>,
}

/// A sample of a cell, or of a cell's edge.
enum Kept<const N: usize> {
    Cell(Sample<Dual<N>>),
    Edge(EdgeSample<Dual<N>>),
}

/// Largest number of samples kept: 0.5 to 1 MB.
const MOST_KEPT: usize = 1 << 12;

impl Job<'_> {
    /// Derivative of every pixel, without the boundary terms of the warp.
    pub(super) fn forward<const N: usize, const K: usize>(
        &self,
        motion: &Motion<'_>,
        progress: &Progress,
    ) -> Result<GradientImage, Stopped> {
        let (scene, film) = (self.paths.scene, self.film);
        let splits = self.method.warps && motion.change.is_geometric() && !film.has_lens();
        let tables = if splits && !self.follows_chains { WaveTables::new(&self.paths) } else { None };
        let done = |worker: &Worker<'_, N, K>| work(worker.calculus.auxiliary.as_ref());
        let begin = || {
            let auxiliary = self.auxiliary(&motion.bounds);
            let calculus = Forward::<N> { scene, motion, auxiliary };
            let others = tables.as_ref().map(|tables| Others::new(&self.paths, tables));
            Worker { calculus, numbers: self.path_numbers(), others, kept: vec![], added: vec![] }
        };
        let cell = |worker: &mut Worker<'_, N, K>, (i, j), mut sink: CellSink<'_, K>| {
            let frame = film.moving_frame(&worker.calculus);
            worker.numbers.prepare((i, j), self.samples((i, j)));
            for sample in 0..self.samples((i, j)) {
                if sink.stopped() {
                    return;
                }
                let (place, before) = ((i, j, sample), done(worker));
                if film.cell_counts(i, j) {
                    self.take_sample(worker, &frame, place);
                }
                if self.has_edges((i, j)) {
                    let Worker { calculus, kept, .. } = worker;
                    self.edge_samples(calculus, place, |edge| kept.push((place, Kept::Edge(edge))));
                }
                sink.work[i] += done(worker) - before;
                if worker.kept.len() >= MOST_KEPT {
                    self.add_kept(worker, &mut sink);
                }
            }
            let (columns, _) = film.cells();
            if worker.others.is_none() || (i + 1).is_multiple_of(TILE) || i + 1 == columns {
                self.add_kept(worker, &mut sink);
            }
            *sink.rays = worker.calculus.auxiliary.as_ref().map_or(0, Auxiliary::rays);
        };
        let counted = (self.counted(), UnitWeights::of_shared_numbers(&film, self.counted()));
        let mut sums = over_film(&film, counted, progress, begin, cell)?;
        if let Some(largest) = &mut sums.largest {
            let (columns, rows) = film.cells();
            let cells = (0..rows).flat_map(|j| (0..columns).map(move |i| (i, j)));
            largest.among = cells.map(|cell| self.samples(cell)).sum();
        }
        Ok(finish::<N, K>(&film, sums, self.counted()))
    }

    /// Keeps a sample of a cell whose additional paths may be traced later.
    fn take_sample<const N: usize, const K: usize>(
        &self,
        worker: &mut Worker<'_, N, K>,
        frame: &Frame<Dual<N>>,
        place: Place,
    ) {
        let Worker { calculus, numbers, others, kept, .. } = worker;
        let (mut sample, split) = self.first_path(calculus, frame, place, numbers);
        match (split, others) {
            (None, _) => {}
            (Some((_, direction, hit)), Some(others)) => {
                others.wait(kept.len(), place, self.samples((place.0, place.1)), (direction, hit));
            }
            (Some(ray), None) => self.add_others(&mut sample, ray, place, numbers),
        }
        kept.push((place, Kept::Cell(sample)));
    }

    /// Adds all kept samples.
    fn add_kept<const N: usize, const K: usize>(
        &self,
        worker: &mut Worker<'_, N, K>,
        sink: &mut CellSink<'_, K>,
    ) {
        let Worker { numbers, others, kept, added, .. } = worker;
        if let Some(others) = others {
            others.follow(&mut numbers.others, |index, light, column, traced| {
                if let (_, Kept::Cell(sample)) = &mut kept[index] {
                    sample.add_others(light, SPLITTING);
                }
                sink.work[column] += traced as f64;
            });
        }
        for (place, kept) in kept.drain(..) {
            let light = match kept {
                Kept::Cell(sample) => {
                    self.for_each_pixel(place, &sample, |[b, x, _], weight, integrand| {
                        let value = sample.radiance() * weight;
                        added.push((b, x, quantities(value, integrand.map(|l| l.tangent)), weight));
                    });
                    sample.radiance()
                }
                Kept::Edge(sample) => {
                    self.for_each_side(place, &sample, |[b, x, _], light| {
                        let moved = light.to_array().map(|l| (sample.across * l).tangent);
                        added.push((b, x, quantities(DVec3::ZERO, moved), 0.0));
                    });
                    DVec3::ZERO
                }
            };
            self.add(added, light, place, sink);
            added.clear();
        }
    }

    /// Adds a sample's contributions and radiance, if all of them are finite.
    fn add<const K: usize>(
        &self,
        added: &mut [Added<K>],
        light: DVec3,
        (i, j, sample): Place,
        sink: &mut CellSink<'_, K>,
    ) {
        let at = self.film.located(i, j, sample);
        if light.is_finite() && added.iter().all(|(_, _, q, _)| q.iter().all(|q| q.is_finite())) {
            let (mut amount, samples) = (0.0, self.samples((i, j)));
            let (group, counts) = (group(sample, samples), self.counted() as f64 / samples as f64);
            for (b, x, q, weight) in added {
                q.iter_mut().for_each(|q| *q *= counts);
                amount += q[3..6].iter().map(|d| d.abs()).sum::<f64>();
                sink.row_sums.add(group, *b, *x, q, *weight * counts);
            }
            sink.row_sums.add_light(&self.film, (i, j), group, light * counts);
            sink.contributed(at, amount);
        } else {
            sink.non_finite.push(at);
        }
    }
}
