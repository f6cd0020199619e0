//! The image itself.

use glam::DVec3;

use super::driver::{CellSink, FilmSums, over_film};
use super::film::FilmPlane;
use super::groups::CellNumbers;
use super::progress::Progress;
use super::result::Rendering;
use super::{PATH, Stopped};
use crate::Image;
use crate::path::{Kernels, Paths};
use crate::scene::{Hit, Scene};

/// Camera rays of a cell that are traced at once, having one origin and a narrow cone: as many as a packet takes.
const TOGETHER: usize = 16;

/// Renders a scene with `samples` paths a pixel.
///
/// The same seed gives the same bits at any number of threads. The paths are independent of those of a gradient at that
/// seed, so that an adjoint image may be computed from this one; see [the module](crate::gradient).
///
/// # Errors
/// [`Stopped`] if `progress` asked for an end.
pub fn render(scene: &Scene, samples: usize, seed: u64, progress: &Progress) -> Result<Rendering, Stopped> {
    render_pixels(scene, samples, seed, |_| true, progress)
}

/// The same of some pixels, with the same samples; what others get means nothing.
pub(crate) fn render_pixels(
    scene: &Scene,
    samples: usize,
    seed: u64,
    wanted: impl Fn(usize) -> bool + Sync,
    progress: &Progress,
) -> Result<Rendering, Stopped> {
    let paths = Paths::new(scene, Kernels::default());
    rendering(&paths, samples, seed, wanted, progress)
}

pub(super) fn primal(
    paths: &Paths<'_>,
    samples: usize,
    seed: u64,
    progress: &Progress,
) -> Result<Rendering, Stopped> {
    rendering(paths, samples, seed, |_| true, progress)
}

fn rendering(
    paths: &Paths<'_>,
    samples: usize,
    seed: u64,
    wanted: impl Fn(usize) -> bool + Sync,
    progress: &Progress,
) -> Result<Rendering, Stopped> {
    let film = FilmPlane::new(paths.scene);
    let before = paths.scene.trace_counts();
    let row = || CellSampler::new(paths, &film, samples, seed);
    let cell = |sampler: &mut CellSampler<'_>, (i, j), sink: CellSink<'_, 3>| {
        if film.reaches(i, j, &wanted) {
            sampler.sample((i, j), sink);
        }
    };
    let sums = over_film(&film, samples, progress, row, cell)?;
    let lost_rays = sums.lost_rays(&film);
    let FilmSums { accumulator, non_finite, .. } = sums;
    let pixels = accumulator.mean.iter().map(|&m| DVec3::from_array(m)).collect();
    let errors = accumulator.variance.iter().map(|v| DVec3::from_array(v.map(f64::sqrt))).collect();
    let image = |pixels| Image { width: film.columns, height: film.rows, pixels };
    Ok(Rendering {
        image: image(pixels),
        standard_error: image(errors),
        regions: accumulator.regions.finish(samples),
        non_finite,
        traces: paths.scene.trace_counts() - before,
        lost_rays,
    })
}

/// What cells are sampled with, one after the other.
struct CellSampler<'p> {
    paths: &'p Paths<'p>,
    film: &'p FilmPlane,
    samples: usize,
    numbers: CellNumbers,
    hits: Vec<Option<Hit>>,
}

impl<'p> CellSampler<'p> {
    fn new(paths: &'p Paths<'p>, film: &'p FilmPlane, samples: usize, seed: u64) -> Self {
        // The film point, the point of the lens, and those of bounces.
        let numbers = CellNumbers::new(seed, PATH, 1, 2 + paths.pairs());
        Self { paths, film, samples, numbers, hits: vec![] }
    }

    fn sample(&mut self, (i, j): (usize, usize), sink: CellSink<'_, 3>) {
        let &mut Self { paths, film, samples, .. } = self;
        if !film.cell_counts(i, j) {
            return;
        }
        self.numbers.prepare((i, j), samples);
        let mut drawn = Vec::with_capacity(TOGETHER);
        let mut directions = Vec::with_capacity(TOGETHER);
        for first in (0..samples).step_by(TOGETHER) {
            if sink.stopped() {
                return;
            }
            drawn.clear();
            directions.clear();
            for sample in first..samples.min(first + TOGETHER) {
                let (group, mut numbers) = self.numbers.of(sample, 0);
                let u = film.point(i, j, numbers.pair());
                let (origin, direction) = film.ray_through(u, &mut numbers);
                drawn.push((group, u, origin, numbers));
                directions.push(direction);
            }
            if film.has_lens() {
                self.hits.clear();
                let rays = drawn.iter().zip(&directions);
                self.hits.extend(rays.map(|((_, _, o, _), &d)| paths.scene.closest(*o, d, None)));
            } else {
                let origin = paths.scene.description.camera.origin;
                paths.scene.closest_bundle(origin, &directions, None, &mut self.hits);
            }
            let arrivals = directions.iter().zip(&self.hits);
            for (sample, ((group, u, origin, numbers), (&direction, &hit))) in
                (first..).zip(drawn.iter_mut().zip(arrivals))
            {
                let radiance = paths.still_radiance(*origin, direction, hit, 1, numbers);
                if !radiance.is_finite() {
                    sink.non_finite.push(film.located(i, j, sample));
                    continue;
                }
                film.for_each_weight((i, j), u.to_array(), |[b, x, _], weight| {
                    sink.row_sums.add(*group, b, x, &(weight * radiance).to_array());
                });
            }
        }
    }
}
