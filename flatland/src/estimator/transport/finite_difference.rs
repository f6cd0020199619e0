//! Central finite differences with common random numbers.

use super::Method;
use super::driver::{Gradient, GradientImage, by_term, with_total};
use crate::estimator::driver;
use crate::estimator::error::{EstimatorError, check_adjoint, check_step};
use crate::estimator::estimate::Estimate;
use crate::transport::{Camera, Paths, Tangent, Terms, World, path_stream};

/// (I(θ + h) − I(θ − h))/2h, with the same random numbers on both sides. If one side is not a valid world,
/// for example because an albedo or radiance would be negative, it is (I(θ ± h) − I(θ))/±h.
///
/// Biased by O(h²) I''', one-sided by O(h) I'', where the image is smooth; the variance grows as 1/h wherever
/// paths are discontinuous. Terms are not separated: all is reported as interior.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct FiniteDifference {
    /// Paths per pixel and side.
    pub samples: usize,
    /// Termination of paths.
    pub paths: Paths,
    /// The step h.
    pub step: f64,
    /// Random seed.
    pub seed: u64,
}

impl Default for FiniteDifference {
    fn default() -> Self {
        Self { samples: 64, paths: Paths::default(), step: 1e-3, seed: 0 }
    }
}

impl Method for FiniteDifference {
    fn name(&self) -> &'static str {
        "finite differences"
    }

    fn forward(
        &self,
        world: &World,
        camera: &Camera,
        change: &Tangent,
    ) -> Result<GradientImage, EstimatorError> {
        camera.check()?;
        change.check(world)?;
        check_step(self.step)?;
        let displaced = |theta| {
            let displaced = world.displaced(change, theta);
            let camera = change.displaced_camera(camera, theta);
            camera.check()?;
            let world = displaced.map_err(|source| EstimatorError::Displaced { theta, source })?;
            Ok::<_, EstimatorError>((world, camera))
        };
        let (sides, width) = match [self.step, -self.step].map(displaced) {
            [Ok(plus), Ok(minus)] => ([plus, minus], 2.0 * self.step),
            [Ok(plus), Err(_)] => ([plus, (world.clone(), *camera)], self.step),
            [Err(_), Ok(minus)] => ([(world.clone(), *camera), minus], self.step),
            [Err(error), Err(_)] => return Err(error),
        };
        let sides = &sides;
        let estimate = driver::forward(camera.film.pixels, self.samples, |pixel| {
            move |sample| {
                let mut rays = 0;
                let [plus, minus] = sides.each_ref().map(|(world, camera)| {
                    let mut rng = path_stream(self.seed, pixel, sample);
                    let at = camera.film.sample(pixel, &mut rng);
                    let (value, traced) = self.paths.film_radiance(world, camera, at.u, &mut rng);
                    rays += traced;
                    at.value * value
                });
                let interior = (plus - minus) / width;
                (with_total(Terms { interior, ..Terms::default() }), rays.into())
            }
        })?;
        Ok(by_term(estimate))
    }

    /// One central difference per parameter, at the cost of two images each.
    fn reverse(&self, world: &World, camera: &Camera, adjoint: &[f64]) -> Result<Gradient, EstimatorError> {
        camera.check()?;
        check_adjoint((camera.film.pixels, 1), (adjoint.len(), 1))?;
        let none = Tangent::none(world);
        let (mut values, mut errors) = (vec![], vec![]);
        let mut out = Estimate::exact((), ());
        for parameter in 0..none.values().count() {
            let unit =
                Tangent::of_values(world, (0..=parameter).map(|i| f64::from(u8::from(i == parameter))));
            let image = self.forward(world, camera, &unit)?;
            values.push(image.total().iter().zip(adjoint).map(|(g, a)| g * a).sum::<f64>());
            let variance = image.standard_error.total.iter().zip(adjoint).map(|(e, a)| (e * a).powi(2));
            errors.push(variance.sum::<f64>().sqrt());
            out.rays += image.rays;
            out.non_finite.extend(image.non_finite);
        }
        let interior = Tangent::of_values(world, values);
        let mean = Terms { interior, primary: none.clone(), secondary: none };
        Ok(out.map(|(), ()| (mean, Tangent::of_values(world, errors))))
    }
}
