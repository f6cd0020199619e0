//! Central finite differences with common random numbers.

use glam::{DVec2, DVec3};

use super::Method;
use super::error::{EstimatorError, check_step};
use super::estimate::Estimate;
use super::plane::{GradientImage, VertexGradient, check_size, gradient_image};
use crate::plane::{Film, Image, Motion, Scene};

/// (I(θ + step) − I(θ − step))/(2 step), from the same samples of both images.
///
/// The bias is O(step²) where the image is smooth in θ. The variance is O(1/step): only samples that an edge
/// crosses contribute, 1/(2 step) each.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct FiniteDifference {
    /// Samples per pixel.
    pub samples: usize,
    /// The step, in units of θ.
    pub step: f64,
    /// Random seed.
    pub seed: u64,
}

impl Default for FiniteDifference {
    fn default() -> Self {
        Self { samples: 64, step: 1e-2, seed: 0 }
    }
}

impl Method for FiniteDifference {
    fn name(&self) -> &'static str {
        "finite differences"
    }

    fn forward(&self, scene: &Scene, motion: &Motion, film: &Film) -> Result<GradientImage, EstimatorError> {
        check_step(self.step)?;
        let [plus, minus] = [self.step, -self.step].map(|theta| motion.displace(scene, theta));
        let (plus, minus) = (plus?, minus?);
        let scale = 0.5 / self.step;
        gradient_image(film, self.samples, self.seed, |x, y| {
            let centre = film.centre(x, y);
            let (plus, minus) = (&plus, &minus);
            move |rng| {
                let s = film.sample(centre, rng);
                let value = |scene: &Scene| -> DVec3 { scene.value(scene.hit(s.u).as_ref(), s.u) };
                (scale * s.value * (value(plus) - value(minus)), 2)
            }
        })
    }

    /// One central difference per coordinate of every vertex, at the cost of two images each. The standard
    /// error is an upper bound: it assumes the channels of a pixel to be fully correlated.
    fn reverse(&self, scene: &Scene, film: &Film, adjoint: &Image) -> Result<VertexGradient, EstimatorError> {
        check_size(film, adjoint)?;
        let mut out = Estimate::exact(vec![], vec![]);
        for shape in 0..scene.shapes().len() {
            for vertex in 0..scene.vertex_range(shape).len() {
                let (mut mean, mut error) = (DVec2::ZERO, DVec2::ZERO);
                for axis in 0..2 {
                    let motion = Motion::vertex(shape, vertex, DVec2::AXES[axis]);
                    let image = self.forward(scene, &motion, film)?;
                    mean[axis] = adjoint.dot(&image.mean);
                    // Channels share their samples: in the worst case their errors add.
                    let errors = adjoint.zip(&image.standard_error, |a, e| (a * e).abs());
                    let squares = errors.pixels().iter().map(|p| p.element_sum().powi(2));
                    error[axis] = squares.sum::<f64>().sqrt();
                    out.rays += image.rays;
                    out.non_finite.extend(image.non_finite);
                }
                out.mean.push(mean);
                out.standard_error.push(error);
            }
        }
        Ok(out)
    }
}
