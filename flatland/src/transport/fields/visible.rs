//! Visible discontinuities, found by exhaustive search.

use glam::DVec2;

use crate::transport::{Camera, CameraTangent, Origin, World};

/// A visible discontinuity: its position in the domain, the vertex that moves it, and its rate.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Jump {
    pub(crate) at: f64,
    pub(crate) vertex: usize,
    pub(crate) rate: DVec2,
    pub(crate) camera: CameraTangent,
}

/// All vertices visible from a point, by angle. The ends of its own segment are excluded: they lie on the
/// horizon.
pub(crate) fn jumps_around(world: &World, origin: Origin) -> Vec<Jump> {
    let own = origin.segment.map(|s| world.segments()[s].vertices);
    let mut jumps: Vec<Jump> = world
        .vertices()
        .enumerate()
        .filter(|(v, p)| !own.is_some_and(|own| own.contains(v)) && is_visible(world, origin, *v, *p))
        .map(|(vertex, p)| {
            let d = p - origin.point;
            let rate = d.perp() / d.length_squared();
            Jump { at: d.to_angle(), vertex, rate, camera: CameraTangent::default() }
        })
        .collect();
    jumps.sort_by(|a, b| a.at.total_cmp(&b.at));
    jumps
}

/// All vertices visible to the camera, by film coordinate, on the film and outside it.
pub(crate) fn jumps_on_film(world: &World, camera: &Camera) -> Vec<Jump> {
    let origin = Origin::free(camera.position);
    let visible = |&(v, p): &(usize, DVec2)| is_visible(world, origin, v, p);
    let jump = |(vertex, p): (usize, DVec2)| {
        let at = camera.project(p)?;
        let (rate, camera) = camera.film_rate(at, p.distance(origin.point));
        Some(Jump { at, vertex, rate, camera })
    };
    let mut jumps: Vec<Jump> = world.vertices().enumerate().filter(visible).filter_map(jump).collect();
    jumps.sort_by(|a, b| a.at.total_cmp(&b.at));
    jumps
}

/// Whether nothing lies between a point and a vertex.
pub(crate) fn is_visible(world: &World, origin: Origin, vertex: usize, at: DVec2) -> bool {
    let d = at - origin.point;
    let distance = d.length();
    distance > 0.0
        && world
            .trace(origin, d / distance)
            .is_none_or(|h| h.distance >= distance || world.segments()[h.segment].vertices.contains(&vertex))
}

/// Linear interpolation between ordered discontinuities, periodic or constant beyond the last. Calls `add`
/// with a discontinuity, its weight and the weight's slope.
pub(super) fn interpolate(
    jumps: &[Jump],
    at: f64,
    period: Option<f64>,
    mut add: impl FnMut(&Jump, f64, f64),
) {
    let Some((first, last)) = jumps.first().zip(jumps.last()) else { return };
    let next = jumps.partition_point(|j| j.at <= at);
    let (a, b, from, to) = match (next, period) {
        (n, _) if n > 0 && n < jumps.len() => (&jumps[n - 1], &jumps[n], jumps[n - 1].at, jumps[n].at),
        (0, Some(period)) => (last, first, last.at - period, first.at),
        (_, Some(period)) => (last, first, last.at, first.at + period),
        (0, None) => return add(first, 1.0, 0.0),
        (_, None) => return add(last, 1.0, 0.0),
    };
    if to <= from {
        return add(a, 1.0, 0.0);
    }
    let (t, slope) = ((at - from) / (to - from), 1.0 / (to - from));
    add(a, 1.0 - t, -slope);
    add(b, t, slope);
}
