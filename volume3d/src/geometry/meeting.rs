//! Exact intersection of two triangles.
//!
//! The sides of vertices relative to planes, and of lines relative to triangles, are signs of determinants
//! (Shewchuk 1997), as in the test of Guigue and Devillers (2003); only the resulting positions are rounded.

use glam::DVec3;
use robust::{Coord, Coord3D, orient2d, orient3d};

/// Relation of two triangles.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) enum Meeting {
    /// Disjoint, with one point in common, or the border of one touches the other.
    Apart,
    /// Coplanar with a common area.
    Overlap,
    /// Crossing along a segment.
    Through([End; 2]),
    /// Edge k of one of them (0 or 1) lies in the plane of the other. Whether surfaces cross there depends on
    /// what continues it.
    Along {
        /// The triangle with the edge.
        which: usize,
        /// From corner k to corner k + 1.
        edge: usize,
    },
}

/// End of a segment: an edge of one triangle that pierces the other.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct End {
    /// The triangle with the edge, 0 or 1.
    pub(crate) which: usize,
    /// From corner k to corner k + 1.
    pub(crate) edge: usize,
    /// Position along it.
    pub(crate) along: f64,
}

impl End {
    pub(crate) fn place(&self, triangles: &[[DVec3; 3]; 2]) -> DVec3 {
        let corners = triangles[self.which];
        let [p, q] = [corners[self.edge], corners[(self.edge + 1) % 3]];
        if self.along == 1.0 { q } else { p + self.along * (q - p) }
    }
}

/// The relation of two triangles, both with nonzero area.
pub(crate) fn meeting(triangles: &[[DVec3; 3]; 2]) -> Meeting {
    let first = heights(&triangles[0], &triangles[1]);
    if touches_in_a_point(&first) {
        return Meeting::Apart;
    }
    let heights = [first, heights(&triangles[1], &triangles[0])];
    let through = |h: &[f64; 3]| h.iter().any(|&h| h > 0.0) && h.iter().any(|&h| h < 0.0);
    if heights[0] == [0.0; 3] {
        let overlap = overlap(triangles);
        return if overlap { Meeting::Overlap } else { Meeting::Apart };
    }
    if let Some((which, edge)) = edge_in_plane(&heights) {
        return Meeting::Along { which, edge };
    }
    if !heights.iter().all(through) {
        return Meeting::Apart;
    }
    let mut ends: Vec<End> = Vec::with_capacity(4);
    for which in 0..2 {
        for edge in 0..3 {
            let [a, b] = [heights[which][edge], heights[which][(edge + 1) % 3]];
            let crosses = (a > 0.0 && b <= 0.0) || (a < 0.0 && b >= 0.0) || (a == 0.0 && b != 0.0);
            let [p, q] = [triangles[which][edge], triangles[which][(edge + 1) % 3]];
            if crosses && passes(p, q, &triangles[1 - which]) {
                ends.push(End { which, edge, along: a / (a - b) });
            }
        }
    }
    // More than two if an edge meets an edge, at one point each: the two farthest apart.
    let mut best = (0.0, None);
    for (i, a) in ends.iter().enumerate() {
        for b in &ends[i + 1..] {
            let apart = a.place(triangles).distance_squared(b.place(triangles));
            if apart > best.0 {
                best = (apart, Some([*a, *b]));
            }
        }
    }
    best.1.map_or(Meeting::Apart, Meeting::Through)
}

/// Whether two points are on opposite sides of a triangle's plane, neither of them in it. A corner of the
/// triangle is exactly in it.
pub(crate) fn parts(triangle: &[DVec3; 3], [x, y]: [DVec3; 2]) -> bool {
    let [h, g, _] = heights(&[x, y, x], triangle);
    (h > 0.0 && g < 0.0) || (h < 0.0 && g > 0.0)
}

/// The part of a segment, in the plane of a triangle, that is within the triangle: start and end as positions
/// from the first point to the second. `None` if they share at most a point, or a piece of the triangle's
/// border.
pub(crate) fn within([p, q]: [DVec3; 2], triangle: &[DVec3; 3]) -> Option<[f64; 2]> {
    let flat = flattened(triangle);
    let corners = triangle.map(flat);
    let inside = orient2d(corners[0], corners[1], corners[2]);
    let (mut low, mut high) = (0.0_f64, 1.0_f64);
    for k in 0..3 {
        let height = |x: DVec3| orient2d(corners[k], corners[(k + 1) % 3], flat(x)) * inside.signum();
        let [f, g] = [p, q].map(height);
        match (f > 0.0, g > 0.0) {
            (true, true) => {}
            (true, false) => high = high.min(f / (f - g)),
            (false, true) => low = low.max(f / (f - g)),
            (false, false) => return None,
        }
    }
    (low < high).then_some([low, high])
}

