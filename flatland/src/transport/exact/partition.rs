//! Partition of the film: the visible segments along it, and the vertices between them.

use glam::DVec2;

use super::critical::{critical_points, graded_points, mirror_points};
use super::error::ExactError;
use super::visible::View;
use crate::plane::Filter;
use crate::transport::{Camera, Tangent, World};

/// Distance, relative to the film, within which two film coordinates are equal: several rounding errors.
const SAME: f64 = 16.0 * f64::EPSILON;

/// Ratio of successive breaks towards a near point; adaptive quadrature refines between them.
const FILM_GRADING: f64 = 8.0;

/// A part of the film in which one segment, or the environment, is visible.
#[derive(Clone, Debug)]
pub(super) struct Stretch {
    pub(super) ends: [f64; 2],
    pub(super) seen: Option<usize>,
    /// Places where the reflected radiance is not analytic, in order.
    pub(super) breaks: Vec<f64>,
}

/// A place on the film where the visible segment changes.
#[derive(Clone, Copy, Debug)]
pub(super) struct Jump {
    pub(super) u: f64,
    /// The vertex there, and its distance.
    pub(super) vertex: usize,
    pub(super) distance: f64,
    /// The segments visible at smaller and at larger u.
    pub(super) sides: [Option<usize>; 2],
}

/// Partition of the film of a camera in a world.
#[derive(Clone, Debug)]
pub(super) struct Partition {
    pub(super) stretches: Vec<Stretch>,
    pub(super) jumps: Vec<Jump>,
}

/// A visible point of a segment.
#[derive(Clone, Copy, Debug)]
pub(super) struct Seen {
    pub(super) segment: usize,
    pub(super) s: f64,
    pub(super) distance: f64,
    pub(super) direction: DVec2,
}

impl Partition {
    /// The partition with the places where singly scattered light is not analytic, on the segments that
    /// scatter.
    pub(super) fn new(
        world: &World,
        camera: &Camera,
        scatters: impl Fn(usize) -> bool,
    ) -> Result<Self, ExactError> {
        check_place(world, camera)?;
        let view = View::free(camera.position, camera.axes()[0]);
        let vertices: Vec<DVec2> = world.vertices().collect();
        let mut this = Self { stretches: vec![], jumps: vec![] };
        let mut from = f64::NEG_INFINITY;
        let intervals = view.intervals(world);
        for (k, interval) in intervals.iter().enumerate() {
            let end = interval.end;
            let projected = end.vertex.and_then(|v| camera.project(vertices[v]));
            let to = projected.unwrap_or(f64::INFINITY).max(from);
            if let (Some(vertex), Some(next)) = (end.vertex, intervals.get(k + 1)) {
                let sides = [interval.seen, next.seen];
                this.jumps.push(Jump { u: to, vertex, distance: end.distance, sides });
            }
            this.stretches.push(Stretch { ends: [from, to], seen: interval.seen, breaks: vec![] });
            from = to;
        }
        for stretch in &mut this.stretches {
            if let Some(segment) = stretch.seen.filter(|i| scatters(*i)) {
                stretch.split(world, camera, segment);
            }
        }
        Ok(this)
    }

    /// The stretch at u.
    pub(super) fn stretch(&self, u: f64) -> &Stretch {
        let after = self.stretches.partition_point(|s| s.ends[1] <= u);
        &self.stretches[after.min(self.stretches.len() - 1)]
    }

    /// The pieces of [u₀, u₁] on which radiance is analytic.
    pub(super) fn pieces(&self, [first, last]: [f64; 2], into: &mut Vec<[f64; 2]>) {
        for stretch in &self.stretches {
            let [a, b] = [stretch.ends[0].max(first), stretch.ends[1].min(last)];
            if a >= b {
                continue;
            }
            let mut from = a;
            for &u in stretch.breaks.iter().filter(|u| **u > a && **u < b).chain([&b]) {
                into.push([from, u]);
                from = u;
            }
        }
    }

    /// Checks that no two vertices are seen in one direction and separate.
    ///
    /// # Errors
    /// [`ExactError::Coincide`].
    pub(super) fn check_parting(
        &self,
        world: &World,
        camera: &Camera,
        change: &Tangent,
    ) -> Result<(), ExactError> {
        let vertices: Vec<DVec2> = world.vertices().collect();
        let places: Vec<Option<f64>> = vertices.iter().map(|p| camera.project(*p)).collect();
        let distance = |v: usize| vertices[v].distance(camera.position);
        let rate = |v: usize, u: f64| film_rate(camera, change, v, u, distance(v));
        let near = |u: f64, v: f64| same(camera, u, v);
        for &Jump { u, vertex, .. } in self.jumps.iter().filter(|jump| jump.is_on_film(camera)) {
            for (other, place) in places.iter().enumerate() {
                let Some(place) = place.filter(|p| near(*p, u) && other != vertex) else { continue };
                if self.is_in_front(world, camera, other, distance(other), u)
                    && parts(rate(other, place), rate(vertex, u))
                {
                    return Err(ExactError::Coincide { vertices: [vertex, other], u });
                }
            }
        }
        for segment in world.segments() {
            let [v, w] = segment.vertices;
            let (Some(a), Some(b)) = (places[v], places[w]) else { continue };
            let nearer = distance(v).min(distance(w));
            if near(a, b) && parts(rate(v, a), rate(w, b)) && self.is_in_front(world, camera, v, nearer, a) {
                return Err(ExactError::Coincide { vertices: [v, w], u: a });
            }
        }
        Ok(())
    }

