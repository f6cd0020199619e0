//! Discontinuities of a flat world for means over those near a direction or a film coordinate.
//!
//! S(u) consists of the ends of the segment T visible at u and of the silhouettes in front of T's line (all
//! silhouettes if nothing is visible). A silhouette is a vertex at which a shape ends or turns back, as seen
//! from the origin. This satisfies the lemma of [`JumpMean`] (Theory 5). Nothing is tested for visibility:
//! hidden silhouettes may be in S, even on one side only, as they have no weight where the visible segment
//! changes. Crossings and vertices that touch another segment need no treatment, as a [`World`] refuses both.
//! A vertex shared by two segments counts once.
//!
//! A softened V falls short of the velocity of every discontinuity except the ends of T, and also of theirs
//! if they are at most ε apart as seen from the origin. It is continuous where one segment is visible; the
//! residual at visible vertices depends on the limits of V on both sides. There is no residual at a vertex
//! that is not a silhouette and is shared by two segments that are both wider than ε.
//!
//! The ends of the segment that contains the origin are excluded: they are on its horizon, where nothing is
//! scattered.

use glam::DVec2;

use super::form::FieldForm;
use crate::plane::{MaterialPoint, orient};
use crate::transport::{Camera, Hit, Origin, Shape, World, subtended};
use crate::warp::{Jump, JumpMean};

/// A mean over nearby discontinuities, exact or softened.
#[derive(Clone, Copy, Debug)]
pub(super) struct Near {
    /// The mean, with its reach in the unit of the domain.
    pub(super) mean: JumpMean,
    /// ε, in the same unit.
    pub(super) softness: f64,
}

/// S(u), as vertex indices with their positions, and whether they are ends of the visible segment.
fn jumps<'a>(
    world: &'a World,
    origin: Origin,
    seen: Option<&Hit>,
) -> impl Iterator<Item = (usize, DVec2, bool)> + use<'a> {
    let own = origin.segment.map_or([usize::MAX; 2], |i| world.segments()[i].vertices);
    let seen = seen.map(|hit| world.segments()[hit.segment]);
    let x = origin.point;
    let is_before = move |p: DVec2| {
        seen.is_none_or(|s| (orient(s.start, s.end, p) > 0.0) == (orient(s.start, s.end, x) > 0.0))
    };
    let is_end = move |vertex: usize| seen.is_some_and(|s| s.vertices.contains(&vertex));
    world.shapes().iter().enumerate().flat_map(move |(index, shape)| {
        let vertices = world.vertices_of(index).zip(shape.points()).enumerate();
        vertices.filter_map(move |(i, (vertex, &p))| {
            let is_end = is_end(vertex);
            let is_jump = is_end || is_silhouette(shape, i, x) && is_before(p);
            (is_jump && !own.contains(&vertex)).then_some((vertex, p, is_end))
        })
    })
}

/// Whether a shape ends at its point i, or turns back there as seen from x: its neighbours are not on
/// different sides of the line of sight.
fn is_silhouette(shape: &Shape, i: usize, x: DVec2) -> bool {
    let points = shape.points();
    let last = points.len() - 1;
    if !shape.is_closed() && (i == 0 || i == last) {
        return true;
    }
    let [before, after] = [if i == 0 { last } else { i - 1 }, if i == last { 0 } else { i + 1 }];
    is_turn(x, points[i], [before, after].map(|k| points[k]))
}

/// Whether a shape turns back at p, between two adjacent points, as seen from x.
fn is_turn(x: DVec2, p: DVec2, beside: [DVec2; 2]) -> bool {
    let [a, b] = beside.map(|q| orient(x, p, q));
    !(a < 0.0 && b > 0.0 || a > 0.0 && b < 0.0)
}

/// Whether a vertex is a silhouette as seen from x.
pub(crate) fn is_silhouette_from(world: &World, vertex: usize, x: DVec2) -> bool {
    let mut beside = world.segments_at(vertex).map(|i| {
        let segment = &world.segments()[i];
        if segment.vertices[0] == vertex { segment.end } else { segment.start }
    });
    match (beside.next(), beside.next()) {
        (Some(a), Some(b)) => is_turn(x, world.vertex(vertex), [a, b]),
        _ => true,
    }
}

impl Near {
    /// Whether the ends of a segment are followed exactly where it is visible: if it is wider than ε.
    pub(super) fn follows_ends_around(&self, world: &World, origin: Origin, segment: usize) -> bool {
        subtended(world, segment, origin.point) > self.softness
    }

    /// [`follows_ends_around`](Self::follows_ends_around) on the film; true for a segment with an end behind
    /// the camera.
    pub(super) fn follows_ends_on_film(&self, world: &World, camera: &Camera, segment: usize) -> bool {
        let [a, b] = world.segments()[segment].ends().map(|end| camera.project(end));
        a.zip(b).map_or(f64::INFINITY, |(a, b)| (a - b).abs()) > self.softness
    }

    /// The field over the directions around `origin`, at a direction with a known hit.
    pub(super) fn around(
        &self,
        world: &World,
        origin: Origin,
        direction: DVec2,
        seen: Option<&Hit>,
    ) -> FieldForm {
        let mut field = FieldForm::default();
        let follows = seen.is_some_and(|hit| self.follows_ends_around(world, origin, hit.segment));
        let near = jumps(world, origin, seen).map(|(vertex, p, is_end)| {
            let d = p - origin.point;
            let offset = direction.perp_dot(d).atan2(direction.dot(d));
            let moved_by = (vertex, d.perp() / d.length_squared());
            let softness = if is_end && follows { 0.0 } else { self.softness };
            Jump { place: offset, moved_by, softness }
        });
        for term in self.mean.of_points(near).terms() {
            let (vertex, rate) = term.hit;
            field.push(MaterialPoint::vertex(vertex), rate, term.weight, term.divergence);
        }
        field
    }

    /// The field on the film, at a coordinate with a known hit.
    pub(super) fn on_film(&self, world: &World, camera: &Camera, u: f64, seen: Option<&Hit>) -> FieldForm {
        let mut field = FieldForm::default();
        let follows = seen.is_some_and(|hit| self.follows_ends_on_film(world, camera, hit.segment));
        let near = jumps(world, Origin::free(camera.position), seen).filter_map(|(vertex, p, is_end)| {
            let at = camera.project(p)?;
            let moved_by = (vertex, at, p.distance(camera.position));
            let softness = if is_end && follows { 0.0 } else { self.softness };
            Some(Jump { place: at - u, moved_by, softness })
        });
        for term in self.mean.of_points(near).terms() {
            let (vertex, at, distance) = term.hit;
            let (rate, by_camera) = camera.film_rate(at, distance);
            field.push(MaterialPoint::vertex(vertex), rate, term.weight, term.divergence);
            field.push_camera(&by_camera.without_position(), term.weight, term.divergence);
        }
        field
    }
}
