//! Gauss–Legendre quadrature on segments and triangles, and clipping to a rectangle.

use std::sync::LazyLock;

use glam::{DVec2, DVec3};

use crate::plane::{Film, Filter, FilterCell, twice_area};
use crate::quadrature::gauss_legendre;

/// Nodes and weights on [0, 1].
#[derive(Debug)]
pub(super) struct Rule(Vec<(f64, f64)>);

/// Exact for degree 5 on segments and total degree 4 on triangles: a quadratic shade times a bilinear filter,
/// and with a linear velocity on segments.
static POLYNOMIAL: LazyLock<Rule> = LazyLock::new(|| Rule(gauss_legendre(3)));
/// Rule for the Gaussian filter on cells one σ wide.
static SMOOTH: LazyLock<Rule> = LazyLock::new(|| Rule(gauss_legendre(8)));

impl Rule {
    /// The rule that is exact, or for the Gaussian converged, on the cells of a film's filter.
    pub(super) fn of(film: &Film) -> &'static Self {
        match film.filter() {
            Filter::Box | Filter::Tent => &POLYNOMIAL,
            Filter::Gaussian => &SMOOTH,
        }
    }
    /// Calls `f(t, weight)` for the points of [0, 1]; the weights sum to 1.
    pub(super) fn segment(&self, mut f: impl FnMut(f64, f64)) {
        self.0.iter().for_each(|&(t, w)| f(t, w));
    }

    /// Calls `f(point, weight)` for the points of a piece of a triangle, the unit square collapsed
    /// onto a corner (Duffy 1982); the weights sum to the piece's area.
    pub(super) fn triangle(&self, piece: &Piece, mut f: impl FnMut(&Point, f64)) {
        let [a, b, c] = &piece.corners;
        for &(s, ws) in &self.0 {
            for &(t, wt) in &self.0 {
                f(&a.lerp(&b.lerp(c, t), s), piece.twice_area * s * ws * wt);
            }
        }
    }
}

/// A point of a triangle: its position, and its barycentric coordinates, which are accurate relative to the
/// triangle, however thin that is.
#[derive(Clone, Copy, Debug)]
pub(super) struct Point {
    pub(super) u: DVec2,
    pub(super) barycentric: DVec3,
}

impl Point {
    /// self + t (other − self), which preserves a common coordinate.
    pub(super) fn lerp(&self, other: &Self, t: f64) -> Self {
        Self {
            u: self.u + t * (other.u - self.u),
            barycentric: self.barycentric + t * (other.barycentric - self.barycentric),
        }
    }
}

/// A triangle inside a larger one.
#[derive(Clone, Copy, Debug)]
pub(super) struct Piece {
    corners: [Point; 3],
    twice_area: f64,
}

/// A convex polygon of at most 7 corners: a triangle clipped to a rectangle.
#[derive(Clone, Copy, Debug)]
pub(super) struct Clipped {
    corners: [Point; 8],
    len: usize,
    /// Twice the area of the whole triangle.
    twice_area: f64,
}

impl Clipped {
    /// Clips a triangle (Sutherland and Hodgman 1974). Corners on a side of the cell have the side's
    /// coordinate exactly. Empty if the intersection has no area.
    pub(super) fn new(triangle: [DVec2; 3], cell: &FilterCell) -> Self {
        let [a, b, c] = triangle;
        let mut corners = [Point { u: a, barycentric: DVec3::ZERO }; 8];
        for k in 0..3 {
            corners[k] = Point { u: triangle[k], barycentric: DVec3::AXES[k] };
        }
        let mut this = Self { corners, len: 3, twice_area: twice_area(a, b, c) };
        for axis in 0..2 {
            this.keep(axis, cell.min[axis], 1.0);
            this.keep(axis, cell.max[axis], -1.0);
        }
        if this.pieces().map(|p| p.twice_area).sum::<f64>() <= 0.0 {
            this.len = 0;
        }
        this
    }

    fn keep(&mut self, axis: usize, side: f64, sign: f64) {
        let mut out = self.corners;
        let mut len = 0;
        for i in 0..self.len {
            let (p, q) = (self.corners[i], self.corners[(i + 1) % self.len]);
            let (dp, dq) = (sign * (p.u[axis] - side), sign * (q.u[axis] - side));
            if dp >= 0.0 {
                out[len] = p;
                len += 1;
            }
            if (dp > 0.0 && dq < 0.0) || (dp < 0.0 && dq > 0.0) {
                out[len] = p.lerp(&q, dp / (dp - dq));
                out[len].u[axis] = side;
                len += 1;
            }
        }
        self.corners = out;
        self.len = len;
    }

    /// The corners in order.
    pub(super) fn corners(&self) -> &[Point] {
        &self.corners[..self.len]
    }

    /// The triangles of the fan about the first corner.
    pub(super) fn pieces(&self) -> impl Iterator<Item = Piece> {
        let c = self.corners();
        (2..c.len()).map(move |i| {
            let corners = [c[0], c[i - 1], c[i]];
            // The area relative to the whole is the determinant of the barycentric coordinates.
            let [p, q, r] = corners.map(|c| c.barycentric);
            let (v, w) = (q - p, r - p);
            Piece { corners, twice_area: self.twice_area * (v.x * w.y - v.y * w.x) }
        })
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn rules_are_exact_to_their_degree() {
        for (rule, n) in [(&*POLYNOMIAL, 3), (&*SMOOTH, 8)] {
            for degree in 0..2 * n {
                let mut sum = 0.0;
                rule.segment(|t, w| sum += w * t.powi(degree));
                assert!((sum - 1.0 / f64::from(degree + 1)).abs() < 1e-15, "{n} {degree}");
            }
        }
        // ∫ x³ y over the triangle (0,0), (1,0), (0,1) is 3!·1!/6! = 1/120.
        let mut sum = 0.0;
        let cell = FilterCell { min: DVec2::ZERO, max: DVec2::ONE };
        for piece in Clipped::new([DVec2::ZERO, DVec2::X, DVec2::Y], &cell).pieces() {
            POLYNOMIAL.triangle(&piece, |p, w| sum += w * p.u.x.powi(3) * p.u.y);
        }
        assert!((sum - 1.0 / 120.0).abs() < 1e-16);
    }

    #[test]
    fn clipping_keeps_area_and_sides() {
        let triangle = [DVec2::new(-1.0, -1.0), DVec2::new(3.0, -1.0), DVec2::new(-1.0, 3.0)];
        let cell = FilterCell { min: DVec2::ZERO, max: DVec2::splat(1.5) };
        let mut area = 0.0;
        let clipped = Clipped::new(triangle, &cell);
        for piece in clipped.pieces() {
            POLYNOMIAL.triangle(&piece, |_, w| area += w);
        }
        // The square less the corner cut off by x + y = 2.
        assert!((area - (2.25 - 0.5)).abs() < 1e-15);
        // Contact along a side has no area.
        let outside = [DVec2::new(0.0, 0.0), DVec2::new(0.0, 1.0), DVec2::new(-1.0, 0.0)];
        assert!(Clipped::new(outside, &cell).corners().is_empty());
    }
}
