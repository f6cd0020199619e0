//! The boundary integral that a warp field leaves over.

use glam::{DVec2, DVec3};

use super::edge_points::PixelEdges;
use super::error::EstimatorError;
use super::plane::{GradientImage, gradient_image};
use crate::boundary::residual_speed;
use crate::plane::{EdgeTree, Film, Scene};
use crate::warp::{Plane, WarpField};

/// Σ ∮ h Δf (v − V)·ν dl of every pixel, sampled on the edges, for any continuous field V.
///
/// With the [`AreaIntegral`](super::AreaIntegral) of the same field it is the derivative of the image,
/// whether the field is boundary consistent or not: the [residual theorem](crate::boundary) (Theory 7). Their
/// samples must be independent, so give them other seeds, or add their variances with care. The integral is
/// unbiased if no two visible edges coincide, and if V is known exactly, or estimated without bias.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct BoundaryIntegral {
    /// Samples a pixel: at least 2, or the standard error is not a number.
    pub samples: usize,
    /// Seed.
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
