//! Trial: a run of few samples.

use glam::DVec3;

use crate::Image;
use crate::gradient::GradientImage;
use crate::scene::Scene;

/// Result of a trial, in which pixels are weighted by the squares of weights.
pub(super) struct Trial<'a> {
    pub(super) scene: &'a Scene,
    pub(super) image: GradientImage,
    pub(super) weights: Option<&'a Image>,
}

impl Trial<'_> {
    /// Variances of curves on the film, before lights and before everything else, summed over pixels.
    pub(super) fn curves(&self) -> [f64; 3] {
        let noise = &self.image.noise;
        [&noise.film_curves, &noise.shading_curves, &noise.bounce_curves]
            .map(|variance| weighted(variance, self.weights).iter().sum())
    }

    /// Derivative of a pixel, and its squared standard error.
    pub(super) fn pixel(&self, pixel: usize) -> (DVec3, f64) {
        let weight = self.weights.map_or(DVec3::ONE, |weights| weights.pixels[pixel]);
        let finite = |v: DVec3| if v.is_finite() { v } else { DVec3::ZERO };
        let gradient = finite(weight * self.image.gradient.pixels[pixel]);
        (gradient, finite(weight * self.image.standard_error.pixels[pixel]).length_squared())
    }
}

/// Sum of an image's channels by pixel, weighted by the squares of another image; 0 where it is not finite.
pub(super) fn weighted(variance: &Image, weights: Option<&Image>) -> Vec<f64> {
    let finite = |v: f64| if v.is_finite() { v } else { 0.0 };
    let of = |(i, v): (usize, &DVec3)| match weights {
        Some(weights) => v.dot(weights.pixels[i] * weights.pixels[i]),
        None => v.element_sum(),
    };
    variance.pixels.iter().enumerate().map(of).map(finite).collect()
}
