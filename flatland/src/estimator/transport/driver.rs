//! Forward and reverse mode of all methods along paths whose samples are linear in the rates.

use glam::DVec4;

use super::record::{Job, Scratch};
use super::streams::Streams;
use crate::estimator::driver;
use crate::estimator::error::{EstimatorError, check_adjoint};
use crate::estimator::estimate::Estimate;
use crate::transport::{ActiveParameters, Camera, Parameters, Tangent, Terms, World};

/// dI/dθ of every pixel, term by term.
pub type GradientImage = Estimate<Vec<Terms<f64>>, Errors>;

/// dL/dp of every parameter p, term by term, with the standard error of the sum of the terms.
pub type Gradient = Estimate<Terms<Tangent>, Tangent>;

/// Standard errors of an image's pixels.
#[derive(Clone, Debug, PartialEq)]
pub struct Errors {
    /// Standard error of each term.
    pub by_term: Vec<Terms<f64>>,
    /// Standard error of the sum of the terms.
    pub total: Vec<f64>,
}

impl GradientImage {
    /// The derivative of every pixel.
    #[must_use]
    pub fn total(&self) -> Vec<f64> {
        self.mean.iter().map(|t| t.total()).collect()
    }
}

impl Gradient {
    /// The gradient.
    #[must_use]
    pub fn total(&self) -> Tangent {
        self.mean.interior.clone().and(&self.mean.primary).and(&self.mean.secondary)
    }
}

/// A method whose sample is a sum of covectors times rates. Forward mode multiplies, reverse mode scatters
/// the same covectors, so each is the transpose of the other by construction.
pub(super) trait LinearMethod: Sync {
    /// Data prepared once per pixel.
    type Pixel: Sync;

    /// Checks the method's own parameters.
    fn check(&self) -> Result<(), EstimatorError> {
        Ok(())
    }

    /// Data shared by all samples of a world and camera.
    fn job<'a>(&self, world: &'a World, camera: &'a Camera, active: ActiveParameters) -> Job<'a>;

    fn pixel(&self, job: &Job<'_>, pixel: usize) -> Self::Pixel;

    /// One sample of a pixel: emits covectors and returns the number of rays.
    fn sample(&self, job: &Job<'_>, pixel: &Self::Pixel, streams: &mut Streams, scratch: &mut Scratch)
    -> u64;
}

pub(super) fn forward<M: LinearMethod>(
    method: &M,
    world: &World,
    camera: &Camera,
    change: &Tangent,
) -> Result<GradientImage, EstimatorError> {
    let active = ActiveParameters {
        geometry: change.is_geometric(),
        materials: change.materials.iter().any(|m| *m != Default::default()),
    };
    camera.check()?;
    method.check()?;
    change.check(world)?;
    let job = &method.job(world, camera, active);
    let rates = &change.values().collect::<Vec<f64>>();
    let estimate = driver::forward(camera.film.pixels, job.samples, |pixel| {
        let prepared = method.pixel(job, pixel);
        let mut scratch = Scratch::default();
        move |sample| {
            scratch.clear();
            let mut streams = Streams::new(job.seed, pixel, sample);
            let rays = method.sample(job, &prepared, &mut streams, &mut scratch);
            let mut value = Terms::default();
            for covector in &scratch.covectors {
                value += covector.terms * rates[covector.parameter];
            }
            (with_total(value), rays.into())
        }
    })?;
    Ok(by_term(estimate))
}

/// The three terms and their sum, as one sample value.
pub(super) fn with_total(value: Terms<f64>) -> DVec4 {
    let [interior, primary, secondary] = value.to_array();
    DVec4::new(interior, primary, secondary, value.total())
}

fn without_total(value: DVec4) -> Terms<f64> {
    Terms { interior: value.x, primary: value.y, secondary: value.z }
}

/// An image of the values of [`with_total`].
pub(super) fn by_term(estimate: Estimate<Vec<DVec4>>) -> GradientImage {
    estimate.map(|mean, error| {
        let terms = |values: &[DVec4]| values.iter().map(|v| without_total(*v)).collect();
        (terms(&mean), Errors { by_term: terms(&error), total: error.iter().map(|e| e.w).collect() })
    })
}

pub(super) fn reverse<M: LinearMethod>(
    method: &M,
    world: &World,
    camera: &Camera,
    adjoint: &[f64],
) -> Result<Gradient, EstimatorError> {
    camera.check()?;
    method.check()?;
    check_adjoint((camera.film.pixels, 1), (adjoint.len(), 1))?;
    let job = &method.job(world, camera, ActiveParameters { geometry: true, materials: true });
    let estimate = driver::reverse(adjoint.len(), job.samples, Parameters::count(world), |pixel| {
        let delta = adjoint[pixel];
        (delta != 0.0).then(|| {
            let prepared = method.pixel(job, pixel);
            let mut scratch = Scratch::default();
            move |sample, out: &mut driver::Covectors<DVec4>| {
                scratch.clear();
                let mut streams = Streams::new(job.seed, pixel, sample);
                let rays = method.sample(job, &prepared, &mut streams, &mut scratch);
                let covectors = scratch.covectors.iter();
                out.extend(covectors.map(|c| (c.parameter, with_total(c.terms) * delta)));
                rays.into()
            }
        })
    })?;
    Ok(estimate.map(|mean, error| {
        let tangent =
            |values: &[DVec4], term: usize| Tangent::of_values(world, values.iter().map(|v| v[term]));
        let [interior, primary, secondary] = [0, 1, 2].map(|term| tangent(&mean, term));
        (Terms { interior, primary, secondary }, tangent(&error, 3))
    }))
}
