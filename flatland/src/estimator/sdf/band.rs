//! Relaxed boundary term, in a band next to the silhouette (Wang et al. 2024).

use glam::DVec2;

use super::driver;
use super::sample::PixelSample;
use crate::estimator::error::{EstimatorError, check_direction};
use crate::estimator::estimate::Estimate;
use crate::random::Stream;
use crate::sdf::Seen;
use crate::sdf::{AngularFilm, Jet, RayCount, Scene, Sdf, near_misses};

/// Interior term plus the boundary term of rays that pass the surface within ε (Wang et al. 2024, "A Simple
/// Approach to Differentiable Rendering of SDFs").
///
/// Where φ has a local minimum 0 < φ(x*) < ε along a ray, the ray passes a silhouette, and (Theory 10)
///
/// ```text
/// Σ_∂ h (L_front − L_behind) v ≈ −(1/ε) ∫ h (L(x*) − L) φ̇(x*) dα   over 0 < φ(x*) < ε.
/// ```
///
/// Biased by O(ε), with variance O(1/ε); the boundary term needs no derivative of the tracer.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct RelaxedBoundary {
    /// Samples per pixel.
    pub samples: usize,
    /// ε, in units of length.
    pub width: f64,
    /// Random seed.
    pub seed: u64,
}

/// A sample: covectors of (φ̇, ∇φ̇) at points.
struct Covectors {
    points: Vec<(DVec2, Jet<DVec2>)>,
    rays: RayCount,
}

impl RelaxedBoundary {
    /// dI/dθ of every pixel along a direction in parameter space.
    ///
    /// # Errors
    /// If the direction does not fit the shape, ε is not positive or no samples were requested.
    pub fn forward(
        &self,
        scene: &Scene,
        direction: &[f64],
        film: &AngularFilm,
    ) -> Result<Estimate<Vec<f64>>, EstimatorError> {
        check_direction(scene.shape().parameter_count(), direction)?;
        self.check()?;
        driver::forward(film, (self.samples, self.seed), |pixel, rng| {
            let Covectors { points, rays } = self.draw(scene, film, pixel, rng);
            let value = points.iter().map(|(x, c)| c.dot(scene.shape().rate(*x, direction))).sum();
            (value, rays)
        })
    }

    /// ∂L/∂θ of every parameter for the loss whose ∂L/∂I is `adjoint`.
    ///
    /// # Errors
    /// If the adjoint image does not fit the film, ε is not positive or no samples were requested.
    pub fn reverse(
        &self,
        scene: &Scene,
        film: &AngularFilm,
        adjoint: &[f64],
    ) -> Result<Estimate<Vec<f64>>, EstimatorError> {
        self.check()?;
        driver::reverse((scene, film), (self.samples, self.seed), adjoint, |pixel, delta, rng, gradient| {
            let Covectors { points, rays } = self.draw(scene, film, pixel, rng);
            for (x, covector) in points {
                scene.shape().add_parameter_gradient(x, covector * delta, gradient);
            }
            rays
        })
    }

    fn check(&self) -> Result<(), EstimatorError> {
        let good = self.width > 0.0 && self.width.is_finite();
        if good { Ok(()) } else { Err(EstimatorError::Band { width: self.width }) }
    }

    fn draw(&self, scene: &Scene, film: &AngularFilm, pixel: usize, rng: &mut Stream) -> Covectors {
        let sample = PixelSample::draw(film, pixel, rng);
        let view = scene.view();
        let trace = view.trace(sample.direction);
        let Seen { radiance, hit, .. } = scene.seen(&trace);
        let mut points: Vec<_> = hit.map(|(x, covector)| (x, covector * sample.value)).into_iter().collect();
        for x in near_misses(&view, &trace, self.width) {
            let front = scene.radiance_at(x, scene.shape().jet(x).gradient);
            let value = -sample.value * (front - radiance) / self.width;
            points.push((x, Jet { value, gradient: DVec2::ZERO }));
        }
        Covectors { points, rays: trace.count() }
    }
}
