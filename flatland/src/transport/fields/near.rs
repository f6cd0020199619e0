//! The jumps of a flat world for means over those near a direction or a film coordinate.
//!
//! S(u) is the vertices before the line of the segment that is seen at u, and the ends of that segment; all vertices
//! where nothing is seen. That keeps the lemma of [`JumpMean`](crate::warp::JumpMean): the segment that is seen changes
//! at a vertex b, an end of the one that is nearer, T. Either T is joined at b to what is seen on the other side, and b is
//! an end of both; or it hides that, T′, beside b, and b is before the line of T′. Hidden vertices may be in S on one side
//! only: at b they have no weight. Crossings are no jumps, because a [`World`] has none. Vertices that segments share count
//! once.
//!
//! The ends of the segment that the origin lies on are left out: they are on its horizon, where nothing is scattered.

use glam::DVec2;

use crate::plane::orient;
use crate::transport::{Camera, Hit, Origin, World};

/// S(u), as numbers of vertices with their places.
fn jumps<'a>(
    world: &'a World,
    origin: Origin,
    seen: Option<&Hit>,
) -> impl Iterator<Item = (usize, DVec2)> + use<'a> {
    let own = origin.segment.map(|i| world.segments()[i].vertices);
    let seen = seen.map(|hit| world.segments()[hit.segment]);
    let side = seen.map(|s| orient(s.start, s.end, origin.point));
    world.vertices().enumerate().filter(move |(v, p)| {
        let is_before = seen.zip(side).is_none_or(|(s, side)| {
            s.vertices.contains(v) || orient(s.start, s.end, *p) * side.signum() > 0.0
        });
        is_before && !own.is_some_and(|own| own.contains(v))
    })
}

/// The offsets in radians from a direction, with the vertex and the covector of its angle's rate.
pub(super) fn around<'a>(
    world: &'a World,
    origin: Origin,
    direction: DVec2,
    seen: Option<&Hit>,
) -> impl Iterator<Item = (f64, (usize, DVec2))> + use<'a> {
    jumps(world, origin, seen).map(move |(vertex, p)| {
        let d = p - origin.point;
        let offset = direction.perp_dot(d).atan2(direction.dot(d));
        (offset, (vertex, d.perp() / d.length_squared()))
    })
}

/// The offsets in pixels from a film coordinate, with the vertex, its film coordinate and its distance.
pub(super) fn on_film<'a>(
    world: &'a World,
    camera: &'a Camera,
    u: f64,
    seen: Option<&Hit>,
) -> impl Iterator<Item = (f64, (usize, f64, f64))> + use<'a> {
    jumps(world, Origin::free(camera.position), seen).filter_map(move |(vertex, p)| {
        let at = camera.project(p)?;
        Some((at - u, (vertex, at, p.distance(camera.position))))
    })
}