    /// Whether a vertex at this distance is visible on at least one side of u.
    fn is_in_front(&self, world: &World, camera: &Camera, vertex: usize, distance: f64, u: f64) -> bool {
        let limit = |seen: Option<usize>| {
            let Some(i) = seen else { return f64::INFINITY };
            if world.segments()[i].vertices.contains(&vertex) {
                f64::INFINITY
            } else {
                Seen::on(world, camera, i, u).distance
            }
        };
        let jump = self.jumps.iter().find(|j| j.u == u);
        let sides = jump.map_or([self.stretch(u).seen; 2], |j| j.sides);
        sides.into_iter().any(|seen| distance < limit(seen) * (1.0 + SAME))
    }
}

impl Jump {
    fn is_on_film(&self, camera: &Camera) -> bool {
        let reach = camera.film.filter.radius() - 0.5;
        self.u >= -reach - 1e-9 && self.u <= camera.film.pixels as f64 + reach + 1e-9
    }

    /// Checks that the discontinuity, if `step` = (L⁻ − L⁺) u̇ is nonzero, is not where the filter is
    /// discontinuous.
    ///
    /// # Errors
    /// [`ExactError::PixelEdge`].
    pub(super) fn check(&self, camera: &Camera, step: f64) -> Result<(), ExactError> {
        let Self { u, vertex, .. } = *self;
        let jumps = camera.film.filter == Filter::Box && self.is_on_film(camera);
        if jumps && step != 0.0 && same(camera, u, u.round()) {
            return Err(ExactError::PixelEdge { vertex, u });
        }
        Ok(())
    }
}

/// Whether two film coordinates are equal up to rounding.
fn same(camera: &Camera, u: f64, v: f64) -> bool {
    (u - v).abs() <= SAME * (camera.film.pixels as f64).max(u.abs())
}

/// u̇ of a vertex.
pub(super) fn film_rate(camera: &Camera, change: &Tangent, vertex: usize, u: f64, distance: f64) -> f64 {
    let (point, own) = camera.film_rate(u, distance);
    point.dot(change.vertices[vertex]) + own.dot(&change.camera)
}

/// Whether two rates differ by more than rounding.
fn parts(a: f64, b: f64) -> bool {
    (a - b).abs() > 1e-12 * a.abs().max(b.abs())
}

/// Checks that the camera is not on a segment, where its view is undefined.
fn check_place(world: &World, camera: &Camera) -> Result<(), ExactError> {
    for (i, segment) in world.segments().iter().enumerate() {
        let [a, b] = segment.ends();
        let along = (camera.position - a).dot(segment.edge);
        let on = crate::plane::orient(a, b, camera.position) == 0.0;
        if on && along >= 0.0 && (camera.position - b).dot(segment.edge) <= 0.0 {
            return Err(ExactError::CameraOnSegment { shape: segment.shape, segment: i });
        }
    }
    Ok(())
}

impl Stretch {
    fn split(&mut self, world: &World, camera: &Camera, segment: usize) {
        // Extent of the widest filter.
        let reach = camera.film.filter.radius() - 0.5;
        let film = [-reach, camera.film.pixels as f64 + reach];
        let ends = [self.ends[0].max(film[0]), self.ends[1].min(film[1])];
        if ends[0] >= ends[1] {
            return;
        }
        let [a, b] = ends.map(|u| Seen::on(world, camera, segment, u).s);
        let range = [a.min(b), a.max(b)];
        let own = &world.segments()[segment];
        let side = own.normal().dot(camera.position - own.start);
        let mut points = critical_points(world, segment, side, range);
        if world.material(segment).gloss.is_some() {
            points.extend(mirror_points(world, segment, camera.position, range));
        }
        let others = world.vertices().filter(|v| own.ends().iter().all(|end| end != v));
        let graded = graded_points(own, others.chain([camera.position]), range, FILM_GRADING);
        points.extend(graded.into_iter().map(|g| g.s));
        self.breaks = points.iter().filter_map(|s| camera.project(own.at(*s))).collect();
        self.breaks.sort_unstable_by(f64::total_cmp);
        self.breaks.dedup();
    }
}

impl Seen {
    /// Intersection of the ray of a film coordinate with a segment's line, clamped to the segment.
    pub(super) fn on(world: &World, camera: &Camera, segment: usize, u: f64) -> Self {
        let direction = camera.direction(u);
        let own = &world.segments()[segment];
        let [a, b] = own.ends().map(|p| p - camera.position);
        let (left, right) = (direction.perp_dot(a), direction.perp_dot(b));
        let s = (left / (left - right)).clamp(0.0, 1.0);
        let distance = a.perp_dot(own.edge) / direction.perp_dot(own.edge);
        Self { segment, s, distance, direction }
    }

    /// [`on`](Self::on), or exactly the end of the segment if that is the vertex seen at u.
    pub(super) fn at_jump(world: &World, camera: &Camera, segment: usize, jump: &Jump) -> Self {
        let own = &world.segments()[segment];
        let seen = Self::on(world, camera, segment, jump.u);
        match own.vertices.iter().position(|&v| v == jump.vertex) {
            Some(k) => Self { s: k as f64, distance: jump.distance, ..seen },
            None => seen,
        }
    }
}
