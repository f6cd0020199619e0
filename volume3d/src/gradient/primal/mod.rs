//! Rendering of the primal image.

mod block;
mod cell;
mod pool;
mod splat;

use glam::DVec3;

use self::block::BlockSampler;
use self::cell::CellSampler;
use self::pool::{Pool, Taken};
use super::GradientError;
use super::film::FilmPlane;
use crate::Image;
use crate::gradient::film::driver::{CellSink, FilmSums, over_film};
use crate::gradient::film::unit_weights::UnitWeights;
use crate::gradient::results::result::Rendering;
use crate::gradient::run::progress::Progress;
use crate::path::{Kernels, Paths, WaveTables};
use crate::scene::Scene;

/// Renders a scene with `samples` paths per pixel.
///
/// The same seed gives the same bits at any number of threads. The paths are independent of those of a
/// gradient at that seed, so that an adjoint image may be computed from this image; see [the
/// module](crate::gradient).
///
/// # Errors
/// [`GradientError::Samples`] if there are none, and [`GradientError::Stopped`] if cancelled.
pub fn render(
    scene: &Scene,
    samples: usize,
    seed: u64,
    progress: &Progress,
) -> Result<Rendering, GradientError> {
    render_pixels(scene, samples, seed, |_| true, progress)
}

/// Renders some pixels, with the samples of [`render`]; the values of others are meaningless.
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
    let tables = if paths.scene.description.camera.lens.is_some() { None } else { WaveTables::new(paths) };
    sampled(paths, tables.as_ref(), (samples, seed), wanted, progress)
}

/// Renders with waves of paths, given tables for them, or path by path: the same image, bit for bit.
fn sampled(
    paths: &Paths<'_>,
    tables: Option<&WaveTables>,
    (samples, seed): (usize, u64),
    wanted: impl Fn(usize) -> bool + Sync,
    progress: &Progress,
) -> Result<Rendering, GradientError> {
    if samples == 0 {
        return Err(GradientError::Samples { samples, least: 1 });
    }
    let film = FilmPlane::new(paths.scene);
    let before = paths.scene.trace_counts();
    let wanted = |i, j| film.cell_counts(i, j) && film.reaches(i, j, &wanted);
    let counted = (samples, UnitWeights::of_own_numbers(&film, samples));
    let sums = match tables {
        Some(tables) => {
            let samplers = Pool::new(|| BlockSampler::new(paths, tables, &film, samples, seed));
            let row = || samplers.take();
            let cell = |sampler: &mut Taken<'_, BlockSampler<'_>>, at, sink: CellSink<'_, 3>| {
                sampler.sample(at, &wanted, sink);
            };
            over_film(&film, counted, progress, row, cell)?
        }
        None => {
            let samplers = Pool::new(|| CellSampler::new(paths, &film, samples, seed));
            let row = || samplers.take();
            let cell = |sampler: &mut Taken<'_, CellSampler<'_>>, (i, j), sink: CellSink<'_, 3>| {
                if wanted(i, j) {
                    sampler.sample((i, j), sink);
                }
            };
            over_film(&film, counted, progress, row, cell)?
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

#[cfg(test)]
mod tests {
    use super::*;
    use crate::gradient::tests::{filters, room};

    /// Diffuse walls in waves, glossy ones alone; with one sample, few, and groups of several.
    #[test]
    fn paths_side_by_side_make_the_image_of_paths_one_by_one() {
        for filter in filters() {
            let mut description = room(filter).description;
            description.film.width = 21;
            let scene = Scene::new(description).unwrap();
            let paths = Paths::new(&scene, Kernels::default());
            let tables = WaveTables::new(&paths).expect("the scene is plain");
            for samples in [1, 5, 20] {
                let image =
                    |tables| sampled(&paths, tables, (samples, 7), |_| true, &Progress::none()).unwrap();
                let (waves, alone) = (image(Some(&tables)), image(None));
                assert_eq!(waves.image, alone.image, "{filter:?}, {samples} samples");
                assert_eq!(waves.standard_error, alone.standard_error, "{filter:?}, {samples} samples");
            }
        }
    }

    /// A partial rendering has the bits of the full one.
    #[test]
    fn some_pixels_are_those_of_the_whole_image() {
        for filter in filters() {
            let scene = room(filter);
            for samples in [1, 4] {
                let whole = render(&scene, samples, 7, &Progress::none()).unwrap().image;
                let some = |pixel: usize| pixel == 8 || pixel == 30;
                let part = render_pixels(&scene, samples, 7, some, &Progress::none()).unwrap().image;
                for pixel in [8, 30] {
                    assert_eq!(whole.pixels[pixel], part.pixels[pixel], "{filter:?}, {samples} samples");
                }
            }
        }
    }
}
