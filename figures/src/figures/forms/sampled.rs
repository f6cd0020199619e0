//! The area integral by sampling: bias, and equality of its two forms.

use flatland::estimator::{AreaIntegral, Construction, Form, Method, WarpedArea};
use flatland::plane::Film;
use flatland::plane::fields::AuxiliaryField;
use flatland::warp::{Warp, Weighting};

use super::super::common::{channel, root_mean_square};
use super::exact::SHOWN;
use super::scene::Example;
use crate::context::Context;

/// Standard errors below this part of the derivative's root mean square get no z-score: nearly all samples of
/// such a pixel were alike, and the few that were not are too few to estimate an error.
pub(super) const SETTLED: f64 = 1e-3;

/// An estimate of every pixel, compared with the exact value.
pub(super) struct Estimate {
    pub(super) mean: Vec<f64>,
    pub(super) standard_error: Vec<f64>,
    /// (mean − exact)/standard error; NaN where the standard error is below [`SETTLED`].
    pub(super) z: Vec<f64>,
    pub(super) samples: usize,
    pub(super) rays: u64,
}

impl Estimate {
    /// The pixels that have a z-score.
    pub(super) fn scores(&self) -> Vec<f64> {
        self.z.iter().copied().filter(|z| !z.is_nan()).collect()
    }

    /// Root mean square z-score: 1 if the standard errors are correct.
    pub(super) fn root_mean_square_score(&self) -> f64 {
        root_mean_square(&self.scores())
    }

    pub(super) fn rays_per_sample(&self) -> f64 {
        self.rays as f64 / (self.samples * self.mean.len()) as f64
    }
}

/// Warped-area sampling with a weight.
pub(super) fn estimate(
    context: &Context,
    example: &Example,
    film: &Film,
    exact: &[f64],
    weighting: Weighting,
) -> anyhow::Result<Estimate> {
    let samples = context.spend(256, 4096);
    let warp = Warp { weighting, ..Warp::default() };
    let construction = warp.into();
    let method = WarpedArea { samples, construction, seed: context.seed(), ..WarpedArea::default() };
    let gradient = method.forward(&example.scene, &example.motion, film)?;
    let mean = channel(&gradient.mean, SHOWN);
    let standard_error = channel(&gradient.standard_error, SHOWN);
    let least = SETTLED * root_mean_square(exact);
    let scored = mean.iter().zip(&standard_error).zip(exact);
    let z = scored
        .map(|((mean, error), exact)| if *error > least { (mean - exact) / error } else { f64::NAN })
        .collect();
    Ok(Estimate { mean, standard_error, z, samples, rays: gradient.rays })
}

/// One sample of each pixel in both forms, from the same random numbers: (area, reparameterised).
pub(super) fn sample_pairs(
    context: &Context,
    example: &Example,
    film: &Film,
) -> anyhow::Result<Vec<(f64, f64)>> {
    let kappa = Construction::KAPPA / (film.pixel() * film.pixel());
    let (scene, velocities) = (&example.scene, &example.velocities);
    let field = AuxiliaryField { scene, velocities, warp: Warp::default(), kappa };
    let one = |form, seed| -> anyhow::Result<Vec<f64>> {
        let integral = AreaIntegral { samples: 1, form, control_variate: false, seed };
        Ok(channel(&integral.forward(scene, velocities, film, &field)?.mean, SHOWN))
    };
    let seeds = context.seed()..context.seed() + context.spend(4, 16);
    let mut pairs = vec![];
    for seed in seeds {
        pairs.extend(one(Form::Area, seed)?.into_iter().zip(one(Form::Reparameterised, seed)?));
    }
    Ok(pairs)
}