/// Whether a triangle with these heights over a plane has at most one corner in it, and the others on one
/// side.
fn touches_in_a_point(heights: &[f64; 3]) -> bool {
    let (above, below) = (heights.iter().filter(|&&h| h > 0.0), heights.iter().filter(|&&h| h < 0.0));
    let (above, below) = (above.count(), below.count());
    above.max(below) >= 2 && above.min(below) == 0
}

/// Distance of corners from a plane or line within which they count as on it, relative to the largest given
/// coordinate: a few roundings.
pub(crate) const ROUNDING: f64 = 1e-14;

/// Whether two triangles are coplanar with a common area, within the rounding of transforms: their planes
/// differ by at most the rounding of coordinates given relative to another origin, and the area is wider than
/// that.
pub(crate) fn in_contact([s, t]: &[[DVec3; 3]; 2], origin: DVec3) -> bool {
    let size = [s, t].into_iter().flatten().map(|p| (p - origin).abs().max_element()).fold(0.0, f64::max);
    let rounding = ROUNDING * size;
    let normal = |[a, b, c]: &[DVec3; 3]| (*b - *a).cross(*c - *a).normalize_or_zero();
    let near = |of: &[DVec3; 3], plane: &[DVec3; 3]| {
        let normal = normal(plane);
        normal != DVec3::ZERO && of.iter().all(|p| normal.dot(p - plane[0]).abs() <= rounding)
    };
    let separates = |s: &[DVec3; 3], t: &[DVec3; 3]| {
        (0..3).any(|k| {
            let inward = normal(s).cross(s[(k + 1) % 3] - s[k]).normalize_or_zero();
            t.iter().all(|p| inward.dot(p - s[k]) <= rounding)
        })
    };
    near(s, t) && near(t, s) && !separates(s, t) && !separates(t, s)
}

/// Signed heights of a triangle's corners over the plane of another, times a common factor. A common corner
/// is exactly in the plane.
fn heights(of: &[DVec3; 3], plane: &[DVec3; 3]) -> [f64; 3] {
    let [a, b, c] = plane.map(point);
    of.map(|p| if plane.contains(&p) { 0.0 } else { orient3d(a, b, c, point(p)) })
}

/// An edge of one triangle in the plane of the other, if the triangle itself is not.
fn edge_in_plane(heights: &[[f64; 3]; 2]) -> Option<(usize, usize)> {
    let edge = |h: &[f64; 3]| (0..3).find(|&k| h[k] == 0.0 && h[(k + 1) % 3] == 0.0);
    (0..2).find_map(|which| Some((which, edge(&heights[which])?)))
}

/// Whether the line through two points meets a triangle's interior or border.
fn passes(p: DVec3, q: DVec3, triangle: &[DVec3; 3]) -> bool {
    let turns: [f64; 3] = std::array::from_fn(|k| {
        let [a, b] = [triangle[k], triangle[(k + 1) % 3]];
        let known = [p, q].iter().any(|x| *x == a || *x == b);
        if known { 0.0 } else { orient3d(point(p), point(q), point(a), point(b)) }
    });
    turns.iter().all(|&t| t >= 0.0) || turns.iter().all(|&t| t <= 0.0)
}

/// Whether two coplanar triangles have a common area: no edge of either has all of the other beyond it.
fn overlap([s, t]: &[[DVec3; 3]; 2]) -> bool {
    let flat = flattened(s);
    let separates = |s: &[DVec3; 3], t: &[DVec3; 3]| {
        let inside = orient2d(flat(s[0]), flat(s[1]), flat(s[2]));
        (0..3).any(|k| {
            let [a, b] = [flat(s[k]), flat(s[(k + 1) % 3])];
            t.iter().all(|p| orient2d(a, b, flat(*p)) * inside.signum() <= 0.0)
        })
    };
    !separates(s, t) && !separates(t, s)
}

/// Projection of a triangle's plane along its dominant axis: two unrounded coordinates of its points.
fn flattened([a, b, c]: &[DVec3; 3]) -> impl Fn(DVec3) -> Coord<f64> + Copy + use<> {
    let normal = (b - a).cross(c - a).abs();
    let [x, y] = [[1, 2], [2, 0], [0, 1]][normal.max_position()];
    move |p: DVec3| Coord { x: p[x], y: p[y] }
}

