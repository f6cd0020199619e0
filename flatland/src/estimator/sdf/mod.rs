//! The methods that differentiate the image of an implicit shape's [`Scene`].
//!
//! | method | boundary term | biased |
//! |---|---|---|
//! | [`AreaIntegral`] | ∇·(V h L), any field | as its field |
//! | [`RelaxedBoundary`] | a band of width ε next to the silhouette | O(ε) |
//! | [`ImplicitHit`] | none | by the whole boundary term: needs masks |
//!
//! Forward mode differentiates every pixel along one direction in parameter space, reverse mode one loss,
//! given by ∂L/∂I of every pixel, with respect to every parameter. Both use the same random numbers: they are
//! a linear map and its transpose.

mod area;
mod band;
mod driver;
mod sample;

pub use area::{AreaIntegral, ImplicitHit, Terms};
pub use band::RelaxedBoundary;

use super::error::EstimatorError;
use super::estimate::Estimate;
use crate::sdf::{AngularFilm, Scene};
use sample::PixelSample;

/// The image by sampling: ∫ h L of every pixel.
///
/// # Errors
/// If no samples were requested.
pub fn primal(
    scene: &Scene,
    film: &AngularFilm,
    samples: usize,
    seed: u64,
) -> Result<Estimate<Vec<f64>>, EstimatorError> {
    let view = scene.view();
    driver::forward(film, (samples, seed), |pixel, rng| {
        let sample = PixelSample::draw(film, pixel, rng);
        let trace = view.trace(sample.direction);
        (sample.value * scene.radiance(&trace), trace.count())
    })
}
