//! The image itself.

mod block;
mod cell;
mod pool;
mod splat;

use glam::DVec3;

use self::block::BlockSampler;
use self::cell::CellSampler;
use self::pool::{Pool, Taken};
use super::GradientError;
use super::driver::{CellSink, FilmSums, over_film};
use super::film::FilmPlane;
use super::progress::Progress;
use super::result::Rendering;
use crate::Image;
use crate::path::{Kernels, Paths, WaveTables};
use crate::scene::Scene;

/// Renders a scene with `samples` paths a pixel.
///
/// The same seed gives the same bits at any number of threads. The paths are independent of those of a gradient at that
/// seed, so that an adjoint image may be computed from this one; see [the module](crate::gradient).
///
/// # Errors
/// [`GradientError::Samples`] if there are none, and [`GradientError::Stopped`] if `progress` asked for an end.
pub fn render(
    scene: &Scene,
    samples: usize,
    seed: u64,
    progress: &Progress,
) -> Result<Rendering, GradientError> {
    render_pixels(scene, samples, seed, |_| true, progress)
}

/// The same of some pixels, with the same samples; what others get means nothing.
pub(crate) fn render_pixels(
    scene: &Scene,
    samples: usize,
    seed: u64,
    wanted: impl Fn(usize) -> bool + Sync,
    progress: &Progress,
) -> Result<Rendering, GradientError> {
    let paths = Paths::new(scene, Kernels::default());
    rendering(&paths, samples, seed, wanted, progress)
}

pub(super) fn primal(
    paths: &Paths<'_>,
    samples: usize,
    seed: u64,
    progress: &Progress,
) -> Result<Rendering, GradientError> {
    rendering(paths, samples, seed, |_| true, progress)
}

fn rendering(
    paths: &Paths<'_>,
    samples: usize,
    seed: u64,
    wanted: impl Fn(usize) -> bool + Sync,
    progress: &Progress,
) -> Result<Rendering, GradientError> {
    if samples == 0 {
        return Err(GradientError::Samples { samples, least: 1 });
    }
    let film = FilmPlane::new(paths.scene);
    let before = paths.scene.trace_counts();
    let tables = if film.has_lens() { None } else { WaveTables::new(paths) };
    let wanted = |i, j| film.cell_counts(i, j) && film.reaches(i, j, &wanted);
    let sums = match &tables {
        Some(tables) => {
            let samplers = Pool::new(|| BlockSampler::new(paths, tables, &film, samples, seed));
            let row = || samplers.take();
            let cell = |sampler: &mut Taken<'_, BlockSampler<'_>>, at, sink: CellSink<'_, 3>| {
                sampler.sample(at, &wanted, sink);
            };
            over_film(&film, samples, progress, row, cell)?
        }
        None => {
            let samplers = Pool::new(|| CellSampler::new(paths, &film, samples, seed));
            let row = || samplers.take();
            let cell = |sampler: &mut Taken<'_, CellSampler<'_>>, (i, j), sink: CellSink<'_, 3>| {
                if wanted(i, j) {
                    sampler.sample((i, j), sink);
                }
            };
            over_film(&film, samples, progress, row, cell)?
        }
    };
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
