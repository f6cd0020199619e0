//! The edges of emitters themselves, as they are seen from the points of camera paths.
//!
//! At a shading point x the boundary term is ∮ f cos θ ΔL (v·ν) dl with v·ν dl = (ω × e)·(ẋ_B − ẋ)/t² ds, in the
//! notation of [`secondary`](super::secondary). There are few such edges, and light comes from the edge itself: here
//! paths are traced from the camera.

use flatland::calculus::Vec3;
use glam::DVec3;

use super::driver::{Address, Boundary, BoundarySample};
use super::list::EdgeList;
use super::sensor::{CameraSubpath, Sensor};
use super::sides::{ASIDE, look_past};
use super::table::Table;
use super::walk::Walk;
use super::{EMITTER_EDGE, Moving};
use crate::gradient::differential::Differential;
use crate::path::{Calculus, Frame, Paths, Sequence, Shading};

/// The edges of emitters, by length.
#[derive(Debug)]
pub(super) struct Emitters<'a> {
    walk: Walk<'a>,
    list: &'a EdgeList,
    moving: &'a Moving,
    edges: Vec<u32>,
    table: Table,
}

impl<'a> Emitters<'a> {
    pub(super) fn new(paths: &'a Paths<'a>, list: &'a EdgeList, moving: &'a Moving) -> Self {
        let scene = paths.scene;
        let limit = scene.description.integrator.max_depth.unwrap_or(usize::MAX);
        let emits = |shape: u32| scene.description.shapes[shape as usize].radiance.is_some();
        let edges: Vec<u32> = (0..list.edges.len() as u32)
            .filter(|&i| limit > 1 && list.edges[i as usize].shapes.into_iter().any(emits))
            .collect();
        let table = Table::new(edges.iter().map(|&i| {
            let [a, b] = list.edges[i as usize].span(scene);
            // The inner edges of a flat lamp are never silhouettes.
            let flat = list.limits(scene, &list.edges[i as usize]).is_some_and(|[u, v]| u == v);
            if flat { 0.0 } else { a.distance(b) }
        }));
        let walk = Walk::new(Sensor::new(paths), moving, limit.saturating_sub(1));
        Self { walk, list, moving, edges, table }
    }

    fn moves(&self, shapes: [u32; 2]) -> bool {
        self.moving.camera || self.moving.has_any(shapes)
    }

    /// One edge's point as seen from the last vertex of a path.
    fn look<C: Calculus>(
        &self,
        calculus: &C,
        frame: &Frame<C::Number>,
        subpath: &CameraSubpath<'_>,
        shading: &Shading<'_, f64>,
        numbers: &mut Sequence,
    ) -> Option<BoundarySample<C::Number>> {
        let paths = self.walk.sensor.paths;
        let scene = paths.scene;
        let chosen = self.table.at(numbers.one());
        let edge = &self.list.edges[self.edges[chosen.index] as usize];
        let x = subpath.vertices[0];
        let shape = scene.shape_of(x.surface);
        if subpath.vertices.len() == 1 && !self.moves([shape; 2]) && !self.moves(edge.shapes) {
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
        let across = ASIDE * normal.normalize_or_zero();
        let directions = [-1.0, 1.0].map(|s| (direction + s * across).normalize());
        let sides = look_past(scene, self.list, edge, (x.position, Some(x.surface)), directions, distance)?;
        let [before, behind] = sides.hits.map(|hit| paths.lit_by_all(hit, direction));
        let density = chosen.probability / length * distance * distance;
        let light = reflected * (before - behind) * subpath.weight * (sides.share / density);
        if light == DVec3::ZERO {
            return None;
        }
        let point = edge.span.point(scene, chosen.rest, |i| calculus.position(i));
        let relative = point - self.walk.sensor.position(calculus, frame, subpath);
        Some(BoundarySample {
            at: subpath.at,
            light,
            level: 0.0,
            speed: Vec3::constant(normal).dot(relative),
        })
    }
}

impl Boundary for Emitters<'_> {
    fn is_empty(&self) -> bool {
        self.table.total() <= 0.0
    }

    fn sample<C: Differential>(
        &self,
        calculus: &mut C,
        frame: &Frame<C::Number>,
        address: Address,
        found: &mut impl FnMut(&mut C, BoundarySample<C::Number>),
    ) {
        let mut numbers = address.numbers(EMITTER_EDGE);
        self.walk.each(&mut numbers, |subpath, shading, numbers| {
            if let Some(sample) = self.look(calculus, frame, subpath, shading, numbers) {
                found(calculus, sample);
            }
        });
    }
}
