//! The image itself.

use flatland::random::{open01, stream};
use glam::DVec3;
use rayon::prelude::*;

use super::film::FilmPlane;
use super::progress::Progress;
use super::result::{Image, NonFinite};
use super::strip::{Cell, Sheet, Strip};
use super::{PATH, Stopped};
use crate::path::{Kernels, Paths, Plain};
use crate::scene::Scene;

/// Renders a scene with `samples` paths a pixel.
///
/// The same seed gives the same bits at any number of threads, and the same as the image of a gradient.
///
/// # Errors
/// [`Stopped`] if `progress` asked for an end.
pub fn render(scene: &Scene, samples: usize, seed: u64, progress: &Progress) -> Result<Image, Stopped> {
    let paths = Paths::new(scene, Kernels::default());
    primal(&paths, samples, seed, progress)
}

pub(super) fn primal(
    paths: &Paths<'_>,
    samples: usize,
    seed: u64,
    progress: &Progress,
) -> Result<Image, Stopped> {
    let film = FilmPlane::new(paths.scene);
    let (columns, rows) = (film.columns + 2 * film.reach, film.rows + 2 * film.reach);
    let mut sheet = Sheet::<3>::new(&film);
    let mut non_finite = vec![];
    progress.start(rows);
    for wave in super::waves(rows) {
        let strips: Vec<_> = wave
            .into_par_iter()
            .map(|j| {
                let mut bad = vec![];
                let mut strip = Strip::new(&film, j);
                let mut cell = Cell::new(&film);
                for i in 0..columns {
                    if progress.stopped() {
                        break;
                    }
                    if film.cell_counts(i, j) {
                        sample_cell(paths, &film, (i, j), samples, seed, &mut cell, &mut bad);
                        strip.absorb(i, &mut cell, samples);
                    }
                }
                progress.advance();
                (strip, bad)
            })
            .collect();
        if progress.stopped() {
            return Err(Stopped);
        }
        for (strip, bad) in strips {
            sheet.absorb(&strip);
            non_finite.extend(bad);
        }
    }
    Ok(Image {
        width: film.columns,
        height: film.rows,
        pixels: sheet.mean.iter().map(|&m| DVec3::from_array(m)).collect(),
        standard_error: sheet.variance.iter().map(|v| DVec3::from_array(v.map(f64::sqrt))).collect(),
        non_finite,
    })
}

fn sample_cell(
    paths: &Paths<'_>,
    film: &FilmPlane,
    (i, j): (usize, usize),
    samples: usize,
    seed: u64,
    cell: &mut Cell<3>,
    bad: &mut Vec<NonFinite>,
) {
    let frame = film.frame(&paths.scene.description.camera);
    for sample in 0..samples {
        let mut rng = stream(seed, &[i as u64, j as u64, sample as u64, PATH]);
        let u = film.point(i, j, [open01(&mut rng), open01(&mut rng)]);
        let direction = film.direction(&frame, [u.x, u.y]);
        let hit = paths.closest(frame.origin.value(), direction.value(), None);
        let radiance =
            paths.radiance(&mut Plain { scene: paths.scene }, frame.origin, direction, hit, &mut rng).value();
        if !radiance.is_finite() {
            bad.push(film.located(i, j, sample));
            continue;
        }
        film.for_each_pixel(i, j, |a, b, x, y| {
            cell.add(a, b, &(film.weight([u.x, u.y], x, y) * radiance).to_array());
        });
        cell.next_sample();
    }
}
