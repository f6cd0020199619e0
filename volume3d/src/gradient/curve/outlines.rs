//! Silhouettes and borders of emitters, as seen from points of camera paths.
//!
//! At a shading point x the boundary term is ∮ f cos θ ΔL (v − V)·ν dl, where v·ν dl is
//! (ω × e)·(ẋ_B − ẋ)/t² ds in the notation of [`edge_lines`](super::edge_lines) (Theory 9). Such edges are
//! few, and light comes from the edge itself, so paths are traced from the camera.
//!
//! At fixed direction, a path vertex after a bounce slides with 1/cos of its angle of incidence; with paths
//! from the camera, the mean square of that diverges near contact. With V = 0 paths to such vertices are
//! therefore traced from the emitter's edge ([`reflected_outlines`](super::reflected_outlines)), and only
//! paths to first hits from the camera.
//!
//! With V = 0 all emitters count, and whatever emission is discontinuous at their edges. Relative to a field
//! that samples shadows, borders of flat emitters are separate integrals, which next-event estimation adds;
//! only emitters that are not flat count here, and of them their own emission: where one emitter hides
//! another, that is the other's shadow.

use flatland::calculus::Vec3;
use glam::DVec3;

use super::address::{Address, OUTLINE};
use super::drawing::{CameraSubpath, EdgeList, Sensor, Table, Walk, aside, look_past};
use super::field::WarpField;
use super::integral::{Curve, Difference};
use super::moving::Moving;
use super::seen_edge::{LitEdge, SeenEdge};
use crate::gradient::modes::differential::Differential;
use crate::path::{Frame, LightId, Paths, Sequence, Shading};

/// Edges of emitters, by length.
#[derive(Debug)]
pub(super) struct Outlines<'a, V> {
    field: V,
    walk: Walk<'a>,
    list: &'a EdgeList,
    moving: &'a Moving,
    edges: Vec<u32>,
    table: Table,
}

impl<'a, V: WarpField> Outlines<'a, V> {
    pub(super) fn new(paths: &'a Paths<'a>, list: &'a EdgeList, moving: &'a Moving, field: V) -> Self {
        let longest = if V::IS_ZERO { 1 } else { usize::MAX };
        Self::seen_by(paths, list, moving, field, longest)
    }

    /// Outlines as seen by paths of at most `longest` segments.
    pub(super) fn seen_by(
        paths: &'a Paths<'a>,
        list: &'a EdgeList,
        moving: &'a Moving,
        field: V,
        longest: usize,
    ) -> Self {
        let scene = paths.scene;
        let limit = scene.description.integrator.max_depth.unwrap_or(usize::MAX);
        let emits = |shape: u32| {
            let emits = scene.description.shapes[shape as usize].radiance.is_some();
            emits && (V::IS_ZERO || !paths.lights.is_flat(shape))
        };
        let edges: Vec<u32> = (0..list.edges.len() as u32)
            .filter(|&i| limit > 1 && list.edges[i as usize].shapes.into_iter().any(emits))
            .collect();
        let table = Table::new(edges.iter().map(|&i| {
            let [a, b] = list.edges[i as usize].span(scene);
            // At inner edges of a flat lamp only its texture may be discontinuous, or an object that passes
            // through it, which has its own edge.
            if list.may_be_discontinuous(scene, &list.edges[i as usize]) { a.distance(b) } else { 0.0 }
        }));
        let walk = Walk::new(Sensor::new(paths), moving, longest.min(limit.saturating_sub(1)));
        Self { field, walk, list, moving, edges, table }
    }

    fn moves(&self, shapes: [u32; 2]) -> bool {
        self.moving.camera || self.moving.has_any(shapes)
    }

    /// A point of an edge as seen from the last vertex of a path.
    fn look(
        &self,
        subpath: &CameraSubpath<'_>,
        shading: &Shading<'_, f64>,
        numbers: &mut Sequence,
    ) -> Option<LitEdge> {
        let paths = self.walk.sensor.paths;
        let scene = paths.scene;
        let chosen = self.table.at(numbers.one());
        let index = self.edges[chosen.index];
        let edge = &self.list.edges[index as usize];
        let x = subpath.vertices[0];
        let shape = scene.shape_of(x.surface);
        // With a warped film, static shading points slide as well.
        let rests = !self.moves([shape; 2]) && !self.moves(edge.shapes);
        if V::IS_ZERO && subpath.vertices.len() == 1 && rests {
            return None;
        }
        let [a, b] = edge.span(scene);
        let length = a.distance(b);
        let way = a.lerp(b, chosen.rest) - x.position;
        let distance = way.length();
        let direction = way / distance;
        let reflected = shading.evaluate(Vec3::constant(direction)).value();
        if reflected == DVec3::ZERO {
            return None;
        }
        let normal = direction.cross((b - a) / length);
        let across = aside([a, b], x.position, distance) * normal.normalize_or_zero();
        let directions = [-1.0, 1.0].map(|s| (direction + s * across).normalize());
        let sides = look_past(scene, self.list, edge, (x.position, Some(x.surface)), directions, distance)?;
        let emitter = LightId::Shape(edge.shapes[0]);
        // Relative to a field each emitter's own light is assigned to its own edges.
        let (hits, share) = (sides.hits, if V::IS_ZERO { sides.share_of_emission(scene) } else { 1.0 });
        let [before, behind] = match V::IS_ZERO {
            true => hits.map(|hit| paths.lit_by_all(hit, direction)),
            false => hits.map(|hit| paths.lit(emitter, hit, direction)),
        };
        let density = chosen.probability / length * distance * distance;
        let light = reflected * (before - behind) * subpath.weight * (share / density);
        if light == DVec3::ZERO {
            return None;
        }
        let edge = SeenEdge { span: edge.span, along: chosen.rest, direction, distance, normal };
        Some(LitEdge { edge, emitter, light })
    }
}

impl<V: WarpField> Curve for Outlines<'_, V> {
    type Field = V;
    type Point = LitEdge;

    fn field(&self) -> &V {
        &self.field
    }

    fn is_empty(&self) -> bool {
        self.table.total() <= 0.0
    }

    /// For every shading point of a path, the edge point that it is given to see.
    fn draw(&self, address: Address, found: &mut impl FnMut(&CameraSubpath<'_>, &LitEdge)) {
        let mut numbers = address.numbers(OUTLINE);
        self.walk.each(&mut numbers, |path, shading, numbers| {
            if let Some(point) = self.look(path, shading, numbers) {
                found(path, &point);
            }
        });
    }

    fn difference(&self, _: &CameraSubpath<'_>, point: &LitEdge) -> Difference {
        Difference::of(point.light)
    }

    fn speed<C: Differential>(
        &self,
        calculus: &mut C,
        frame: &Frame<C::Number>,
        path: &CameraSubpath<'_>,
        point: &LitEdge,
    ) -> C::Number {
        point.speed::<V, C>(self.walk.sensor.paths, calculus, frame, path)
    }
}
