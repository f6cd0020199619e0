//! Critical points of a segment, where the structure of its view changes.
//!
//! Radiance is an analytic function of the point on a segment, except where two vertices are seen in the same
//! direction: on the line through both. Those points, and those where a mirror would show a vertex to the
//! camera (a narrow lobe makes a step of its own width there), split the quadrature.

use glam::DVec2;

use crate::transport::{Segment, World};

/// Distance from an end, relative to the segment's length, within which a segment does not count as crossing
/// a line: a mere contact must not hide a critical point, and an additional one is harmless.
const TOUCHING: f64 = 1e-9;

/// Distance of a point, relative to the visible part of a segment, below which grading is needed.
const NEAR: f64 = 0.05;

/// Parameters of the critical points of a segment in (s₀, s₁), on one side of it, unordered.
pub(super) fn critical_points(world: &World, segment: usize, side: f64, [first, last]: [f64; 2]) -> Vec<f64> {
    let own = &world.segments()[segment];
    let normal = own.normal() * side.signum();
    let vertices: Vec<DVec2> = world.vertices().collect();
    let above: Vec<usize> = (0..vertices.len())
        .filter(|v| !own.vertices.contains(v) && normal.dot(vertices[*v] - own.start) > 0.0)
        .collect();
    let mut found = vec![];
    for (k, &v) in above.iter().enumerate() {
        for &w in &above[..k] {
            let (p, q) = (vertices[v], vertices[w]);
            let Some(s) = on_line(own.start, own.edge, p, q - p) else { continue };
            if !(s > first && s < last) {
                continue;
            }
            let x = own.at(s);
            let nearer_first = (p - x).length_squared() < (q - x).length_squared();
            let (near, far) = if nearer_first { (v, w) } else { (w, v) };
            let is_event = is_silhouette(world, near, x, &vertices)
                && !is_hidden(world, segment, x, near, far, &vertices);
            if is_event {
                found.push(s);
            }
        }
    }
    found
}

/// Parameters in (s₀, s₁) at which a mirror would show a vertex to an eye.
pub(super) fn mirror_points(world: &World, segment: usize, eye: DVec2, [first, last]: [f64; 2]) -> Vec<f64> {
    let own = &world.segments()[segment];
    let normal = own.normal();
    let height = normal.dot(eye - own.start);
    let image = eye - 2.0 * height * normal;
    world
        .vertices()
        .filter(|v| normal.dot(*v - own.start) * height > 0.0)
        .filter_map(|v| on_line(own.start, own.edge, image, v - image))
        .filter(|s| *s > first && *s < last)
        .collect()
}

/// A parameter, and the length scale on the segment over which the view changes there.
#[derive(Clone, Copy, Debug)]
pub(super) struct Graded {
    pub(super) s: f64,
    pub(super) scale: f64,
}

/// Parameters in (s₀, s₁) graded towards the feet of points near the segment's line.
///
/// The view from a surface, and the camera's view of it, change over the distance h of such a point from the
/// line, which no point of a quadrature rule over the whole would resolve. The grading is s_foot ± h qᵏ/|e|.
pub(super) fn graded_points(
    segment: &Segment,
    points: impl Iterator<Item = DVec2>,
    [first, last]: [f64; 2],
    factor: f64,
) -> Vec<Graded> {
    let length = segment.edge.length();
    let mut found = vec![];
    for point in points {
        let height = segment.normal().dot(point - segment.start).abs() / length;
        if height == 0.0 || height > NEAR * (last - first) {
            continue;
        }
        let foot = (point - segment.start).dot(segment.edge) / (length * length);
        found.push(Graded { s: foot, scale: height });
        let mut offset = height;
        while offset < 1.0 + foot.abs() {
            found.extend([foot - offset, foot + offset].map(|s| Graded { s, scale: offset }));
            offset *= factor;
        }
    }
    found.retain(|graded| graded.s > first && graded.s < last);
    found
}

/// The parameter at which the line through p along d meets the line start + s edge.
fn on_line(start: DVec2, edge: DVec2, p: DVec2, d: DVec2) -> Option<f64> {
    let s = (p - start).perp_dot(d) / edge.perp_dot(d);
    s.is_finite().then_some(s)
}

/// Whether all segments at a vertex are on one side of the line of sight.
fn is_silhouette(world: &World, vertex: usize, x: DVec2, vertices: &[DVec2]) -> bool {
    let sight = vertices[vertex] - x;
    let sides = world.segments_at(vertex).map(|i| {
        let [a, b] = world.segments()[i].vertices;
        let edge = vertices[if a == vertex { b } else { a }] - vertices[vertex];
        sight.perp_dot(edge) / (sight.length() * edge.length())
    });
    let (mut low, mut high) = (0.0_f64, 0.0_f64);
    sides.for_each(|side| (low, high) = (low.min(side), high.max(side)));
    !(low < -TOUCHING && high > TOUCHING)
}

/// Whether a segment is clearly between x and the farther vertex, other than the segments of either vertex.
fn is_hidden(world: &World, own: usize, x: DVec2, near: usize, far: usize, vertices: &[DVec2]) -> bool {
    let sight = vertices[far] - x;
    world.segments().iter().enumerate().any(|(i, segment)| {
        if i == own || segment.vertices.iter().any(|v| [near, far].contains(v)) {
            return false;
        }
        let turn = sight.perp_dot(segment.edge);
        let from = segment.start - x;
        let (t, s) = (from.perp_dot(segment.edge) / turn, from.perp_dot(sight) / turn);
        let inside = |x: f64| x > TOUCHING && x < 1.0 - TOUCHING;
        inside(t) && inside(s)
    })
}
