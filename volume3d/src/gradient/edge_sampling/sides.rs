//! What is seen on both sides of a point of an edge.

use glam::DVec3;

use super::list::{Edge, EdgeList, corners};
use crate::geometry::Hit;
use crate::path::Paths;

/// The ray on either side of an edge leaves it by this angle, in radians. What it hits stands for the limit at
/// the edge: it differs only where two edges are nearer to one another than this.
pub(super) const ASIDE: f64 = 1e-9;

/// Two surfaces touch if their distances from the viewer differ by less than this part. At an angle α to the
/// ray a surface is within ASIDE/tan α of the edge.
const TOUCH: f64 = 1e-6;

/// What is seen before and behind an edge (normal side).
#[derive(Clone, Copy, Debug)]
pub(super) struct Sides {
    pub(super) hits: [Option<Hit>; 2],
    /// 1/2 where the edges of two surfaces coincide, as between wall and floor: each finds the whole jump.
    pub(super) share: f64,
}

/// Looks past an edge's point at distance t on both sides; `None` where the edge is hidden.
pub(super) fn look_past(
    paths: &Paths<'_>,
    list: &EdgeList,
    edge: &Edge,
    (origin, from): (DVec3, Option<u32>),
    directions: [DVec3; 2],
    t: f64,
) -> Option<Sides> {
    let hits = directions.map(|d| paths.closest(origin, d, from));
    let owns = hits.map(|h| h.is_some_and(|h| list.has(edge, h.triangle)));
    let other = match owns {
        [false, false] => return None,
        [true, true] => return Some(Sides { hits, share: 1.0 }),
        [true, false] => hits[1],
        [false, true] => hits[0],
    };
    let doubled = other.is_some_and(|h| {
        list.has_there(edge, h.triangle)
            || (h.distance - t).abs() < TOUCH * t && is_between(paths, origin, directions, h.triangle)
    });
    Some(Sides { hits, share: if doubled { 0.5 } else { 1.0 } })
}

/// Whether an edge at which a triangle jumps is seen between two directions: then rays past it find both surfaces
/// too. Where it is farther aside, each edge has a jump of its own.
fn is_between(paths: &Paths<'_>, origin: DVec3, [before, behind]: [DVec3; 2], triangle: u32) -> bool {
    let p = corners(paths.scene, triangle).map(|p| p - origin);
    (0..3).any(|k| {
        let plane = p[k].cross(p[(k + 1) % 3]);
        paths.scene.edges.jumps(triangle, k) && plane.dot(before) * plane.dot(behind) <= 0.0
    })
}
