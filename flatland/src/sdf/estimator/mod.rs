//! Estimators of the image of a [`Scene`] and its derivative.
//!
//! | method | boundary term | biased |
//! |---|---|---|
//! | [`AreaIntegral`] | ∇·(V h L), any field | as its field |
//! | [`RelaxedBoundary`] | a band of width ε next to the silhouette | O(ε) |
//! | [`ImplicitHit`] | none | by all of it: needs masks |
//!
//! Forward mode differentiates every pixel along one direction in parameter space, reverse mode one loss,
//! given by ∂L/∂I of every pixel, with respect to every parameter. Both use the same random numbers: they are
//! a linear map and its transpose.

mod area;
mod band;
mod linear;

pub use area::{AreaIntegral, ImplicitHit, Terms};
pub use band::RelaxedBoundary;

use super::fields::FieldError;
use super::{AngularFilm, Scene, Sdf};

/// Reason why a derivative cannot be estimated.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum EstimatorError {
    /// The field's parameters are out of range.
    #[error(transparent)]
    Field(#[from] FieldError),
    /// No samples were requested.
    #[error("at least one sample per pixel is needed")]
    NoSamples,
    /// A direction has the wrong number of parameters.
    #[error("a direction of {found} parameters for a shape that has {expected}")]
    Direction {
        /// Number of the shape's parameters.
        expected: usize,
        /// Number given.
        found: usize,
    },
    /// An adjoint image has the wrong number of pixels.
    #[error("an adjoint image of {found} pixels for a film of {expected}")]
    Adjoint {
        /// Number of the film's pixels.
        expected: usize,
        /// Number given.
        found: usize,
    },
    /// The width of the band must be positive and finite.
    #[error("the band's width ε = {width} is not positive and finite")]
    Band {
        /// ε.
        width: f64,
    },
}

/// A mean for every pixel (forward) or every parameter (reverse).
#[derive(Clone, Debug, PartialEq)]
pub struct Estimate {
    /// The estimate.
    pub mean: Vec<f64>,
    /// Standard error of the mean; NaN for a single sample.
    pub standard_error: Vec<f64>,
    /// Number of rays traced.
    pub rays: u64,
    /// Number of non-finite samples. They count as 0, which biases the mean.
    pub non_finite: u64,
    /// Number of these rays that ran out of steps: primary rays, those of the field and those at the ends of
    /// pixels. They count as misses, which biases the mean.
    pub out_of_steps: u64,
}

fn check_direction(scene: &Scene, direction: &[f64]) -> Result<(), EstimatorError> {
    let (expected, found) = (scene.shape().parameter_count(), direction.len());
    if expected == found { Ok(()) } else { Err(EstimatorError::Direction { expected, found }) }
}

fn check_adjoint(film: &AngularFilm, adjoint: &[f64]) -> Result<(), EstimatorError> {
    let (expected, found) = (film.count(), adjoint.len());
    if expected == found { Ok(()) } else { Err(EstimatorError::Adjoint { expected, found }) }
}

fn check_samples(samples: usize) -> Result<(), EstimatorError> {
    if samples > 0 { Ok(()) } else { Err(EstimatorError::NoSamples) }
}

/// The image by sampling: ∫ h L of every pixel.
///
/// # Errors
/// If no samples were requested.
pub fn primal(
    scene: &Scene,
    film: &AngularFilm,
    samples: usize,
    seed: u64,
) -> Result<Estimate, EstimatorError> {
    check_samples(samples)?;
    let view = scene.view();
    Ok(linear::forward(film, samples, seed, |pixel, rng| {
        let sample = linear::PixelSample::draw(film, pixel, rng);
        let trace = view.trace(sample.direction);
        linear::Sampled { value: sample.value * scene.radiance(&trace), rays: trace.count() }
    }))
}
