//! The residual boundary integral of a warp field.

use glam::DVec2;

use super::GradientImage;
use super::edge_points::PixelEdges;
use super::linear::{gradient_image, sample_stream};
use crate::boundary::residual_speed;
use crate::plane::{EdgeTree, Film, Scene};
use crate::warp::{Plane, WarpField};

/// Σ ∮ h Δf (v − V)·ν dl of every pixel, sampled on the edges, for any continuous field V.
///
/// Together with the [`AreaIntegral`](super::AreaIntegral) of the same field it is the derivative of the
/// image, whether or not the field is boundary consistent: the [residual theorem](crate::boundary). Use
/// different seeds for the two, as variances add only if the samples are independent. The integral is
/// unbiased if no two visible edges coincide, and if V is exact or estimated without bias.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct BoundaryIntegral {
    /// Samples per pixel, at least 2; with one, the standard error is NaN.
    pub samples: usize,
    /// Random seed.
    pub seed: u64,
}

impl BoundaryIntegral {
    /// The integral of every pixel.
    #[must_use]
    pub fn forward(
        &self,
        scene: &Scene,
        velocities: &[DVec2],
        film: &Film,
        field: &impl WarpField<Plane>,
    ) -> GradientImage {
        let tree = EdgeTree::new(scene);
        gradient_image(film, self.samples, |x, y| {
            let edges = PixelEdges::new(&tree, scene, film, film.centre(x, y));
            let index = y * film.width() + x;
            move |sample| {
                let mut rng = sample_stream(self.seed, index, sample);
                let (point, rays) = edges.draw(scene, film, &mut rng);
                let Some(point) = point else { return (glam::DVec3::ZERO, rays) };
                let (v, more) = field.at(point.u, &mut rng);
                let speed = residual_speed(point.material.velocity(velocities), v.value, point.outward);
                (point.jump() * speed, rays + more)
            }
        })
    }
}
