//! The image itself.

use glam::DVec3;

use super::driver::{CellSink, FilmSums, over_film};
use super::film::FilmPlane;
use super::groups::{group, numbers};
use super::progress::Progress;
use super::result::Rendering;
use super::{PATH, Stopped};
use crate::Image;
use crate::path::{Kernels, Paths};
use crate::scene::Scene;

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
    let cell = |(): &mut (), (i, j), sink: CellSink<'_, 3>| {
        if film.reaches(i, j, &wanted) {
            sample_cell(paths, &film, (i, j), samples, seed, sink);
        }
    };
    let sums = over_film(&film, samples, progress, || (), cell)?;
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

fn sample_cell(
    paths: &Paths<'_>,
    film: &FilmPlane,
    (i, j): (usize, usize),
    samples: usize,
    seed: u64,
    sink: CellSink<'_, 3>,
) {
    if !film.cell_counts(i, j) {
        return;
    }
    let origin = paths.scene.description.camera.origin;
    let mut drawn = Vec::with_capacity(TOGETHER);
    let (mut directions, mut hits) = (Vec::with_capacity(TOGETHER), Vec::with_capacity(TOGETHER));
    for first in (0..samples).step_by(TOGETHER) {
        if sink.stopped() {
            return;
        }
        drawn.clear();
        drawn.extend((first..samples.min(first + TOGETHER)).map(|sample| {
            let mut numbers = numbers(seed, (i, j), sample, samples, PATH);
            let u = film.point(i, j, numbers.pair());
            let film = film.through(&mut numbers);
            (sample, u, film.still.origin.value(), film.ray(u), numbers)
        }));
        directions.clear();
        if film.has_lens() {
            hits.clear();
            hits.extend(drawn.iter().map(|&(_, _, o, d, _)| paths.scene.closest(o, d, None)));
        } else {
            directions.extend(drawn.iter().map(|&(.., direction, _)| direction));
            paths.scene.closest_bundle(origin, &directions, None, &mut hits);
        }
        for (&mut (sample, u, origin, direction, ref mut numbers), &hit) in drawn.iter_mut().zip(&hits) {
            let radiance = paths.still_radiance(origin, direction, hit, 1, numbers);
            if !radiance.is_finite() {
                sink.non_finite.push(film.located(i, j, sample));
                continue;
            }
            film.for_each_pixel(i, j, |_, b, x, y| {
                sink.row_sums.add(
                    group(sample, samples),
                    b,
                    x,
                    &(film.weight([u.x, u.y], x, y) * radiance).to_array(),
                );
            });
        }
    }
}
