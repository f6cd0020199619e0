//! The residual boundary integral of a warp field.

use glam::{DVec2, DVec3};

use super::edge_points::PixelEdges;
use super::error::EstimatorError;
use super::plane::{GradientImage, gradient_image};
use crate::boundary::residual_speed;
use crate::plane::{EdgeTree, Film, Scene};
use crate::warp::{Plane, WarpField};

/// Σ ∮ h Δf (v − V)·ν dl of every pixel, sampled on the edges, for any continuous field V.
///
/// Together with the [`AreaIntegral`](super::AreaIntegral) of the same field it is the derivative of the
/// image, whether or not the field is boundary consistent, by the [residual theorem](crate::boundary)
/// (Theory 7). Use different seeds for the two, as variances add only if the samples are independent. The
/// integral is unbiased if no two visible edges coincide, and if V is exact or estimated without bias.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct BoundaryIntegral {
    /// Samples per pixel, at least 2; with one, the standard error is NaN.
    pub samples: usize,
    /// Random seed.
    pub seed: u64,
}

impl BoundaryIntegral {
    /// The integral of every pixel.
    ///
    /// # Errors
    /// [`EstimatorError::NoSamples`].
    pub fn forward(
        &self,
        scene: &Scene,
        velocities: &[DVec2],
        film: &Film,
        field: &impl WarpField<Plane>,
    ) -> Result<GradientImage, EstimatorError> {
        let tree = EdgeTree::new(scene);
        gradient_image(film, self.samples, self.seed, |x, y| {
            let edges = PixelEdges::new(&tree, scene, film, film.centre(x, y));
            move |rng| {
                let (point, rays) = edges.draw(scene, film, rng);
                let Some(point) = point else { return (DVec3::ZERO, rays) };
                let (v, more) = field.at(point.u, rng);
                let speed = residual_speed(point.material.velocity(velocities), v.value, point.outward);
                (point.jump() * speed, rays + more)
            }
        })
    }
}
