//! Edges in front of reflecting surfaces and a constant environment, as seen from shading points (Theory 9).
//!
//! Directions through edge points are uniform over those in which radiance may be discontinuous. With V = 0
//! that is at all folds. A field that is softened within lobes leaves silhouettes and crossings, as on the
//! film ([`film_edges`](super::film_edges)): the light of one side times the speed relative to the field of
//! that side.

use std::f64::consts::{PI, TAU};

use glam::DVec3;
use rayon::prelude::*;

use super::address::{Address, INDIRECT_EDGE};
use super::drawing::{CameraSubpath, Edge, EdgeList, Table, Wedge};
use super::edge_lines::{EdgeLines, View};
use super::eye::kernel_beyond;
use super::field::WarpField;
use super::integral::{Curve, Difference};
use super::moving::Moving;
use super::seen_edge::SeenEdge;
use crate::gradient::modes::differential::Differential;
use crate::path::{Frame, Paths, Sequence};
use crate::scene::{Environment, Surface};

/// Weight of a fold with smooth shading, relative to a crease.
const SMOOTH: f64 = 0.05;

/// Least contrast assumed at a crease.
const LEAST: f64 = 0.05;

/// Edges in front of reflecting surfaces and a constant environment.
#[derive(Debug)]
pub(super) struct IndirectEdges<'a, V> {
    field: V,
    lines: EdgeLines<'a>,
    table: Table,
}

/// An edge point: both of its sides, or one of them.
#[derive(Debug)]
pub(super) struct Point {
    edge: SeenEdge,
    /// Surface seen on the only side that counts, if the sides have speeds of their own.
    seen: Option<Surface>,
    /// Difference of radiance, or radiance of the side, divided by the density.
    light: DVec3,
}

impl<'a, V: WarpField> IndirectEdges<'a, V> {
    pub(super) fn new(paths: &'a Paths<'a>, list: &'a EdgeList, moving: &'a Moving, field: V) -> Self {
        let scene = paths.scene;
        let mut all = Self { field, lines: EdgeLines::new(paths, list, moving), table: Table::default() };
        let constant = matches!(scene.description.environment, Some(Environment::Constant { .. }));
        if all.lines.longest > usize::from(!constant) {
            let weigh = |edge: &Edge| {
                let [a, b] = edge.span(scene);
                if list.may_be_discontinuous(scene, edge) {
                    a.distance(b) * all.solid_angle(edge)
                } else {
                    0.0
                }
            };
            let mut weights: Vec<f64> = list.edges.par_iter().map(weigh).collect();
            moving.limit_still(&mut weights, |i| moving.has_any(list.edges[i].shapes));
            all.table = Table::new(weights);
        }
        all
    }

    /// Approximate solid angle in which radiance is discontinuous at an edge, times the contrast.
    fn solid_angle(&self, edge: &Edge) -> f64 {
        if edge.is_crossing() && self.lines.longest == 1 {
            // A constant environment is continuous.
            return 0.0;
        }
        let (anywhere, wedge) = (self.share_anywhere(edge), self.wedge(edge));
        let crease = if edge.is_discontinuity { 1.0 } else { SMOOTH };
        match wedge {
            None => 4.0 * PI,
            Some(w) if anywhere == 0.0 => 4.0 * w.angle,
            Some(w) => 4.0 * w.angle + 4.0 * PI * crease * w.angle.clamp(LEAST, 1.0),
        }
    }

    /// Fraction of directions that are sampled from the whole sphere; the others are from the wedge.
    ///
    /// Emission and a constant environment are discontinuous only at silhouettes; reflected light is at all
    /// folds, of which a softened field leaves the silhouettes.
    fn share_anywhere(&self, edge: &Edge) -> f64 {
        match self.wedge(edge) {
            None => 1.0,
            Some(_) if self.lines.longest > 1 && V::IS_ZERO => 0.5,
            Some(_) => 0.0,
        }
    }

    /// Directions in which an edge of two triangles is a silhouette; `None` if every direction counts.
    fn wedge(&self, edge: &Edge) -> Option<Wedge> {
        // A fold through which another surface passes is a crossing as well.
        if !V::IS_ZERO && edge.crossed {
            return None;
        }
        Wedge::of(self.lines.sensor.paths.scene, self.lines.list, edge)
    }

