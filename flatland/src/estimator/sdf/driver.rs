//! Forward and reverse mode of all methods for implicit shapes.

use crate::estimator::driver::{self, Covectors, sample_stream};
use crate::estimator::error::{EstimatorError, check_adjoint};
use crate::estimator::estimate::Estimate;
use crate::random::Stream;
use crate::sdf::{AngularFilm, RayCount, Scene, Sdf as _};

/// The mean of `samples` samples of every pixel: `sample(pixel, stream)` is a sample's value and its rays.
pub(super) fn forward(
    film: &AngularFilm,
    (samples, seed): (usize, u64),
    sample: impl Fn(usize, &mut Stream) -> (f64, RayCount) + Sync,
) -> Result<Estimate<Vec<f64>>, EstimatorError> {
    let sample = &sample;
    driver::forward(film.count(), samples, |pixel| {
        move |index| sample(pixel, &mut sample_stream(seed, pixel, index))
    })
}

/// Gradient of Σ_p adjoint_p I_p, from the same samples. `scatter(pixel, adjoint, stream, gradient)` adds one
/// sample of a pixel, times its adjoint, to the gradient of the shape's parameters and returns its rays.
pub(super) fn reverse(
    (scene, film): (&Scene, &AngularFilm),
    (samples, seed): (usize, u64),
    adjoint: &[f64],
    scatter: impl Fn(usize, f64, &mut Stream, &mut [f64]) -> RayCount + Sync,
) -> Result<Estimate<Vec<f64>>, EstimatorError> {
    check_adjoint((film.count(), 1), (adjoint.len(), 1))?;
    let (parameters, scatter) = (scene.shape().parameter_count(), &scatter);
    driver::reverse(adjoint.len(), samples, parameters, |pixel| {
        let delta = adjoint[pixel];
        let mut gradient = vec![0.0; parameters];
        (delta != 0.0).then_some(move |index, out: &mut Covectors<f64>| {
            let rays = scatter(pixel, delta, &mut sample_stream(seed, pixel, index), &mut gradient);
            let found = gradient.iter_mut().enumerate().filter(|(_, g)| **g != 0.0);
            out.extend(found.map(|(parameter, g)| (parameter, std::mem::take(g))));
            rays
        })
    })
}
