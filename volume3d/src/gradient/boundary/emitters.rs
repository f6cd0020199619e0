//! Silhouettes and borders of emitters, as seen from points of camera paths.
//!
//! At a shading point x the boundary term is ∮ f cos θ ΔL (v·ν) dl with v·ν dl = (ω × e)·(ẋ_B − ẋ)/t² ds, in
//! the notation of [`secondary`](super::secondary) (Theory 9). Such edges are few, and light comes from the
//! edge itself, so paths are traced from the camera.
//!
//! At fixed direction, a path vertex after a bounce slides with 1/cos of its angle of incidence; with paths
//! from the camera, the mean square of that diverges near contact. Edge sampling therefore traces paths to
//! such vertices from the emitter's edge ([`reflected_outlines`](super::reflected_outlines)), and only paths
//! to first hits from the camera.

use flatland::calculus::Vec3;
use glam::DVec3;

use super::driver::{Address, Boundary, BoundarySample};
use super::list::EdgeList;
use super::sensor::{CameraSubpath, Sensor};
use super::sides::{aside, look_past};
use super::table::Table;
use super::walk::Walk;
use super::{EMITTER_EDGE, Moving};
use crate::gradient::differential::Differential;
use crate::path::{Calculus, Frame, LightId, Paths, Sequence, Shading};

/// Edges of emitters, by length.
#[derive(Debug)]
pub(super) struct Emitters<'a> {
    walk: Walk<'a>,
    list: &'a EdgeList,
    moving: &'a Moving,
    edges: Vec<u32>,
    table: Table,
    of: Of,
}

/// Selection of emitters whose edges are sampled, and of the discontinuous emission.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Of {
    /// Edges of all emitters, and all emission.
    All,
    /// Edges of emitters that are not flat, and the emitter's own emission only: borders of flat emitters are
    /// separate integrals, and the occlusion of one emitter by another is a shadow of the latter.
    Curved,
}

/// An edge of an emitter as seen from the last shading point of a path.
pub(super) struct Seen {
    along: f64,
    edge: u32,
    /// Difference of radiance divided by the density.
    pub(super) light: DVec3,
    /// ω × e.
    pub(super) normal: DVec3,
    /// The emitter.
    pub(super) of: LightId,
}

impl<'a> Emitters<'a> {
    /// Edges as seen by paths of at most `longest` segments.
    pub(super) fn new(
        paths: &'a Paths<'a>,
        list: &'a EdgeList,
        moving: &'a Moving,
        of: Of,
        longest: usize,
    ) -> Self {
        let scene = paths.scene;
        let limit = scene.description.integrator.max_depth.unwrap_or(usize::MAX);
        let emits = |shape: u32| match of {
            Of::All => scene.description.shapes[shape as usize].radiance.is_some(),
            Of::Curved => {
                scene.description.shapes[shape as usize].radiance.is_some() && !paths.lights.is_flat(shape)
            }
        };
        let edges: Vec<u32> = (0..list.edges.len() as u32)
            .filter(|&i| limit > 1 && list.edges[i as usize].shapes.into_iter().any(emits))
            .collect();
        let table = Table::new(edges.iter().map(|&i| {
            let [a, b] = list.edges[i as usize].span(scene);
            // At inner edges of a flat lamp only its texture may be discontinuous, or an object that passes
            // through it, which has its own edge.
            if list.may_jump(scene, &list.edges[i as usize]) { a.distance(b) } else { 0.0 }
        }));
        let walk = Walk::new(Sensor::new(paths), moving, longest.min(limit.saturating_sub(1)));
        Self { walk, list, moving, edges, table, of }
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
    ) -> Option<Seen> {
        let paths = self.walk.sensor.paths;
        let scene = paths.scene;
        let chosen = self.table.at(numbers.one());
        let index = self.edges[chosen.index];
        let edge = &self.list.edges[index as usize];
        let x = subpath.vertices[0];
        let shape = scene.shape_of(x.surface);
        // With a warped film, static shading points slide as well.
        let rests = !self.moves([shape; 2]) && !self.moves(edge.shapes);
        if self.of == Of::All && subpath.vertices.len() == 1 && rests {
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
        let [before, behind] = sides.hits.map(|hit| match self.of {
            Of::All => paths.lit_by_all(hit, direction),
            Of::Curved => paths.lit(LightId::Shape(edge.shapes[0]), hit, direction),
        });
        // Each emitter's own light is assigned to its own edges.
        let share = if self.of == Of::Curved { 1.0 } else { sides.share_of_emission(scene) };
        let density = chosen.probability / length * distance * distance;
        let light = reflected * (before - behind) * subpath.weight * (share / density);
        if light == DVec3::ZERO {
            return None;
        }
        let of = LightId::Shape(edge.shapes[0]);
        Some(Seen { along: chosen.rest, edge: index, light, normal, of })
    }

    /// The edge point over numbers.
    pub(super) fn point<C: Calculus>(&self, calculus: &C, seen: &Seen) -> Vec3<C::Number> {
        let span = self.list.edges[seen.edge as usize].span;
        span.point(self.walk.sensor.paths.scene, seen.along, |i| calculus.position(i))
    }

    /// Whether there is nothing to sample.
    pub(super) fn is_empty(&self) -> bool {
        self.table.total() <= 0.0
    }

    /// Calls back with every path of a sample and the edge that its last vertex sees.
    pub(super) fn each(&self, address: Address, mut found: impl FnMut(&CameraSubpath<'_>, &Seen)) {
        let mut numbers = address.numbers(EMITTER_EDGE);
        self.walk.each(&mut numbers, |subpath, shading, numbers| {
            if let Some(seen) = self.look(subpath, shading, numbers) {
                found(subpath, &seen);
            }
        });
    }
}

impl Boundary for Emitters<'_> {
    fn is_empty(&self) -> bool {
        Emitters::is_empty(self)
    }

    fn sample<C: Differential>(
        &self,
        calculus: &mut C,
        frame: &Frame<C::Number>,
        address: Address,
        found: &mut impl FnMut(&mut C, BoundarySample<C::Number>),
    ) {
        self.each(address, |subpath, seen| {
            let relative = self.point(calculus, seen) - self.walk.sensor.position(calculus, frame, subpath);
            let speed = Vec3::constant(seen.normal).dot(relative);
            found(calculus, BoundarySample { at: subpath.at, light: seen.light, level: 0.0, speed });
        });
    }
}
