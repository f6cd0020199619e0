//! Edge sampling (Li, Aittala, Durand and Lehtinen 2018), for the image plane.

use super::Method;
use super::edge_points::PixelEdges;
use super::error::EstimatorError;
use super::plane::{self, Covectors, GradientImage, LinearMethod, VertexGradient, View};
use crate::plane::{EdgeTree, Film, Image, MaterialPoint, Motion, Scene};
use crate::random::Stream;

/// dI/dθ = ∫ h ∂f/∂θ du + ∮ h Δf (v·ν) dl, with the boundary term sampled on the edges: the residual of V = 0
/// (see [`boundary`](crate::boundary)).
///
/// Edges are chosen by the length of their part inside the pixel's support, visible or not; a sampled point
/// counts if nothing covers it. The method's costs are that occlusion test and the samples spent on hidden
/// edges.
///
/// Unbiased if no two visible edges coincide: the shape below is found at the point itself, so an edge that
/// lies exactly under another is assumed to extend across it.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct EdgeSampling {
    /// Samples per pixel: one point of the area and one of an edge each.
    pub samples: usize,
    /// Random seed.
    pub seed: u64,
}

impl Default for EdgeSampling {
    fn default() -> Self {
        Self { samples: 64, seed: 0 }
    }
}

impl Method for EdgeSampling {
    fn name(&self) -> &'static str {
        "edge sampling"
    }

    fn forward(&self, scene: &Scene, motion: &Motion, film: &Film) -> Result<GradientImage, EstimatorError> {
        plane::forward(self, scene, motion, film)
    }

    fn reverse(&self, scene: &Scene, film: &Film, adjoint: &Image) -> Result<VertexGradient, EstimatorError> {
        plane::reverse(self, scene, film, adjoint)
    }
}

impl LinearMethod for EdgeSampling {
    type Prepared = EdgeTree;
    type Pixel = PixelEdges;

    fn samples(&self) -> usize {
        self.samples
    }

    fn seed(&self) -> u64 {
        self.seed
    }

    fn prepare(&self, scene: &Scene, _: &Film) -> Result<EdgeTree, EstimatorError> {
        Ok(EdgeTree::new(scene))
    }

    fn pixel(&self, view: &View<'_, EdgeTree>, x: usize, y: usize) -> PixelEdges {
        PixelEdges::new(&view.prepared, view.scene, view.film, view.film.centre(x, y))
    }

    fn sample(
        &self,
        view: &View<'_, EdgeTree>,
        pixel: &PixelEdges,
        rng: &mut Stream,
        mut emit: impl FnMut(&MaterialPoint, &Covectors),
    ) -> u64 {
        let (scene, film) = (view.scene, view.film);
        let s = film.sample(pixel.centre(), rng);
        let hit = scene.hit(s.u);
        if let (Some(hit), Some(g)) = (&hit, scene.material_gradient(hit.as_ref(), s.u)) {
            emit(hit.point(), &g.map(|g| -s.value * g));
        }
        let (point, rays) = pixel.draw(scene, film, rng);
        if let Some(point) = point {
            emit(&point.material, &point.jump().to_array().map(|f| f * point.outward));
        }
        1 + rays
    }
}