    /// A direction from a point of an edge to the light, and its density by solid angle.
    fn direction(&self, edge: &Edge, [c, a, b]: [f64; 3]) -> Option<(DVec3, f64)> {
        let [p, q] = edge.span(self.lines.sensor.paths.scene);
        let e = (q - p).normalize_or_zero();
        let z = 2.0 * a - 1.0;
        let radius = (1.0 - z * z).sqrt();
        let (wedge, anywhere) = (self.wedge(edge), self.share_anywhere(edge));
        let (s, t) = e.any_orthonormal_pair();
        let (u, v, turn) = match &wedge {
            // The remainder of the random number selects one of the two opposite parts.
            Some(w) if c >= anywhere => {
                let opposite = (c - anywhere) / (1.0 - anywhere) < 0.5;
                (w.u, w.up, w.angle * b + if opposite { PI } else { 0.0 })
            }
            _ => (s, t, TAU * b),
        };
        let (sin, cos) = turn.sin_cos();
        let direction = z * e + radius * (cos * u + sin * v);
        let in_wedge =
            wedge.as_ref().filter(|w| w.holds(direction)).map_or(0.0, |w| (1.0 - anywhere) / (4.0 * w.angle));
        let density = in_wedge + anywhere / (4.0 * PI);
        (density > 0.0).then_some((direction, density))
    }

    /// Radiance on both sides of an edge, but for emission; zero on a side that a softened field follows.
    fn lights(&self, edge: &Edge, view: &View, depth: usize, numbers: &Sequence) -> [DVec3; 2] {
        let paths = self.lines.sensor.paths;
        [0, 1].map(|side| {
            let (hit, direction) = (view.sides.hits[side], view.directions[side]);
            if !V::IS_ZERO && self.lines.list.owns(edge, hit) {
                return DVec3::ZERO;
            }
            paths.still_radiance(view.x, direction, hit, depth, &mut numbers.clone())
                - paths.lit_by_all(hit, direction)
        })
    }
}

impl<V: WarpField> Curve for IndirectEdges<'_, V> {
    type Field = V;
    type Point = Point;

    fn field(&self) -> &V {
        &self.field
    }

    fn is_empty(&self) -> bool {
        self.table.total() <= 0.0
    }

    /// Every camera path that sees light end at one point of an edge.
    fn draw(&self, address: Address, found: &mut impl FnMut(&CameraSubpath<'_>, &Point)) {
        let mut numbers = address.numbers(INDIRECT_EDGE);
        let chosen = self.table.at(address.fraction(&mut numbers));
        let edge = &self.lines.list.edges[chosen.index];
        let [a, b] = edge.span(self.lines.sensor.paths.scene);
        let (c, [s, t]) = (numbers.one(), numbers.pair());
        let Some((direction, density)) = self.direction(edge, [c, s, t]) else { return };
        let line = self.lines.line(edge, chosen.rest, direction);
        if self.lines.longest == 1 && !self.lines.ends_surface(&line) {
            return;
        }
        let scale = a.distance(b) / (chosen.probability * density);
        self.lines.trace::<V>(&line, address, |path, view| {
            let lights = self.lights(edge, view, path.vertices.len() + 1, &numbers);
            let factor = path.weight * scale * view.sides.share;
            let [before, behind] = lights.map(|light| light * factor);
            let edge = view.edge;
            if V::IS_ZERO {
                if lights[0] != lights[1] {
                    found(path, &Point { edge, seen: None, light: before - behind });
                }
                return;
            }
            for (light, hit) in [before, -behind].into_iter().zip(view.sides.hits) {
                if light != DVec3::ZERO {
                    found(path, &Point { edge, seen: hit.map(|hit| hit.surface), light });
                }
            }
        });
    }

    fn difference(&self, _: &CameraSubpath<'_>, point: &Point) -> Difference {
        Difference::of(point.light)
    }

    fn speed<C: Differential>(
        &self,
        calculus: &mut C,
        frame: &Frame<C::Number>,
        path: &CameraSubpath<'_>,
        point: &Point,
    ) -> C::Number {
        let paths = self.lines.sensor.paths;
        let kernel = if V::IS_ZERO { None } else { kernel_beyond(paths, path, point.seen) };
        point.edge.speed::<V, C>(paths, calculus, frame, path, kernel)
    }
}
