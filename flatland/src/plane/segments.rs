//! Segments: intersection by exact predicates, distance, and clipping to a rectangle.

use glam::DVec2;

use super::{FilterCell, orient, twice_area};

/// Whether r, known to lie on the line pq, is strictly between p and q.
fn is_between(p: DVec2, q: DVec2, r: DVec2) -> bool {
    r != p && r != q && r.cmpge(p.min(q)).all() && r.cmple(p.max(q)).all()
}

/// Intersection of segments ab and cd outside their common end points.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub(crate) struct Meeting {
    /// They cross inside both.
    pub(crate) crosses: bool,
    /// Whether c, d lie strictly inside ab.
    pub(crate) on_first: [bool; 2],
    /// Whether a, b lie strictly inside cd.
    pub(crate) on_second: [bool; 2],
}

impl Meeting {
    /// Decides all cases exactly.
    pub(crate) fn of([a, b]: [DVec2; 2], [c, d]: [DVec2; 2]) -> Self {
        let opposite = |x: f64, y: f64| x < 0.0 && y > 0.0 || x > 0.0 && y < 0.0;
        let (oc, od) = (orient(a, b, c), orient(a, b, d));
        if oc != 0.0 && od != 0.0 && !opposite(oc, od) {
            return Self::default();
        }
        let (oa, ob) = (orient(c, d, a), orient(c, d, b));
        Self {
            crosses: opposite(oc, od) && opposite(oa, ob),
            on_first: [oc == 0.0 && is_between(a, b, c), od == 0.0 && is_between(a, b, d)],
            on_second: [oa == 0.0 && is_between(c, d, a), ob == 0.0 && is_between(c, d, b)],
        }
    }

    /// Whether they share at most end points.
    pub(crate) fn is_none(self) -> bool {
        self == Self::default()
    }
}

/// The crossing of ab and cd, rounded. It is computed on the shorter segment, where a rounding error is
/// smaller.
pub(crate) fn crossing([a, b]: [DVec2; 2], [c, d]: [DVec2; 2]) -> DVec2 {
    if (b - a).length_squared() > (d - c).length_squared() {
        return crossing([c, d], [a, b]);
    }
    // To full relative precision; otherwise the crossing of almost parallel segments slides along them.
    let (oa, ob) = (twice_area(c, d, a), twice_area(c, d, b));
    let p = a + (b - a) * (oa / (oa - ob));
    // Rounding must not leave the box of the segment.
    p.clamp(a.min(b), a.max(b))
}

/// Squared distance from u to the segment ab.
pub(crate) fn distance_squared(u: DVec2, a: DVec2, b: DVec2) -> f64 {
    let (d, w) = (b - a, u - a);
    let t = w.dot(d) / d.length_squared();
    if t <= 0.0 {
        w.length_squared()
    } else if t >= 1.0 {
        (u - b).length_squared()
    } else {
        // Area divided by base: exact to rounding also if u is almost on the line.
        let cross = orient(a, b, u);
        cross * cross / d.length_squared()
    }
}

/// The part [t₀, t₁] of the segment pq inside a cell, if longer than a point (Liang and Barsky 1984). A
/// segment along the common side of two cells belongs only to the one with larger coordinates, so that it
/// counts once.
pub(crate) fn clip_segment(p: DVec2, q: DVec2, cell: &FilterCell) -> Option<(f64, f64)> {
    let (mut t0, mut t1) = (0.0_f64, 1.0_f64);
    let d = q - p;
    for axis in 0..2 {
        if d[axis] == 0.0 {
            if p[axis] < cell.min[axis] || p[axis] >= cell.max[axis] {
                return None;
            }
            continue;
        }
        let (a, b) = ((cell.min[axis] - p[axis]) / d[axis], (cell.max[axis] - p[axis]) / d[axis]);
        t0 = t0.max(a.min(b));
        t1 = t1.min(a.max(b));
    }
    (t0 < t1).then_some((t0, t1))
}

#[cfg(test)]
mod tests {
    use super::*;

    fn p(x: f64, y: f64) -> DVec2 {
        DVec2::new(x, y)
    }

    #[test]
    fn all_cases() {
        let ab = [p(0.0, 0.0), p(2.0, 0.0)];
        assert!(Meeting::of(ab, [p(1.0, -1.0), p(1.0, 1.0)]).crosses);
        assert_eq!(Meeting::of(ab, [p(1.0, 0.0), p(1.0, 1.0)]).on_first, [true, false]);
        assert_eq!(Meeting::of([p(1.0, 1.0), p(1.0, 0.0)], ab).on_second, [false, true]);
        let overlap = Meeting::of(ab, [p(1.0, 0.0), p(3.0, 0.0)]);
        assert_eq!((overlap.on_first, overlap.on_second), ([true, false], [false, true]));
        for cd in [[p(0.0, 0.0), p(1.0, 1.0)], [p(3.0, -1.0), p(3.0, 1.0)], [p(3.0, 0.0), p(4.0, 0.0)]] {
            assert!(Meeting::of(ab, cd).is_none(), "{cd:?}");
            assert!(Meeting::of(cd, ab).is_none(), "{cd:?}");
        }
        assert_eq!(crossing(ab, [p(1.0, -1.0), p(1.5, 1.0)]), p(1.25, 0.0));
    }

    #[test]
    fn a_segment_on_a_side_belongs_to_one_cell() {
        let (p, q) = (DVec2::new(1.0, 0.2), DVec2::new(1.0, 0.7));
        let left = FilterCell { min: DVec2::ZERO, max: DVec2::ONE };
        let right = FilterCell { min: DVec2::X, max: DVec2::new(2.0, 1.0) };
        assert_eq!(clip_segment(p, q, &left), None);
        assert_eq!(clip_segment(p, q, &right), Some((0.0, 1.0)));
    }
}
