//! Sampler of single cells.

use glam::DVec3;

use crate::gradient::film::FilmPlane;
use crate::gradient::film::camera_rays::{CameraRays, TOGETHER};
use crate::gradient::film::driver::CellSink;
use crate::gradient::run::groups::ImageNumbers;
use crate::gradient::run::streams::PATH;
use crate::path::Paths;

/// Sampler of cells, used sequentially.
pub(super) struct CellSampler<'p> {
    paths: &'p Paths<'p>,
    film: &'p FilmPlane,
    samples: usize,
    numbers: ImageNumbers,
    rays: CameraRays,
}

impl<'p> CellSampler<'p> {
    pub(super) fn new(paths: &'p Paths<'p>, film: &'p FilmPlane, samples: usize, seed: u64) -> Self {
        // Pairs for the film point and the lens point, and those of the bounces.
        let numbers = ImageNumbers::new(seed, PATH, samples, 2 + paths.pairs());
        Self { paths, film, samples, numbers, rays: CameraRays::default() }
    }

    pub(super) fn sample(&mut self, (i, j): (usize, usize), sink: CellSink<'_, 3>) {
        let &mut Self { paths, film, samples, .. } = self;
        let key = self.numbers.key((i, j));
        // Radiance of a group's samples.
        let (mut group, mut light) = (0, DVec3::ZERO);
        let mut drawn = Vec::with_capacity(TOGETHER);
        for first in (0..samples).step_by(TOGETHER) {
            if sink.stopped() {
                return;
            }
            drawn.clear();
            self.rays.clear();
            for sample in first..samples.min(first + TOGETHER) {
                let (group, mut numbers) = self.numbers.of(key, sample);
                let u = film.point(i, j, numbers.pair());
                let (origin, direction) = film.ray_through(u, &mut numbers);
                drawn.push((group, u, origin, numbers));
                if film.has_lens() {
                    self.rays.trace_from(paths.scene, origin, direction);
                }
            }
            if !film.has_lens() {
                self.rays.trace(paths.scene, film, drawn.iter().map(|(_, u, ..)| *u));
            }
            for (at, (of, u, origin, numbers)) in drawn.iter_mut().enumerate() {
                let (sample, (direction, hit)) = (first + at, self.rays.get(at));
                if *of != group {
                    let class = sink.row_sums.class((i, j), group);
                    sink.row_sums.add_light(film, (i, j), class, std::mem::take(&mut light));
                    group = *of;
                }
                let radiance = paths.still_radiance(*origin, direction, hit, 1, numbers);
                if !radiance.is_finite() {
                    sink.non_finite.push(film.located(i, j, sample));
                    continue;
                }
                light += radiance;
                let class = sink.row_sums.class((i, j), group);
                film.for_each_weight((i, j), u.to_array(), |[b, x, _], weight| {
                    sink.row_sums.add(class, b, x, &(weight * radiance).to_array(), weight);
                });
            }
        }
        let class = sink.row_sums.class((i, j), group);
        sink.row_sums.add_light(film, (i, j), class, light);
    }
}
