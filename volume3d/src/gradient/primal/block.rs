//! Sampler of blocks of neighbouring cells, in parallel.

use std::ops::Range;

use glam::{DVec2, DVec3};

use super::splat::Splat;
use crate::gradient::film::FilmPlane;
use crate::gradient::film::camera_rays::{CameraRays, TOGETHER};
use crate::gradient::film::driver::CellSink;
use crate::gradient::run::groups::{ImageNumbers, group_range, group_size, groups};
use crate::gradient::run::streams::PATH;
use crate::lanes::Instructions;
use crate::path::{Paths, Wave, WaveTables};

/// Cells of a block.
const CELLS: usize = Wave::MOST;

/// Largest number of samples of a group that a block stores; larger groups are split into blocks of fewer
/// cells.
const MOST_KEPT: usize = 1 << 16;

/// Sampler of blocks, used sequentially.
///
/// The bits of a pixel do not depend on blocks: every group of a pixel adds up the samples cell by cell.
pub(super) struct BlockSampler<'p> {
    film: &'p FilmPlane,
    paths: &'p Paths<'p>,
    samples: usize,
    numbers: ImageNumbers,
    wave: Wave<'p>,
    instructions: Instructions,
    /// Camera rays of some samples, cell by cell.
    camera: CameraRays,
    /// Keys of the cells' random numbers.
    keys: [u64; CELLS],
    /// Samples of a group, cell by cell: film points within the cells, and radiances.
    places: Vec<[f64; 2]>,
    radiances: Vec<DVec3>,
}

impl<'p> BlockSampler<'p> {
    pub(super) fn new(
        paths: &'p Paths<'p>,
        tables: &'p WaveTables,
        film: &'p FilmPlane,
        samples: usize,
        seed: u64,
    ) -> Self {
        // One pair for the film point, and those of the bounces.
        let numbers = ImageNumbers::new(seed, PATH, samples, 1 + paths.pairs());
        let wave = Wave::new(paths, tables);
        let (keys, places, radiances) = ([0; CELLS], vec![], vec![]);
        let (instructions, camera) = (Instructions::detect(), CameraRays::default());
        Self { film, paths, samples, numbers, wave, instructions, camera, keys, places, radiances }
    }

    /// Samples the block that starts at a cell, if one does.
    pub(super) fn sample(
        &mut self,
        (i, j): (usize, usize),
        wanted: &impl Fn(usize, usize) -> bool,
        mut sink: CellSink<'_, 3>,
    ) {
        let size = group_size(self.samples);
        let cells = (MOST_KEPT / size).clamp(1, CELLS).next_power_of_two();
        if !i.is_multiple_of(cells) {
            return;
        }
        let (columns, _) = self.film.cells();
        let mut among = (i..columns.min(i + cells)).filter(|&i| wanted(i, j));
        let Some(first) = among.next() else { return };
        let cells = first..among.last().unwrap_or(first) + 1;
        for (key, i) in self.keys.iter_mut().zip(cells.clone()) {
            *key = self.numbers.key((i, j));
        }
        let before = sink.non_finite.len();
        for group in 0..groups(self.samples) {
            let samples = group_range(group, self.samples);
            if self.trace(cells.clone(), j, samples.clone(), &sink) {
                self.add(cells.clone(), j, group, samples, wanted, &mut sink);
            }
        }
        sink.non_finite[before..].sort_by_key(|at| (at.column, at.sample));
    }

    /// Traces the samples of a group, unless cancelled.
    fn trace(
        &mut self,
        cells: Range<usize>,
        j: usize,
        samples: Range<usize>,
        sink: &CellSink<'_, 3>,
    ) -> bool {
        let (count, width) = (samples.len(), cells.len());
        self.places.resize(width * count, [0.0; 2]);
        self.radiances.resize(width * count, DVec3::ZERO);
        let scene = self.paths.scene;
        let origin = scene.camera().origin;
        for first in samples.clone().step_by(TOGETHER) {
            if sink.stopped() {
                return false;
            }
            let some = first..samples.end.min(first + TOGETHER);
            self.camera.clear();
            for (cell, i) in cells.clone().enumerate() {
                let from = cell * count + first - samples.start;
                let places = &mut self.places[from..from + some.len()];
                for (place, sample) in places.iter_mut().zip(some.clone()) {
                    *place = self.numbers.of(self.keys[cell], sample).1.pair();
                }
                let points = places.iter().map(|&within| self.film.point(i, j, within));
                self.camera.trace(scene, self.film, points);
            }
            let mut of_sample = [DVec3::ZERO; CELLS];
            for (at, sample) in some.clone().enumerate() {
                let numbers = std::array::from_fn(|cell| {
                    let (_, mut numbers) = self.numbers.of(self.keys[cell], sample);
                    numbers.pair();
                    numbers
                });
                let rays = (0..width).map(|cell| self.camera.get(cell * some.len() + at));
                self.wave.radiances(origin, rays, numbers, &mut of_sample[..width]);
                for (cell, &radiance) in of_sample[..width].iter().enumerate() {
                    self.radiances[cell * count + sample - samples.start] = radiance;
                }
            }
        }
        true
    }

    /// Adds the samples of a group to the sums of the row.
    fn add(
        &self,
        cells: Range<usize>,
        j: usize,
        group: usize,
        samples: Range<usize>,
        wanted: &impl Fn(usize, usize) -> bool,
        sink: &mut CellSink<'_, 3>,
    ) {
        let (places, radiances) = (self.places.chunks(samples.len()), self.radiances.chunks(samples.len()));
        for (i, (places, radiances)) in cells.zip(places.zip(radiances)) {
            if !wanted(i, j) {
                continue;
            }
            let class = sink.row_sums.class((i, j), group);
            let (near, finite) = (self.film.is_near(), radiances.iter().all(|radiance| radiance.is_finite()));
            if near && finite {
                let (film, row_sums) = (self.film, &mut *sink.row_sums);
                self.instructions.run(Splat { film, cell: (i, j), class, places, radiances, row_sums });
                continue;
            }
            let mut light = DVec3::ZERO;
            for ((sample, &within), &radiance) in samples.clone().zip(places).zip(radiances) {
                if !radiance.is_finite() {
                    sink.non_finite.push(self.film.located(i, j, sample));
                    continue;
                }
                light += radiance;
                let u: DVec2 = self.film.point(i, j, within);
                self.film.for_each_weight((i, j), u.to_array(), |[b, x, _], weight| {
                    sink.row_sums.add(class, b, x, &(weight * radiance).to_array(), weight);
                });
            }
            sink.row_sums.add_light(self.film, (i, j), class, light);
        }
    }
}
