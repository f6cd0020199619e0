//! The Monte Carlo driver of all estimators: sums over samples, forward by pixel and in reverse by batch.
//!
//! Sample s of pixel p draws from a stream of its own, so that results depend only on the seed, not on
//! threads, and forward and reverse mode use the same random numbers: they are a linear map and its
//! transpose.
//!
//! A non-finite sample counts as 0 and is reported with its pixel, in both modes.

use std::ops::{Add, AddAssign, Mul, Sub};

use glam::{DVec2, DVec3, DVec4};
use rayon::prelude::*;

use super::error::EstimatorError;
use super::estimate::Estimate;
use crate::moments::Moments;
use crate::random::{Stream, stream};
use crate::sdf::RayCount;

/// A sample's value, or a component of a gradient: a number or a vector of numbers.
pub(super) trait Value:
    Copy
    + Default
    + Send
    + Sync
    + Add<Output = Self>
    + AddAssign
    + Sub<Output = Self>
    + Mul<Output = Self>
    + Mul<f64, Output = Self>
{
    fn is_finite(self) -> bool;
    fn sqrt(self) -> Self;
}

macro_rules! value {
    ($($type:ty: $root:expr;)*) => {$(
        impl Value for $type {
            fn is_finite(self) -> bool {
                Self::is_finite(self)
            }
            fn sqrt(self) -> Self {
                $root(self)
            }
        }
    )*};
}

value! {
    f64: f64::sqrt;
    DVec2: |v: DVec2| v.map(f64::sqrt);
    DVec3: |v: DVec3| v.map(f64::sqrt);
    DVec4: |v: DVec4| v.map(f64::sqrt);
}

/// The stream of one sample of one pixel.
pub(super) fn sample_stream(seed: u64, pixel: usize, sample: usize) -> Stream {
    stream(seed, &[pixel as u64, sample as u64])
}

/// Mean and standard error over the samples of every pixel; `pixel(p)` returns the function from the index of
/// a sample to its value and rays.
///
/// # Errors
/// [`EstimatorError::NoSamples`].
pub(super) fn forward<T: Value, F: FnMut(usize) -> (T, RayCount)>(
    pixels: usize,
    samples: usize,
    pixel: impl Fn(usize) -> F + Sync,
) -> Result<Estimate<Vec<T>>, EstimatorError> {
    if samples == 0 {
        return Err(EstimatorError::NoSamples);
    }
    let sums: Vec<(Moments<T>, Cost)> = (0..pixels)
        .into_par_iter()
        .map(|p| {
            let mut sample = pixel(p);
            let (mut moments, mut cost) = (Moments::default(), Cost::default());
            for s in 0..samples {
                let (value, rays) = sample(s);
                cost.rays += rays;
                moments.push(if value.is_finite() { value } else { T::default() });
                if !value.is_finite() {
                    cost.non_finite.push((p, s));
                }
            }
            (moments, cost)
        })
        .collect();
    let mean = sums.iter().map(|(m, _)| m.mean()).collect();
    let standard_error = sums.iter().map(|(m, _)| m.variance_of_mean().sqrt()).collect();
    Ok(Cost::sum(sums.into_iter().map(|(_, cost)| cost)).estimate(mean, standard_error))
}

/// Number of independent batches in reverse mode: enough for a standard error, few enough to store.
const BATCHES: usize = 16;

/// Covectors of one sample, by parameter.
pub(super) type Covectors<T> = Vec<(usize, T)>;

