//! Central finite differences with common random numbers.

use rayon::prelude::*;

use super::{Gradient, GradientImage, Method, PathError};
use crate::moments::Moments;
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

    fn forward(&self, world: &World, camera: &Camera, change: &Tangent) -> Result<GradientImage, PathError> {
        camera.check()?;
        change.check(world)?;
        if !(self.step > 0.0 && self.step.is_finite()) {
            return Err(PathError::Step { step: self.step });
        }
        if self.samples == 0 {
            return Err(PathError::NoSamples);
        }
        let displaced = |theta| {
            let displaced = world.displaced(change, theta);
            let camera = change.displaced_camera(camera, theta);
            camera.check()?;
            let world = displaced.map_err(|source| PathError::Displaced { theta, source })?;
            Ok::<_, PathError>((world, camera))
        };
        let (sides, width) = match [self.step, -self.step].map(displaced) {
            [Ok(plus), Ok(minus)] => ([plus, minus], 2.0 * self.step),
            [Ok(plus), Err(_)] => ([plus, (world.clone(), *camera)], self.step),
            [Err(_), Ok(minus)] => ([(world.clone(), *camera), minus], self.step),
            [Err(error), Err(_)] => return Err(error),
        };
        let pixels: Vec<_> = (0..camera.film.pixels)
            .into_par_iter()
            .map(|pixel| {
                let (mut moments, mut rays, mut bad) = (Moments::default(), 0, vec![]);
                for sample in 0..self.samples {
                    let [plus, minus] = sides.each_ref().map(|(world, camera)| {
                        let mut rng = path_stream(self.seed, pixel, sample);
                        let at = camera.film.sample(pixel, &mut rng);
                        let (value, traced) = self.paths.film_radiance(world, camera, at.u, &mut rng);
                        rays += traced;
                        at.value * value
                    });
                    let slope = (plus - minus) / width;
                    moments.push(if slope.is_finite() { slope } else { 0.0 });
                    if !slope.is_finite() {
                        bad.push((pixel, sample));
                    }
                }
                (moments, rays, bad)
            })
            .collect();
        let interior = |x: f64| Terms { interior: x, ..Terms::default() };
        Ok(GradientImage {
            mean: pixels.iter().map(|(m, ..)| interior(m.mean())).collect(),
            term_error: pixels.iter().map(|(m, ..)| interior(m.standard_error())).collect(),
            standard_error: pixels.iter().map(|(m, ..)| m.standard_error()).collect(),
            rays: pixels.iter().map(|p| p.1).sum(),
            non_finite: pixels.into_iter().flat_map(|p| p.2).collect(),
        })
    }

    /// A difference for every parameter: twice as many images as there are parameters.
    fn reverse(&self, world: &World, camera: &Camera, adjoint: &[f64]) -> Result<Gradient, PathError> {
        camera.check()?;
        if adjoint.len() != camera.film.pixels {
            return Err(PathError::AdjointSize { expected: camera.film.pixels, found: adjoint.len() });
        }
        let none = Tangent::none(world);
        let (mut values, mut errors) = (vec![], vec![]);
        let (mut rays, mut non_finite) = (0, vec![]);
        for parameter in 0..none.values().count() {
            let unit =
                Tangent::of_values(world, (0..=parameter).map(|i| f64::from(u8::from(i == parameter))));
            let image = self.forward(world, camera, &unit)?;
            values.push(image.total().iter().zip(adjoint).map(|(g, a)| g * a).sum::<f64>());
            let variance = image.standard_error.iter().zip(adjoint).map(|(e, a)| (e * a).powi(2));
            errors.push(variance.sum::<f64>().sqrt());
            rays += image.rays;
            non_finite.extend(image.non_finite);
        }
        let interior = Tangent::of_values(world, values);
        let mean = Terms { interior, primary: none.clone(), secondary: none };
        Ok(Gradient { mean, standard_error: Tangent::of_values(world, errors), rays, non_finite })
    }
}
