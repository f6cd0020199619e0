//! What is seen on both sides of a point of an edge.

use glam::DVec3;

use super::list::{Edge, EdgeList};
use crate::scene::{Hit, Scene, Surface};

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
    /// The side, if there is one alone, of another surface whose edge coincides with this one.
    pub(super) other: Option<usize>,
}

impl Sides {
    /// The part of a jump of emission that an emitter's edge finds: all of it where the edge that coincides with it is of what does not
    /// emit, as that of a frame, whose edges nobody samples for it.
    pub(super) fn share_of_emission(&self, scene: &Scene) -> f64 {
        let emits =
            |hit: Hit| scene.description.shapes[scene.shape_of(hit.surface) as usize].radiance.is_some();
        match self.other.map(|side| self.hits[side]) {
            Some(Some(hit)) if !emits(hit) => 1.0,
            _ => self.share,
        }
    }
}

/// Looks past an edge's point at distance t on both sides; `None` where the edge is hidden.
pub(super) fn look_past(
    scene: &Scene,
    list: &EdgeList,
    edge: &Edge,
    (origin, from): (DVec3, Option<Surface>),
    directions: [DVec3; 2],
    t: f64,
) -> Option<Sides> {
    let hits = directions.map(|d| scene.closest(origin, d, from));
    let owns = hits.map(|h| h.is_some_and(|h| list.has(edge, h.surface)));
    let touches =
        |h: Hit| (h.distance - t).abs() < TOUCH * t && is_between(scene, origin, directions, h.surface);
    let coincides = |side: usize| hits[side].is_some_and(|h| list.has_there(edge, h.surface) || touches(h));
    let (doubled, other) = match owns {
        [false, false] => return None,
        // A crossing may run along an edge of one of its triangles.
        [true, true] => (edge.is_crossing() && hits.into_iter().flatten().any(touches), None),
        [true, false] => (coincides(1), Some(1)),
        [false, true] => (coincides(0), Some(0)),
    };
    let crossed = !edge.is_crossing() && cross_between(scene, origin, directions, hits);
    let other = other.filter(|_| doubled && !crossed && !edge.is_crossing());
    Some(Sides { hits, share: if doubled || crossed { 0.5 } else { 1.0 }, other })
}

/// Whether a crossing of two triangles is seen between two directions, in which they are hit.
fn cross_between(scene: &Scene, origin: DVec3, [before, behind]: [DVec3; 2], hits: [Option<Hit>; 2]) -> bool {
    let [Some(a), Some(b)] = hits else { return false };
    let [Surface::Triangle(first), Surface::Triangle(second)] = [a.surface, b.surface] else { return false };
    let crossings = scene.crossings();
    crossings.of(first).iter().map(|&i| crossings.get(i)).any(|crossing| {
        let [p, q] = crossing.places.map(|p| p - origin);
        let plane = p.cross(q);
        crossing.continued.is_none()
            && crossing.triangles.contains(&second)
            && plane.dot(before) * plane.dot(behind) <= 0.0
    })
}

/// Whether an edge at which a triangle jumps is seen between two directions: then rays past it find both surfaces
/// too. Where it is farther aside, each edge has a jump of its own.
fn is_between(scene: &Scene, origin: DVec3, [before, behind]: [DVec3; 2], surface: Surface) -> bool {
    let Surface::Triangle(triangle) = surface else { return false };
    let p = scene.corners(triangle).map(|p| p - origin);
    (0..3).any(|k| {
        let plane = p[k].cross(p[(k + 1) % 3]);
        scene.adjacency.jumps(triangle, k) && plane.dot(before) * plane.dot(behind) <= 0.0
    })
}