/// ∂L/∂p of every parameter p. `pixel(p)` returns the function that pushes the covectors of a sample, times
/// the pixel's adjoint ∂L/∂I, and returns its rays; it is `None` where the adjoint is 0.
///
/// # Errors
/// [`EstimatorError::NoSamples`].
pub(super) fn reverse<T: Value, F: FnMut(usize, &mut Covectors<T>) -> RayCount>(
    pixels: usize,
    samples: usize,
    parameters: usize,
    pixel: impl Fn(usize) -> Option<F> + Sync,
) -> Result<Estimate<Vec<T>>, EstimatorError> {
    if samples == 0 {
        return Err(EstimatorError::NoSamples);
    }
    let batches = BATCHES.min(samples);
    let scale = 1.0 / samples as f64;
    let parts: Vec<(Vec<T>, Cost)> = (0..batches)
        .into_par_iter()
        .map(|batch| {
            let (mut gradient, mut cost) = (vec![T::default(); parameters], Cost::default());
            let mut covectors = vec![];
            for p in 0..pixels {
                let Some(mut sample) = pixel(p) else { continue };
                for s in (batch..samples).step_by(batches) {
                    covectors.clear();
                    cost.rays += sample(s, &mut covectors);
                    if covectors.iter().all(|(_, c)| c.is_finite()) {
                        covectors.iter().for_each(|&(parameter, c)| gradient[parameter] += c * scale);
                    } else {
                        cost.non_finite.push((p, s));
                    }
                }
            }
            (gradient, cost)
        })
        .collect();
    let mut mean = vec![T::default(); parameters];
    for (gradient, _) in &parts {
        mean.iter_mut().zip(gradient).for_each(|(m, g)| *m += *g);
    }
    // Each batch estimates its share of the gradient; shares differ by at most one sample.
    let mut squares = vec![T::default(); parameters];
    for (batch, (gradient, _)) in parts.iter().enumerate() {
        let share = (samples - batch).div_ceil(batches) as f64 * scale;
        for ((s, g), m) in squares.iter_mut().zip(gradient).zip(&mean) {
            let d = *g - *m * share;
            *s += d * d;
        }
    }
    let factor = batches as f64 / (batches as f64 - 1.0);
    let standard_error = squares.into_iter().map(|s| (s * factor).sqrt()).collect();
    Ok(Cost::sum(parts.into_iter().map(|(_, cost)| cost)).estimate(mean, standard_error))
}

/// Rays of samples, and the non-finite samples, as (pixel, sample).
#[derive(Debug, Default)]
struct Cost {
    rays: RayCount,
    non_finite: Vec<(usize, usize)>,
}

impl Cost {
    fn sum(costs: impl Iterator<Item = Self>) -> Self {
        costs.fold(Self::default(), |mut sum, cost| {
            sum.rays += cost.rays;
            sum.non_finite.extend(cost.non_finite);
            sum
        })
    }

    fn estimate<M>(self, mean: M, standard_error: M) -> Estimate<M> {
        let Self { rays: RayCount { traced, out_of_steps }, non_finite } = self;
        Estimate { mean, standard_error, rays: traced, out_of_steps, non_finite }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::random::open01;

    const SAMPLES: usize = 50;
    const RATES: [f64; 3] = [0.3, -0.7, 2.0];

    /// Covectors of a sample for three parameters, occasionally non-finite.
    fn sample(pixel: usize, sample: usize) -> [f64; 3] {
        let mut rng = sample_stream(3, pixel, sample);
        RATES.map(|_| if open01(&mut rng) < 0.1 { f64::INFINITY } else { open01(&mut rng) })
    }

    /// Non-finite samples count as 0 forward and in reverse, and both report them.
    #[test]
    fn forward_and_reverse_are_transposes_where_samples_fail() {
        let adjoint = [1.0, -2.0, 0.0, 0.5];
        let image = forward(4, SAMPLES, |p| {
            move |s| (sample(p, s).iter().zip(RATES).map(|(c, r)| c * r).sum::<f64>(), RayCount::from(1))
        })
        .unwrap();
        let gradient = reverse(4, SAMPLES, 3, |p| {
            let delta = adjoint[p];
            (delta != 0.0).then_some(move |s, out: &mut Covectors<f64>| {
                out.extend(sample(p, s).map(|c| c * delta).into_iter().enumerate());
                RayCount::from(1)
            })
        })
        .unwrap();
        let along: f64 = image.mean.iter().zip(adjoint).map(|(g, a)| g * a).sum();
        let back: f64 = gradient.mean.iter().zip(RATES).map(|(g, r)| g * r).sum();
        assert!((along - back).abs() < 1e-12 * along.abs(), "{along} {back}");
        let mut seen: Vec<_> = image.non_finite.into_iter().filter(|(p, _)| adjoint[*p] != 0.0).collect();
        let mut found = gradient.non_finite;
        seen.sort_unstable();
        found.sort_unstable();
        assert!(seen.len() > 20 && seen == found, "{seen:?} {found:?}");
        assert_eq!((image.rays, gradient.rays), (200, 150));
    }

    #[test]
    fn no_samples_are_an_error() {
        let none = forward(1, 0, |_| |_| (0.0, RayCount::from(0)));
        assert_eq!(none.err(), Some(EstimatorError::NoSamples));
    }
}
