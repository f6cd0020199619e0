//! Points of the edges that a pixel sees.

use glam::{DVec2, DVec3};

use crate::plane::{Edge, EdgeTree, Film, Hit, MaterialPoint, Scene};
use crate::random::{Stream, open01};

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

/// A point of an edge that is seen.
pub(super) struct EdgePoint {
    /// Where it is.
    pub(super) u: DVec2,
    /// What it moves with.
    pub(super) material: MaterialPoint,
    /// The normal that points out of the shape.
    pub(super) outward: DVec2,
    /// h over the density.
    pub(super) weight: f64,
    /// f on the side of the shape, and beside it.
    pub(super) values: [DVec3; 2],
    /// What is seen beside it.
    pub(super) beside: Option<Hit>,
}

impl EdgePoint {
    /// h Δf over the density, with Δf from the shape to what is beside it.
    pub(super) fn jump(&self) -> DVec3 {
        (self.values[0] - self.values[1]) * self.weight
    }
}

impl PixelEdges {
    pub(super) fn new(tree: &EdgeTree, scene: &Scene, film: &Film, centre: DVec2) -> Self {
        let mut parts = vec![];
        let mut cumulative = 0.0;
        tree.inside(scene, film.support(centre), |&edge, range| {
            cumulative += edge.length * (range.1 - range.0);
            parts.push(Part { edge, range, cumulative });
        });
        Self { centre, parts }
    }

    pub(super) fn centre(&self) -> DVec2 {
        self.centre
    }

    /// A point uniform by length, if it is seen, and the number of rays it took to know.
    ///
    /// The shape below is what lies at the point itself, so an edge that lies exactly under another is taken to extend
    /// across it.
    pub(super) fn draw(&self, scene: &Scene, film: &Film, rng: &mut Stream) -> (Option<EdgePoint>, u64) {
        let Some(length) = self.parts.last().map(|part| part.cumulative) else { return (None, 0) };
        let at = open01(rng) * length;
        let part = &self.parts[self.parts.partition_point(|p| p.cumulative < at).min(self.parts.len() - 1)];
        let t = part.range.0 + open01(rng) * (part.range.1 - part.range.0);
        let edge = &part.edge;
        let [p, q] = edge.vertices.map(|v| scene.vertices()[v]);
        let u = p.lerp(q, t);
        if scene.is_covered(u, edge.shape) {
            return (None, 1);
        }
        let beside = scene.hit_below(u, edge.shape);
        let values = [scene.shape_value(edge.shape, u), scene.value(beside.as_ref(), u)];
        let weight = film.filter_value(self.centre, u) * length;
        let material = MaterialPoint::on_edge(edge.vertices, t);
        (Some(EdgePoint { u, material, outward: edge.outward, weight, values, beside }), 2)
    }
}
