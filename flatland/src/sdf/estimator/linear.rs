//! Common parts of the estimators: pixel samples, their means, and reverse mode.

use glam::DVec2;
use rayon::prelude::*;

use super::Estimate;
use crate::moments::Moments;
use crate::random::{Stream, open01, stream};
use crate::sdf::{AngularFilm, RayCount};

/// Number of batches from which reverse mode estimates its standard error.
const BATCHES: usize = 16;

/// A direction within a pixel's support, sampled uniformly: h and h′ divided by the density are bounded.
pub(super) struct PixelSample {
    pub(super) direction: DVec2,
    /// h/p.
    pub(super) value: f64,
    /// h′/p.
    pub(super) slope: f64,
}

impl PixelSample {
    pub(super) fn draw(film: &AngularFilm, pixel: usize, rng: &mut Stream) -> Self {
        let offset = film.radius() * (2.0 * open01(rng) - 1.0);
        let width = 2.0 * film.radius();
        Self {
            direction: DVec2::from_angle(film.centre(pixel) + offset),
            value: width * film.value(offset),
            slope: width * film.slope(offset),
        }
    }
}

/// One sample of one pixel.
pub(super) struct Sampled {
    pub(super) value: f64,
    pub(super) rays: RayCount,
}

/// Sums of samples, with their cost.
#[derive(Clone, Copy, Default)]
struct Sums {
    values: Moments,
    rays: RayCount,
    non_finite: u64,
}

fn sample_stream(seed: u64, pixel: usize, sample: usize) -> Stream {
    stream(seed, &[pixel as u64, sample as u64])
}

/// The mean of `samples` samples of every pixel.
pub(super) fn forward(
    film: &AngularFilm,
    samples: usize,
    seed: u64,
    sample: impl Fn(usize, &mut Stream) -> Sampled + Sync,
) -> Estimate {
    let of_pixel = |pixel: usize| {
        let mut sums = Sums::default();
        for index in 0..samples {
            let found = sample(pixel, &mut sample_stream(seed, pixel, index));
            sums.values.push(if found.value.is_finite() { found.value } else { 0.0 });
            sums.rays += found.rays;
            sums.non_finite += u64::from(!found.value.is_finite());
        }
        sums
    };
    let sums: Vec<Sums> = (0..film.count()).into_par_iter().map(of_pixel).collect();
    let rays: RayCount = sums.iter().map(|s| s.rays).sum();
    Estimate {
        mean: sums.iter().map(|s| s.values.mean()).collect(),
        standard_error: sums.iter().map(|s| s.values.standard_error()).collect(),
        rays: rays.traced,
        non_finite: sums.iter().map(|s| s.non_finite).sum(),
        out_of_steps: rays.out_of_steps,
    }
}

/// The gradient of Σ_p adjoint_p I_p, from the same samples: `scatter` adds a sample of a pixel, times its
/// adjoint, to the gradient of the parameters.
pub(super) fn reverse(
    samples: usize,
    seed: u64,
    (adjoint, parameters): (&[f64], usize),
    scatter: impl Fn(usize, f64, &mut Stream, &mut [f64]) -> RayCount + Sync,
) -> Estimate {
    let batches = BATCHES.min(samples);
    let of_batch = |batch: usize| {
        let (mut total, mut one) = (vec![0.0; parameters], vec![0.0; parameters]);
        let mut sums = Sums::default();
        for (pixel, &delta) in adjoint.iter().enumerate() {
            for index in (batch..samples).step_by(batches) {
                one.fill(0.0);
                let mut rng = sample_stream(seed, pixel, index);
                sums.rays += scatter(pixel, delta, &mut rng, &mut one);
                if one.iter().all(|g| g.is_finite()) {
                    total.iter_mut().zip(&one).for_each(|(t, g)| *t += g);
                } else {
                    sums.non_finite += 1;
                }
            }
        }
        (total, sums)
    };
    let found: Vec<(Vec<f64>, Sums)> = (0..batches).into_par_iter().map(of_batch).collect();
    // Number of samples of a batch: (samples − batch) divided by the stride, rounded up.
    let size = |batch: usize| (samples - batch).div_ceil(batches) as f64;
    let of_parameter = |parameter: usize| {
        let mut spread = Moments::default();
        found.iter().enumerate().for_each(|(b, (total, _))| spread.push(total[parameter] / size(b)));
        let mean = found.iter().map(|(total, _)| total[parameter]).sum::<f64>() / samples as f64;
        (mean, spread.standard_error())
    };
    let rays: RayCount = found.iter().map(|(_, s)| s.rays).sum();
    let (mean, standard_error) = (0..parameters).map(of_parameter).unzip();
    Estimate {
        mean,
        standard_error,
        rays: rays.traced,
        non_finite: found.iter().map(|(_, s)| s.non_finite).sum(),
        out_of_steps: rays.out_of_steps,
    }
}
