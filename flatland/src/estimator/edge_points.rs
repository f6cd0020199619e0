//! Sampling of points on the edges seen by a pixel.

use glam::{DVec2, DVec3};

use crate::plane::{Edge, EdgeTree, Film, Filter, Hit, MaterialPoint, Scene};
use crate::random::{Stream, open01};

/// Edges in one pixel's support, with the cumulative length of their parts inside.
pub(super) struct PixelEdges {
    centre: DVec2,
    parts: Vec<Part>,
}

struct Part {
    edge: Edge,
    /// The part inside, as parameters along the edge.
    range: (f64, f64),
    /// Total length of the parts up to and including this one.
    cumulative: f64,
}

/// A visible point of an edge.
pub(super) struct EdgePoint {
    /// Position.
    pub(super) u: DVec2,
    /// The material point with which it moves.
    pub(super) material: MaterialPoint,
    /// Outward normal of the shape.
    pub(super) outward: DVec2,
    /// h divided by the density.
    pub(super) weight: f64,
    /// f on the side of the shape, and on the other side.
    pub(super) values: [DVec3; 2],
    /// The hit on the other side.
    pub(super) beside: Option<Hit>,
}

impl EdgePoint {
    /// h Δf divided by the density, with Δf from the shape to the other side.
    pub(super) fn jump(&self) -> DVec3 {
        (self.values[0] - self.values[1]) * self.weight
    }
}

impl PixelEdges {
    pub(super) fn new(tree: &EdgeTree, scene: &Scene, film: &Film, centre: DVec2) -> Self {
        let mut parts = vec![];
        let mut cumulative = 0.0;
        let (low, high) = film.support(centre);
        let beside = if film.filter() == Filter::Box { film.border() } else { 0.0 };
        tree.inside(scene, (low - beside, high + beside), |&edge, range| {
            cumulative += edge.length * (range.1 - range.0);
            parts.push(Part { edge, range, cumulative });
        });
        Self { centre, parts }
    }

    pub(super) fn centre(&self) -> DVec2 {
        self.centre
    }

    /// A point uniform by length, if it is visible, and the number of rays.
    ///
    /// The shape below is found at the point itself, so an edge that lies exactly under another is assumed to
    /// extend across it.
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
        let weight = film.filter_share(self.centre, u) * length;
        let material = MaterialPoint::on_edge(edge.vertices, t);
        (Some(EdgePoint { u, material, outward: edge.outward, weight, values, beside }), 2)
    }
}

#[cfg(test)]
mod tests {
    use glam::{DVec2, DVec3};

    use crate::estimator::{Construction, EdgeSampling, EstimatorError, Exact, Method, WarpedArea};
    use crate::plane::exact::ExactError;
    use crate::plane::{Film, Filter, Motion, Polygon, Scene, Shade, Shape};

    /// A square over pixels 2 to 4 of 8 in both directions, moved to the right.
    fn square(moved: f64) -> Scene {
        let corners = [(2.0, 2.0), (5.0, 2.0), (5.0, 5.0), (2.0, 5.0)];
        let corners = corners.map(|(x, y)| DVec2::new(x + moved, y));
        let polygon = Polygon::simple(corners).expect("a square");
        Scene::new(DVec3::ZERO, vec![Shape::new(polygon, Shade::constant(DVec3::ONE))]).expect("a scene")
    }

    /// Pixels on both sides of an edge on their border get the mean of both one-sided derivatives, by every
    /// sampling method; the exact engine refuses. At a distance of a millionth of a pixel one of them gets
    /// all.
    #[test]
    fn edges_on_pixel_borders_are_a_part_of_both() {
        let film = Film::new(8, 8, Filter::Box).expect("a film");
        let motion = Motion::translate([0], DVec2::X);
        let methods: [(&str, Box<dyn Method>); 4] = [
            ("edges", Box::new(EdgeSampling { samples: 4000, seed: 1 })),
            ("auxiliary", Box::new(WarpedArea { samples: 2000, ..WarpedArea::default() })),
            ("mean", {
                let construction = Construction::JumpMean { reach: 0.6 };
                Box::new(WarpedArea { samples: 4000, construction, ..WarpedArea::default() })
            }),
            ("softened", {
                let construction = Construction::Softened { reach: 1.2, softness: 0.4 };
                Box::new(WarpedArea { samples: 4000, construction, ..WarpedArea::default() })
            }),
        ];
        for (moved, [before, behind]) in
            [(0.0, [0.5, 0.5]), (1e-15, [0.5, 0.5]), (1e-6, [0.0, 1.0]), (-1e-6, [1.0, 0.0])]
        {
            let scene = square(moved);
            let exact = Exact.forward(&scene, &motion, &film);
            assert_eq!(
                moved == 0.0,
                matches!(exact, Err(EstimatorError::Exact(ExactError::PixelEdge { shape: 0, .. }))),
                "{moved:e}"
            );
            for (name, method) in &methods {
                let found = method.forward(&scene, &motion, &film).expect("a gradient");
                for (x, expected) in
                    [(1, -before), (2, -behind), (4, before), (5, behind), (3, 0.0), (6, 0.0)]
                {
                    let at = 3 * 8 + x;
                    let (mean, error) = (found.mean.pixels()[at].x, found.standard_error.pixels()[at].x);
                    assert!(
                        (mean - expected).abs() <= 6.5 * error + 2e-3 && error < 0.05,
                        "{name}, moved by {moved:e}, pixel {x}: {mean} ± {error} for {expected}"
                    );
                }
            }
        }
    }
}
