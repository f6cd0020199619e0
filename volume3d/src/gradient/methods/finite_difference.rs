//! Central differences with common random numbers: (I(θ + h) − I(θ − h))/2h. At a bound of a parameter's
//! range they are one-sided: (I(θ + h) − I(θ))/h or (I(θ) − I(θ − h))/h.

use glam::DVec3;

use crate::gradient::film::FilmPlane;
use crate::gradient::film::driver::{CellSink, FilmSums, finish, over_film};
use crate::gradient::film::unit_weights::UnitWeights;
use crate::gradient::parameters::tangent::Tangent;
use crate::gradient::results::error::GradientError;
use crate::gradient::results::result::{GradientImage, OneSided};
use crate::gradient::run::groups::{group, group_range};
use crate::gradient::run::progress::Progress;
use crate::gradient::unsupported::supports_field_of_view;

use crate::gradient::run::streams::DIFFERENCE_PATH;
use crate::path::{Kernels, Paths, Sequence};
use crate::scene::Scene;

/// Central finite differences with common random numbers.
///
/// The bias is O(h²), whatever the number of samples. Where discontinuities move, the standard error is O((h
/// n)^−½): a sample sees a discontinuity move with probability O(h) and then contributes O(1/h). Everything
/// is differentiated, mirrors and point lights included. Both sides share their random numbers, which are
/// independent of those of [`render`](crate::gradient::render).
///
/// Where one side is outside a parameter's range, as that of a radiance of 0, it is replaced by the scene at
/// θ, and the bias is O(h): [`GradientImage::one_sided`] says so.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct FiniteDifference {
    /// Samples per pixel, each traced twice.
    pub samples: usize,
    /// Step h, in units of the tangent's parameter.
    pub step: f64,
    /// Random seed.
    pub seed: u64,
}

/// The scenes of a difference.
struct Sides {
    /// That of the greater θ first.
    scenes: [Scene; 2],
    /// By how much θ differs.
    apart: f64,
    one_sided: Option<OneSided>,
}

impl Default for FiniteDifference {
    fn default() -> Self {
        Self { samples: 64, step: 1e-3, seed: 0 }
    }
}

impl FiniteDifference {
    /// Derivative of every pixel along a tangent. The image returned with it is the mean of both sides.
    ///
    /// # Errors
    /// [`GradientError`]: a step that is not positive, or that leads out of a parameter's range on both
    /// sides.
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
        let Sides { scenes: sides, apart, one_sided } = self.sides(scene, change)?;
        let paths = [&sides[0], &sides[1]].map(|scene| Paths::new(scene, Kernels::default()));
        let films = [&sides[0], &sides[1]].map(FilmPlane::new);
        let film = FilmPlane::new(scene);
        let cell =
            |(): &mut (), place, sink: CellSink<'_, 6>| self.cell(&paths, (&films, apart), place, sink);
        let counted = (self.samples, UnitWeights::of_shared_numbers(&film, self.samples));
        let sums: FilmSums<6> = over_film(&film, counted, progress, || (), cell)?;
        let mut image = finish::<1, 6>(&film, sums, self.samples);
        sides.iter().for_each(|side| image.traces += side.trace_counts());
        image.one_sided = one_sided;
        Ok(image)
    }

    fn sides(&self, scene: &Scene, change: &Tangent) -> Result<Sides, GradientError> {
        let [ahead, behind] = [self.step, -self.step].map(|step| change.displaced(scene, step));
        let one_sided = |ahead, outside| Some(OneSided { ahead, outside });
        Ok(match (ahead, behind) {
            (Ok(ahead), Ok(behind)) => {
                Sides { scenes: [ahead, behind], apart: 2.0 * self.step, one_sided: None }
            }
            (Ok(ahead), Err(outside)) => {
                let scenes = [ahead, change.displaced(scene, 0.0)?];
                Sides { scenes, apart: self.step, one_sided: one_sided(true, outside) }
            }
            (Err(outside), Ok(behind)) => {
                let scenes = [change.displaced(scene, 0.0)?, behind];
                Sides { scenes, apart: self.step, one_sided: one_sided(false, outside) }
            }
            (Err(outside), Err(_)) => return Err(outside.into()),
        })
    }

    /// Random numbers of a sample, separate for every cell: if cells shared them, an edge parallel to rows of
    /// pixels would cross samples of all cells at once or of none.
    fn numbers(&self, (i, j): (usize, usize), sample: usize) -> Sequence {
        let group = group(sample, self.samples);
        let address = [i as u64, j as u64, group as u64, DIFFERENCE_PATH];
        Sequence::new(self.seed, &address, sample - group_range(group, self.samples).start)
    }

    fn cell(
        &self,
        paths: &[Paths<'_>; 2],
        (films, apart): (&[FilmPlane; 2], f64),
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
            let (mean, difference): (DVec3, DVec3) = (0.5 * (plus + minus), (plus - minus) / apart);
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
