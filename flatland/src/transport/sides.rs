//! Hits on either side of a vertex.

use super::fields::is_visible;
use super::{Hit, Origin, World};

/// Hits of a ray just before the direction of a vertex, and just after, in order of increasing angle; `None`
/// if the vertex is hidden.
///
/// The limits are exact: no ray is displaced.
pub(crate) fn both_sides(world: &World, origin: Origin, vertex: usize) -> Option<[Option<Hit>; 2]> {
    let at = world.vertex(vertex);
    if !is_visible(world, origin, vertex, at) {
        return None;
    }
    let towards = at - origin.point;
    let distance = towards.length();
    let direction = towards / distance;
    let mut sides = [None; 2];
    for i in world.segments_at(vertex).filter(|&i| origin.segment != Some(i)) {
        let segment = &world.segments()[i];
        let at_end = segment.vertices[1] == vertex;
        let edge = if at_end { -segment.edge } else { segment.edge };
        let across = direction.perp_dot(edge);
        if across == 0.0 {
            // Seen along its length: it is on neither side.
            continue;
        }
        let after = across > 0.0;
        // dr/dψ along the segment; on the far side in ψ the larger slope is the nearer.
        let slope = direction.dot(edge) / across;
        let depth = if after { slope } else { -slope };
        let hit = Hit { segment: i, s: f64::from(u8::from(at_end)), distance };
        let best: &mut Option<(f64, Hit)> = &mut sides[usize::from(after)];
        if best.is_none_or(|(d, _)| depth < d) {
            *best = Some((depth, hit));
        }
    }
    let mut background = None;
    let mut seen = sides.map(|s| s.map(|(_, hit)| hit));
    for side in &mut seen {
        if side.is_none() {
            *side = *background.get_or_insert_with(|| world.trace_past(origin, direction, vertex));
        }
    }
    Some(seen)
}
