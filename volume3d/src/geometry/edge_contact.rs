//! Triangle edges that coincide, or that lie in the interior of a triangle.

use glam::DVec3;

use super::meeting::ROUNDING;

/// A stretch shared by edges of two triangles.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Stretch {
    /// Edge k of each triangle, from corner k to corner k + 1.
    pub(crate) edges: [usize; 2],
    /// Positions of the stretch's ends along each edge: `along[i]` on that of triangle i.
    pub(crate) along: [[f64; 2]; 2],
}

/// All common stretches, within the rounding of transforms of coordinates given relative to another origin.
pub(crate) fn common_stretches(triangles: &[[DVec3; 3]; 2], origin: DVec3) -> impl Iterator<Item = Stretch> {
    let size = triangles.as_flattened().iter().map(|p| (p - origin).abs().max_element()).fold(0.0, f64::max);
    let edge = |i: usize, k: usize| [triangles[i][k], triangles[i][(k + 1) % 3]];
    let pairs = (0..3).flat_map(|k| (0..3).map(move |l| [k, l]));
    pairs.filter_map(move |edges| {
        let along = common_stretch(edge(0, edges[0]), edge(1, edges[1]), ROUNDING * size)?;
        Some(Stretch { edges, along })
    })
}

/// Ends of the intersection of two segments, as positions along each; `None` if it is at most a point.
fn common_stretch([p, q]: [DVec3; 2], [a, b]: [DVec3; 2], rounding: f64) -> Option<[[f64; 2]; 2]> {
    let (length, other) = (p.distance(q), a.distance(b));
    if length <= rounding || other <= rounding {
        return None;
    }
    let direction = (q - p) / length;
    let off = |x: DVec3| (x - p).cross(direction).length();
    if off(a) > rounding || off(b) > rounding {
        return None;
    }
    let [s, t] = [a, b].map(|x| (x - p).dot(direction));
    let (low, high) = (s.min(t).max(0.0), s.max(t).min(length));
    let ends = [low, high];
    (high - low > rounding).then(|| [ends.map(|x| x / length), ends.map(|x| (x - s) / (t - s))])
}

/// The stretch of a segment in the interior of a triangle, within the rounding of transforms, as positions
/// along the segment; `None` if it is at most a point or on the triangle's border, or if the triangle has no
/// area. Rounding is that of coordinates given relative to another origin.
pub(crate) fn upon_face([p, q]: [DVec3; 2], triangle: &[DVec3; 3], origin: DVec3) -> Option<[f64; 2]> {
    let points = [&[p, q][..], triangle].concat();
    let size = points.iter().map(|p| (p - origin).abs().max_element()).fold(0.0, f64::max);
    let rounding = ROUNDING * size;
    let [a, b, c] = *triangle;
    let normal = (b - a).cross(c - a).try_normalize()?;
    let length = p.distance(q);
    if length <= rounding || [p, q].iter().any(|x| normal.dot(x - a).abs() > rounding) {
        return None;
    }
    let (mut low, mut high) = (0.0_f64, 1.0_f64);
    for k in 0..3 {
        let inward = normal.cross(triangle[(k + 1) % 3] - triangle[k]).try_normalize()?;
        let [f, g] = [p, q].map(|x| inward.dot(x - triangle[k]) - rounding);
        match (f > 0.0, g > 0.0) {
            (true, true) => {}
            (true, false) => high = high.min(f / (f - g)),
            (false, true) => low = low.max(f / (f - g)),
            (false, false) => return None,
        }
    }
    ((high - low) * length > rounding).then_some([low, high])
}

#[cfg(test)]
mod tests {
    use glam::DQuat;

    use super::*;

    /// Two triangles on either side of the line y = z = 0, with edge 0 of each on it.
    fn on_a_line(x: f64, length: f64) -> [[DVec3; 3]; 2] {
        let triangle = |x: f64, length: f64, z: f64| {
            [DVec3::X * x, DVec3::X * (x + length), DVec3::new(x, 1.0, z)].map(|p| p + DVec3::Z)
        };
        [triangle(0.0, 2.0, 0.3), triangle(x, length, -1.0)]
    }

    #[test]
    fn ends_are_at_one_place_of_both_edges() {
        let turn = DQuat::from_scaled_axis(DVec3::new(0.3, -1.1, 0.7));
        for (x, length, expected) in [
            (0.5, 1.0, Some([[0.25, 0.75], [0.0, 1.0]])),
            (1.5, -1.0, Some([[0.25, 0.75], [1.0, 0.0]])),
            (1.5, 4.0, Some([[0.75, 1.0], [0.0, 0.125]])),
            (2.0, 1.0, None),
            (-1.0, 1.0, None),
        ] {
            let triangles = on_a_line(x, length);
            let found: Vec<Stretch> = common_stretches(&triangles, DVec3::ZERO).collect();
            assert_eq!(found.first().map(|s| s.along), expected, "{x} {length}");
            for triangles in [triangles, triangles.map(|t| t.map(|p| turn * (0.1 * p)))] {
                let found: Vec<Stretch> = common_stretches(&triangles, DVec3::ZERO).collect();
                assert_eq!(found.len(), usize::from(expected.is_some()), "{x} {length}");
                for Stretch { edges, along } in found {
                    assert_eq!(edges, [0, 0]);
                    let place = |i: usize, end: usize| triangles[i][0].lerp(triangles[i][1], along[i][end]);
                    assert!((0..2).all(|end| place(0, end).distance(place(1, end)) < 1e-15));
                }
            }
        }
    }

    #[test]
    fn edges_beside_or_across_one_another_have_no_stretch_in_common() {
        let [own, other] = on_a_line(0.5, 1.0);
        let beside = other.map(|p| p + 1e-12 * DVec3::Y);
        let across = other.map(|p| DQuat::from_rotation_z(1e-12) * p);
        for other in [beside, across] {
            assert_eq!(common_stretches(&[own, other], DVec3::ZERO).count(), 0);
        }
    }
}
