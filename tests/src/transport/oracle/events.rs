//! Points of a line at which its reflected light is not smooth.

use glam::DVec2;

use super::scene::Scene;

/// Points of each line, on each of its sides: whether to the left of the line, and the point.
#[derive(Clone, Debug)]
pub(super) struct Events(Vec<Vec<(bool, DVec2)>>);

impl Events {
    /// No events.
    pub(super) fn none(scene: &Scene) -> Self {
        Self(vec![vec![]; scene.lines.len()])
    }

    /// Points that see two vertices in one direction, by brute force over all pairs. Points from which
    /// another line hides a vertex are omitted: an event too many or too few costs time, not precision, as
    /// the quadrature that splits at events is adaptive.
    pub(super) fn new(scene: &Scene) -> Self {
        Self((0..scene.lines.len()).map(|line| of_line(scene, line)).collect())
    }

    /// The events of a line on one side.
    pub(super) fn of(&self, line: usize, left: bool) -> impl Iterator<Item = DVec2> + '_ {
        self.0[line].iter().filter(move |(side, _)| *side == left).map(|(_, point)| *point)
    }
}

fn of_line(scene: &Scene, line: usize) -> Vec<(bool, DVec2)> {
    let own = scene.lines[line].vertices;
    let [a, b] = scene.ends(line);
    let left = |p: DVec2| (b - a).perp_dot(p - a) > 0.0;
    let others: Vec<_> = (0..scene.vertices.len()).filter(|v| !own.contains(v)).collect();
    let mut events = vec![];
    for (k, &i) in others.iter().enumerate() {
        for &j in &others[k + 1..] {
            let [p, q] = [i, j].map(|v| scene.vertices[v].value());
            if left(p) != left(q) {
                continue;
            }
            let Some(x) = meeting(a, b, p, q - p) else { continue };
            let near = if x.distance_squared(p) < x.distance_squared(q) { [p, q] } else { [q, p] };
            let hidden = scene.is_blocked(x, near[0], line, [i, j])
                || scene.is_blocked(near[0], near[1], line, [i, j]);
            if !hidden {
                events.push((left(p), x));
            }
        }
    }
    for &v in &others {
        let p = scene.vertices[v].value();
        events.extend(layers(a, b, p).map(|x| (left(p), x)));
    }
    events
}

/// The light of a vertex close to the line changes within its distance from the foot, which no rule on a
/// piece a million times as long would notice. Break points at distances that grow tenfold resolve it.
fn layers(a: DVec2, b: DVec2, p: DVec2) -> impl Iterator<Item = DVec2> {
    const CLOSE: f64 = 0.05;
    let length = a.distance(b);
    let along = (b - a) / length;
    let (foot, height) = (along.dot(p - a), along.perp_dot(p - a).abs());
    let mut distance = height;
    let distances = std::iter::from_fn(move || {
        let now = distance;
        distance *= 10.0;
        (height > 0.0 && height < CLOSE * length && now < length).then_some(now)
    });
    distances
        .flat_map(move |d| [foot - d, foot + d])
        .filter(move |s| *s > 0.0 && *s < length)
        .map(move |s| a + s * along)
}

/// The point strictly between a and b on the line through p in direction d.
fn meeting(a: DVec2, b: DVec2, p: DVec2, d: DVec2) -> Option<DVec2> {
    let (left, right) = (d.perp_dot(a - p), d.perp_dot(b - p));
    let s = left / (left - right);
    (s > 0.0 && s < 1.0).then(|| a + s * (b - a))
}

/// Points of a line that see a vertex in the mirror direction of the viewer: there a narrow lobe sweeps over
/// an edge.
pub(super) fn mirrored(scene: &Scene, line: usize, viewer: DVec2) -> Vec<DVec2> {
    let own = scene.lines[line].vertices;
    let [a, b] = scene.ends(line);
    let normal = (b - a).normalize().perp();
    let height = normal.dot(viewer - a);
    let image = viewer - 2.0 * height * normal;
    let vertices = (0..scene.vertices.len()).filter(|v| !own.contains(v));
    vertices
        .filter_map(|v| {
            let p = scene.vertices[v].value();
            let x = if (normal.dot(p - a) > 0.0) == (height > 0.0) {
                meeting(a, b, image, p - image)?
            } else {
                return None;
            };
            (!scene.is_blocked(x, p, line, [v, v])).then_some(x)
        })
        .collect()
}
