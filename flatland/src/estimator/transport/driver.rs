//! Forward and reverse mode of all methods whose samples are linear in the rates.

use rayon::prelude::*;

use super::record::{Job, Scratch};
use super::streams::Streams;
use super::{Gradient, GradientImage, PathError};
use crate::moments::Moments;
use crate::transport::{ActiveParameters, Camera, Parameters, Tangent, Terms, World};

/// A method whose sample is a sum of covectors times rates. Forward mode multiplies, reverse mode scatters
/// the same covectors, so each is the transpose of the other by construction.
pub(super) trait LinearMethod: Sync {
    /// Data prepared once per pixel.
    type Pixel: Sync;

    /// Checks the method's own parameters.
    fn check(&self) -> Result<(), PathError> {
        Ok(())
    }

    /// Data shared by all samples of a world and camera.
    fn job<'a>(&self, world: &'a World, camera: &'a Camera, active: ActiveParameters) -> Job<'a>;

    fn pixel(&self, job: &Job<'_>, pixel: usize) -> Self::Pixel;

    /// One sample of a pixel: emits covectors and returns the number of rays.
    fn sample(&self, job: &Job<'_>, pixel: &Self::Pixel, streams: &mut Streams, scratch: &mut Scratch)
    -> u64;
}

fn check<M: LinearMethod>(method: &M, job: &Job<'_>) -> Result<(), PathError> {
    job.camera.check()?;
    method.check()?;
    if job.samples == 0 { Err(PathError::NoSamples) } else { Ok(()) }
}

pub(super) fn forward<M: LinearMethod>(
    method: &M,
    world: &World,
    camera: &Camera,
    change: &Tangent,
) -> Result<GradientImage, PathError> {
    let active = ActiveParameters {
        geometry: change.is_geometric(),
        materials: change.materials.iter().any(|m| *m != Default::default()),
    };
    let job = method.job(world, camera, active);
    check(method, &job)?;
    change.check(world)?;
    let rates: Vec<f64> = change.values().collect();
    let pixels: Vec<PixelMoments> = (0..camera.film.pixels)
        .into_par_iter()
        .map(|pixel| {
            let prepared = method.pixel(&job, pixel);
            let mut scratch = Scratch::default();
            let mut moments = PixelMoments::default();
            for sample in 0..job.samples {
                scratch.clear();
                let mut streams = Streams::new(job.seed, pixel, sample);
                moments.rays += method.sample(&job, &prepared, &mut streams, &mut scratch);
                let mut value = Terms::default();
                for covector in &scratch.covectors {
                    value += covector.terms * rates[covector.parameter];
                }
                if !moments.add(value.to_array()) {
                    moments.non_finite.push((pixel, sample));
                }
            }
            moments
        })
        .collect();
    Ok(GradientImage {
        mean: pixels.iter().map(|p| terms([0, 1, 2].map(|i| p.moments[i].mean()))).collect(),
        term_error: pixels.iter().map(|p| terms([0, 1, 2].map(|i| p.moments[i].standard_error()))).collect(),
        standard_error: pixels.iter().map(|p| p.moments[3].standard_error()).collect(),
        rays: pixels.iter().map(|p| p.rays).sum(),
        non_finite: pixels.into_iter().flat_map(|p| p.non_finite).collect(),
    })
}

fn terms([interior, primary, secondary]: [f64; 3]) -> Terms<f64> {
    Terms { interior, primary, secondary }
}

/// Moments of the three terms and of their sum.
#[derive(Clone, Debug, Default)]
struct PixelMoments {
    moments: [Moments; 4],
    rays: u64,
    non_finite: Vec<(usize, usize)>,
}

impl PixelMoments {
    /// Adds a sample; returns whether it is finite. A non-finite sample counts as 0.
    fn add(&mut self, value: [f64; 3]) -> bool {
        let total = value[0] + value[1] + value[2];
        let finite = total.is_finite() && value.iter().all(|v| v.is_finite());
        let all = if finite { [value[0], value[1], value[2], total] } else { [0.0; 4] };
        self.moments.iter_mut().zip(all).for_each(|(m, v)| m.push(v));
        finite
    }
}

/// Number of independent batches in reverse mode: enough for a standard error, few enough to store.
const BATCHES: usize = 16;

pub(super) fn reverse<M: LinearMethod>(
    method: &M,
    world: &World,
    camera: &Camera,
    adjoint: &[f64],
) -> Result<Gradient, PathError> {
    let job = method.job(world, camera, ActiveParameters { geometry: true, materials: true });
    check(method, &job)?;
    if adjoint.len() != camera.film.pixels {
        return Err(PathError::AdjointSize { expected: camera.film.pixels, found: adjoint.len() });
    }
    let batches = BATCHES.min(job.samples);
    let parts: Vec<Batch> =
        (0..batches).into_par_iter().map(|batch| Batch::run(method, &job, adjoint, batch)).collect();
    let mut mean = vec![Terms::default(); Parameters::count(world)];
    for part in &parts {
        mean.iter_mut().zip(&part.gradient).for_each(|(m, g)| *m += *g);
    }
    let of = |term: fn(&Terms<f64>) -> f64| Tangent::of_values(world, mean.iter().map(term));
    Ok(Gradient {
        mean: Terms {
            interior: of(|t| t.interior),
            primary: of(|t| t.primary),
            secondary: of(|t| t.secondary),
        },
        standard_error: Tangent::of_values(world, standard_error(job.samples, &parts, &mean)),
        rays: parts.iter().map(|p| p.rays).sum(),
        non_finite: parts.into_iter().flat_map(|p| p.non_finite).collect(),
    })
}

/// Each batch estimates its share of the gradient; shares differ by at most one sample.
fn standard_error(samples: usize, parts: &[Batch], mean: &[Terms<f64>]) -> Vec<f64> {
    let mut squares = vec![0.0; mean.len()];
    for (batch, part) in parts.iter().enumerate() {
        let share = ((samples - batch).div_ceil(parts.len())) as f64 / samples as f64;
        for ((s, g), m) in squares.iter_mut().zip(&part.gradient).zip(mean) {
            *s += (g.total() - share * m.total()).powi(2);
        }
    }
    let factor = parts.len() as f64 / (parts.len() as f64 - 1.0);
    squares.into_iter().map(|s| (s * factor).sqrt()).collect()
}

struct Batch {
    /// In the order of [`Tangent::values`].
    gradient: Vec<Terms<f64>>,
    rays: u64,
    non_finite: Vec<(usize, usize)>,
}

impl Batch {
    fn run<M: LinearMethod>(method: &M, job: &Job<'_>, adjoint: &[f64], batch: usize) -> Self {
        let gradient = vec![Terms::default(); Parameters::count(job.world)];
        let mut this = Self { gradient, rays: 0, non_finite: vec![] };
        let step = BATCHES.min(job.samples);
        let mut scratch = Scratch::default();
        for (pixel, &delta) in adjoint.iter().enumerate() {
            if delta == 0.0 {
                continue;
            }
            let prepared = method.pixel(job, pixel);
            for sample in (batch..job.samples).step_by(step) {
                scratch.clear();
                let mut streams = Streams::new(job.seed, pixel, sample);
                this.rays += method.sample(job, &prepared, &mut streams, &mut scratch);
                if scratch.covectors.iter().all(|c| c.terms.total().is_finite()) {
                    let factor = delta / job.samples as f64;
                    for covector in &scratch.covectors {
                        this.gradient[covector.parameter] += covector.terms * factor;
                    }
                } else {
                    this.non_finite.push((pixel, sample));
                }
            }
        }
        this
    }
}
