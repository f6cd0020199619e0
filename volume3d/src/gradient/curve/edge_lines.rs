//! Lines through points of edges: discontinuities seen from shading points, in the path-space form (Zhang,
//! Miller, Yan, Gkioulekas and Zhao 2020; Theory 9).
//!
//! At a shading point x the boundary term is ∮ f cos θ ΔL (v − V)·ν dl over the curves on the sphere of
//! directions on which edges are seen. With e the edge's unit direction, x_B its point at arc length s, ω the
//! direction from x to it and t the distance,
//!
//! > dA dl (v − V)·ν = (ω × e)·(ẋ_B − ẋ − t V)/|n·ω| dω ds,
//!
//! with ẋ the velocity of x at fixed directions of the path before it, or at directions that V moves, dA a
//! patch of the surface at x, and dω its solid angle at x_B. Sample a point of an edge and a direction
//! through it, and trace to x.

use glam::DVec3;

use super::address::{Address, BACKWARDS};
use super::drawing::{CameraSubpath, Edge, EdgeList, Sensor, Sides, Vertex, aside, look_past, near};
use super::field::WarpField;
use super::moving::Moving;
use super::seen_edge::SeenEdge;
use crate::path::Paths;

/// Traces lines through points of edges to shading points, and on to the camera.
#[derive(Debug)]
pub(super) struct EdgeLines<'a> {
    pub(super) sensor: Sensor<'a>,
    pub(super) list: &'a EdgeList,
    pub(super) moving: &'a Moving,
    /// Largest number of path segments before the discontinuity.
    pub(super) longest: usize,
}

/// A line through a point of an edge.
#[derive(Debug)]
pub(super) struct Line<'e> {
    pub(super) edge: &'e Edge,
    /// Position along the edge.
    along: f64,
    pub(super) point: DVec3,
    /// Direction to the light.
    pub(super) direction: DVec3,
    /// ω × e.
    normal: DVec3,
    /// Distance from the point at which rays along the line start.
    pub(super) near: f64,
}

/// An edge point as seen from the shading point where a line arrives.
#[derive(Debug)]
pub(super) struct View {
    pub(super) edge: SeenEdge,
    pub(super) x: DVec3,
    /// Directions on either side of the edge, along which surfaces there are evaluated: a point of a surface
    /// that ends at a lamp is lit by it, and the end itself is not.
    pub(super) directions: [DVec3; 2],
    pub(super) sides: Sides,
}

impl<'a> EdgeLines<'a> {
    pub(super) fn new(paths: &'a Paths<'a>, list: &'a EdgeList, moving: &'a Moving) -> Self {
        let limit = paths.scene.description.integrator.max_depth.unwrap_or(usize::MAX);
        Self { sensor: Sensor::new(paths), list, moving, longest: limit.saturating_sub(1) }
    }

    /// The line through a point of an edge along a direction.
    pub(super) fn line(&self, edge: &'a Edge, along: f64, direction: DVec3) -> Line<'a> {
        let scene = self.sensor.paths.scene;
        let [a, b] = edge.span(scene);
        let (point, near) = (a.lerp(b, along), near(scene, self.list, edge));
        Line { edge, along, point, direction, normal: direction.cross((b - a) / a.distance(b)), near }
    }

    /// Whether the edge ends a surface along the line.
    pub(super) fn ends_surface(&self, line: &Line<'_>) -> bool {
        let occupied = self.list.occupied(self.sensor.paths.scene, line.edge, line.normal);
        occupied[0] != occupied[1]
    }

    /// Calls back with every camera path to the point where a line arrives, if the edge is seen from there.
    pub(super) fn trace<V: WarpField>(
        &self,
        line: &Line<'_>,
        address: Address,
        mut found: impl FnMut(&CameraSubpath<'_>, &View),
    ) {
        let scene = self.sensor.paths.scene;
        let Some(hit) = scene.beyond(line.point, -line.direction, line.near) else { return };
        let shape = scene.shape_of(hit.surface) as usize;
        // Relative to a field, static shading points slide as well.
        if self.longest == 1
            && V::IS_ZERO
            && !(self.moving.camera || self.moving.shapes[shape] || self.moving.has_any(line.edge.shapes))
        {
            return;
        }
        let start = Vertex { position: line.point - line.direction * hit.distance, surface: hit.surface };
        // Camera subpaths and the paths beyond the edge must not share random numbers.
        let mut backwards = address.numbers(BACKWARDS);
        let mut view: Option<Option<View>> = None;
        self.sensor.each_subpath(start, line.direction, self.longest, &mut backwards, |path| {
            if let Some(view) = view.get_or_insert_with(|| self.view(line, start, hit.distance)) {
                found(&path, view);
            }
        });
    }

    fn view(&self, line: &Line<'_>, start: Vertex, distance: f64) -> Option<View> {
        let &Line { edge, along, direction, normal, .. } = line;
        let scene = self.sensor.paths.scene;
        let across = aside(edge.span(scene), start.position, distance) * normal.normalize_or_zero();
        let directions = [-1.0, 1.0].map(|s| (direction + s * across).normalize());
        let from = (start.position, Some(start.surface));
        let sides = look_past(scene, self.list, edge, from, directions, distance)?;
        let edge = SeenEdge { span: edge.span, along, direction, distance, normal };
        Some(View { edge, x: start.position, directions, sides })
    }
}
