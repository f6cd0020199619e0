//! The jumps of a flat world for means over those near a direction or a film coordinate.
//!
//! S(u) is the silhouettes before the line of the segment T that is seen at u, all of them where nothing is seen, and the
//! ends of T. A silhouette is a vertex at which a shape ends or turns back, as seen from the origin. That keeps the lemma
//! of [`JumpMean`](crate::warp::JumpMean): the segment that is seen changes at an end b of the nearer one, T. Either T is
//! joined at b to what is seen on the other side, and b is an end of both; or T hides that, T′, and b is a silhouette, and
//! before the line of T′. Nothing is tested for visibility: hidden silhouettes may be in S, on one side only too, as they
//! have no weight at b. Crossings and vertices that touch another segment need no care, as a [`World`] refuses
//! both: b is strictly before the line of T′. A vertex that two segments share counts
//! once.
//!
//! The ends of the segment that the origin lies on are left out: they are on its horizon, where nothing is scattered.

use glam::DVec2;

use crate::plane::orient;
use crate::transport::{Camera, Hit, Origin, Shape, World};
use crate::warp::Jump;

/// S(u), as numbers of vertices with their places.
fn jumps<'a>(
    world: &'a World,
    origin: Origin,
    seen: Option<&Hit>,
) -> impl Iterator<Item = (usize, DVec2)> + use<'a> {
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
            let is_jump = is_end(vertex) || is_silhouette(shape, i, x) && is_before(p);
            (is_jump && !own.contains(&vertex)).then_some((vertex, p))
        })
    })
}

/// Whether a shape ends at its point i, or turns back there as seen from x: whether its neighbours are not on different
/// sides of it.
fn is_silhouette(shape: &Shape, i: usize, x: DVec2) -> bool {
    let points = shape.points();
    let last = points.len() - 1;
    if !shape.is_closed() && (i == 0 || i == last) {
        return true;
    }
    let [before, after] = [if i == 0 { last } else { i - 1 }, if i == last { 0 } else { i + 1 }];
    let [a, b] = [before, after].map(|k| orient(x, points[i], points[k]));
    !(a < 0.0 && b > 0.0 || a > 0.0 && b < 0.0)
}

/// The offsets in radians from a direction, with the vertex and the covector of its angle's rate.
pub(super) fn around<'a>(
    world: &'a World,
    origin: Origin,
    direction: DVec2,
    seen: Option<&Hit>,
) -> impl Iterator<Item = Jump<f64, (usize, DVec2)>> + use<'a> {
    jumps(world, origin, seen).map(move |(vertex, p)| {
        let d = p - origin.point;
        let offset = direction.perp_dot(d).atan2(direction.dot(d));
        Jump { place: offset, moved_by: (vertex, d.perp() / d.length_squared()), softness: 0.0 }
    })
}

/// The offsets in pixels from a film coordinate, with the vertex, its film coordinate and its distance.
pub(super) fn on_film<'a>(
    world: &'a World,
    camera: &'a Camera,
    u: f64,
    seen: Option<&Hit>,
) -> impl Iterator<Item = Jump<f64, (usize, f64, f64)>> + use<'a> {
    jumps(world, Origin::free(camera.position), seen).filter_map(move |(vertex, p)| {
        let at = camera.project(p)?;
        let moved_by = (vertex, at, p.distance(camera.position));
        Some(Jump { place: at - u, moved_by, softness: 0.0 })
    })
}
