//! Central differences with common random numbers: (I(θ + h) − I(θ − h))/2h.

use glam::DVec3;

use super::driver::{CellSink, FilmSums, finish, over_film};
use super::error::GradientError;
use super::film::FilmPlane;
use super::groups::{group, group_range};
use super::progress::Progress;
use super::result::GradientImage;
use super::tangent::Tangent;
use super::unit_weights::UnitWeights;
use super::unsupported::supports_field_of_view;

use super::DIFFERENCE_PATH;
use crate::path::{Kernels, Paths, Sequence};
use crate::scene::Scene;

/// Central finite differences.
///
/// The error has a part ~ h² that samples do not cure, and a standard error ~ (h n)^−½ wherever jumps move: a sample
/// sees a jump move with probability ~ h, and then contributes ~ 1/h. It differentiates everything, mirrors and
/// point lights too. Both sides have the same random numbers, and those are independent of [`render`](super::render)'s.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct FiniteDifference {
    /// Samples a pixel, each traced twice.
    pub samples: usize,
    /// h, in units of the change's parameter.
    pub step: f64,
    /// The seed of everything random.
    pub seed: u64,
}

impl Default for FiniteDifference {
    fn default() -> Self {
        Self { samples: 64, step: 1e-3, seed: 0 }
    }
}

impl FiniteDifference {
    /// The derivative of every pixel along a change. The image that comes with it is the mean of both sides.
    ///
    /// # Errors
    /// [`GradientError`]: a step that is not positive, or that leads out of a parameter's range.
    pub fn forward(
        &self,
        scene: &Scene,
        change: &Tangent,
        progress: &Progress,
    ) -> Result<GradientImage, GradientError> {
        if !change.fits(scene) {
            return Err(GradientError::Tangent);
        }
        supports_field_of_view(scene, change)?;
        if self.samples == 0 {
            return Err(GradientError::Samples { samples: 0, least: 1 });
        }
        if !(self.step > 0.0 && self.step.is_finite()) {
            return Err(GradientError::Step { step: self.step });
        }
        let sides = [change.displaced(scene, self.step)?, change.displaced(scene, -self.step)?];
        let paths = [&sides[0], &sides[1]].map(|scene| Paths::new(scene, Kernels::default()));
        let films = [&sides[0], &sides[1]].map(FilmPlane::new);
        let film = FilmPlane::new(scene);
        let cell = |(): &mut (), place, sink: CellSink<'_, 6>| self.cell(&paths, &films, place, sink);
        let counted = (self.samples, UnitWeights::of_shared_numbers(&film, self.samples));
        let sums: FilmSums<6> = over_film(&film, counted, progress, || (), cell)?;
        let mut image = finish::<1, 6>(&film, sums, self.samples);
        sides.iter().for_each(|side| image.traces += side.trace_counts());
        Ok(image)
    }

    /// The random numbers of a sample, which no other cell has: where cells share them, an edge that is
    /// parallel to rows of pixels passes samples of all of them at once or none.
    fn numbers(&self, (i, j): (usize, usize), sample: usize) -> Sequence {
        let group = group(sample, self.samples);
        let address = [i as u64, j as u64, group as u64, DIFFERENCE_PATH];
        Sequence::new(self.seed, &address, sample - group_range(group, self.samples).start)
    }

    fn cell(
        &self,
        paths: &[Paths<'_>; 2],
        films: &[FilmPlane; 2],
        (i, j): (usize, usize),
        mut sink: CellSink<'_, 6>,
    ) {
        let film = &films[0];
        if !film.cell_counts(i, j) {
            return;
        }
        for sample in 0..self.samples {
            if sink.stopped() {
                return;
            }
            let mut place = self.numbers((i, j), sample);
            let u = film.point(i, j, place.pair());
            let [plus, minus] = std::array::from_fn(|side| {
                let (paths, mut numbers) = (&paths[side], place.clone());
                let film = films[side].through(&mut numbers);
                let (origin, direction) = (film.still.origin.value(), film.ray(u));
                let hit = paths.scene.closest(origin, direction, None);
                paths.still_radiance(origin, direction, hit, 1, &mut numbers)
            });
            let (mean, difference): (DVec3, DVec3) =
                (0.5 * (plus + minus), (plus - minus) / (2.0 * self.step));
            if !difference.is_finite() {
                sink.non_finite.push(film.located(i, j, sample));
                continue;
            }
            let mut amount = 0.0;
            film.for_each_pixel(i, j, |_, b, x, y| {
                let weight = film.weight([u.x, u.y], x, y);
                let (value, rate) = (weight * mean, weight * difference);
                let quantities = [value.x, value.y, value.z, rate.x, rate.y, rate.z];
                sink.row_sums.add(group(sample, self.samples), b, x, &quantities, weight);
                amount += rate.abs().element_sum();
            });
            sink.row_sums.add_light(film, (i, j), group(sample, self.samples), mean);
            sink.contributed(film.located(i, j, sample), amount);
        }
    }
}
