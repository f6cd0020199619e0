//! Edge sampling (Li, Aittala, Durand and Lehtinen 2018), for the image plane.

use glam::{DVec2, DVec3};

use super::linear::{self, Covectors, LinearMethod, View};
use super::{EstimatorError, GradientImage, Method, VertexGradient};
use crate::plane::{Edge, EdgeTree, Film, Image, MaterialPoint, Motion, Scene};
use crate::random::{Stream, open01};

/// dI/dθ = ∫ h ∂f/∂θ du + ∮ h Δf (v·ν) dl, with the boundary term sampled on the edges.
///
/// Edges are chosen by the length of their part inside the pixel's support, whether they can be
/// seen or not; a sampled point counts if nothing above covers it. That occlusion test, and the
/// samples spent on hidden edges, are what the method pays.
///
/// Unbiased if no two visible edges coincide: the shape below is what lies at the point itself, so
/// an edge that lies exactly under another is taken to extend across it.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct EdgeSampling {
    /// Samples a pixel: one point of the area and one of an edge each.
    pub samples: usize,
    /// Seed.
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
        linear::forward(self, scene, motion, film)
    }

    fn reverse(&self, scene: &Scene, film: &Film, adjoint: &Image) -> Result<VertexGradient, EstimatorError> {
        linear::reverse(self, scene, film, adjoint)
    }
}

/// The edges of one pixel's support, with the cumulative length of their parts inside.
pub(super) struct PixelEdges {
    centre: DVec2,
    parts: Vec<Part>,
}

struct Part {
    edge: Edge,
    /// The part inside, as parameters along the edge.
    range: (f64, f64),
    /// The length of all parts up to and including this one.
    cumulative: f64,
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
        let centre = view.film.centre(x, y);
        let mut parts = vec![];
        let mut cumulative = 0.0;
        view.prepared.inside(view.scene, view.film.support(centre), |&edge, range| {
            cumulative += edge.length * (range.1 - range.0);
            parts.push(Part { edge, range, cumulative });
        });
        PixelEdges { centre, parts }
    }

    fn sample(
        &self,
        view: &View<'_, EdgeTree>,
        pixel: &PixelEdges,
        rng: &mut Stream,
        mut emit: impl FnMut(&MaterialPoint, &Covectors),
    ) -> u64 {
        let (scene, film) = (view.scene, view.film);
        let s = film.sample(pixel.centre, rng);
        let hit = scene.hit(s.u);
        if let (Some(hit), Some(g)) = (&hit, scene.material_gradient(hit.as_ref(), s.u)) {
            emit(hit.point(), &g.map(|g| -s.value * g));
        }
        let Some(length) = pixel.parts.last().map(|part| part.cumulative) else { return 1 };
        let at = open01(rng) * length;
        let part =
            &pixel.parts[pixel.parts.partition_point(|p| p.cumulative < at).min(pixel.parts.len() - 1)];
        let t = part.range.0 + open01(rng) * (part.range.1 - part.range.0);
        let edge = &part.edge;
        let [p, q] = edge.vertices.map(|v| scene.vertices()[v]);
        let u = p.lerp(q, t);
        if scene.is_covered(u, edge.shape) {
            return 2;
        }
        let below = scene.hit_below(u, edge.shape);
        let jump: DVec3 = scene.shape_value(edge.shape, u) - scene.value(below.as_ref(), u);
        let covector = film.filter_value(pixel.centre, u) * length * edge.outward;
        emit(&MaterialPoint::on_edge(edge.vertices, t), &jump.to_array().map(|f| f * covector));
        3
    }
}