fn point(p: DVec3) -> Coord3D<f64> {
    Coord3D { x: p.x, y: p.y, z: p.z }
}

#[cfg(test)]
mod tests {
    use flatland::random::{Stream, open01, stream};

    use super::*;

    fn random(rng: &mut Stream) -> DVec3 {
        DVec3::from_array(std::array::from_fn(|_| 2.0 * open01(rng) - 1.0))
    }

    /// Reference by the line of both planes: the part of it in both triangles, or `None`.
    fn by_line(triangles: &[[DVec3; 3]; 2]) -> Option<[DVec3; 2]> {
        let normal = |[a, b, c]: [DVec3; 3]| (b - a).cross(c - a).normalize();
        let along = normal(triangles[0]).cross(normal(triangles[1])).normalize();
        let mut spans = [[0.0; 2]; 2];
        let mut on = DVec3::ZERO;
        for i in 0..2 {
            let (n, p) = (normal(triangles[1 - i]), triangles[1 - i][0]);
            let h = triangles[i].map(|x| n.dot(x - p));
            let cuts: Vec<DVec3> = (0..3)
                .filter(|&k| (h[k] > 0.0) != (h[(k + 1) % 3] > 0.0))
                .map(|k| triangles[i][k].lerp(triangles[i][(k + 1) % 3], h[k] / (h[k] - h[(k + 1) % 3])))
                .collect();
            let [a, b] = cuts[..] else { return None };
            on = a;
            spans[i] = [a.dot(along).min(b.dot(along)), a.dot(along).max(b.dot(along))];
        }
        let (low, high) = (spans[0][0].max(spans[1][0]), spans[0][1].min(spans[1][1]));
        let at = |x: f64| on + (x - on.dot(along)) * along;
        (low < high).then(|| [at(low), at(high)])
    }

    #[test]
    fn random_triangles_meet_where_the_line_of_their_planes_is_in_both() {
        let mut rng = stream(31, &[]);
        let mut through = 0;
        for scale in [1.0, 1e-30, 1e30] {
            for _ in 0..4000 {
                let unit = [0, 1].map(|_| [0, 1, 2].map(|_| random(&mut rng)));
                let found = match meeting(&unit.map(|t| t.map(|p| scale * p))) {
                    Meeting::Through(ends) => Some(ends.map(|e| e.place(&unit))),
                    other => {
                        assert_eq!(other, Meeting::Apart);
                        None
                    }
                };
                let expected = by_line(&unit);
                assert_eq!(found.is_some(), expected.is_some(), "{unit:?}");
                if let (Some([a, b]), Some([p, q])) = (found, expected) {
                    through += 1;
                    let off = (a.distance(p) + b.distance(q)).min(a.distance(q) + b.distance(p));
                    let steep = unit.map(|[a, b, c]| (b - a).cross(c - a).normalize());
                    assert!(off < 1e-12 / steep[0].cross(steep[1]).length(), "{off} {unit:?}");
                }
            }
        }
        assert!(through > 1000, "{through}");
    }

    #[test]
    fn contact_is_no_crossing() {
        let floor = [DVec3::ZERO, 4.0 * DVec3::X, 4.0 * DVec3::Y];
        let [a, b, above, below] = [
            DVec3::new(1.0, 0.5, 0.0),
            DVec3::new(0.5, 1.0, 0.0),
            DVec3::new(1.0, 1.0, 1.0),
            DVec3::new(1.0, 1.0, -1.0),
        ];
        // One corner on it.
        assert_eq!(meeting(&[floor, [a, above, above + DVec3::X]]), Meeting::Apart);
        // Through a corner.
        assert!(matches!(meeting(&[floor, [a, above, below]]), Meeting::Through(_)));
        // An edge in it.
        assert_eq!(meeting(&[floor, [above, a, b]]), Meeting::Along { which: 1, edge: 1 });
        // In its plane.
        assert_eq!(meeting(&[floor, [a, b, DVec3::new(1.0, 1.0, 0.0)]]), Meeting::Overlap);
        assert_eq!(meeting(&[floor, floor.map(|p| p - 4.0 * DVec3::X)]), Meeting::Apart);
        // Neighbours with a common edge, and with a common corner.
        assert!(matches!(meeting(&[floor, [floor[1], floor[0], above]]), Meeting::Along { .. }));
        assert_eq!(meeting(&[floor, [floor[0], above, above + DVec3::new(1.0, 2.0, 0.5)]]), Meeting::Apart);
        assert!(matches!(meeting(&[floor, [floor[0], above, below]]), Meeting::Through(_)));
    }
}
