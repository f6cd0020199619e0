//! Turned coordinates in which no edge is vertical, and edges in them.

use flatland::plane::Scene;
use glam::DVec2;
use num_dual::Dual64;

use crate::double_double::DoubleDouble;
use crate::dual::{Vector, Vector2};

/// A point in turned coordinates, to 106 bits.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Point {
    pub(super) x: DoubleDouble,
    pub(super) y: DoubleDouble,
}

/// The rotation (x, y) ↦ (c x + s y, c y − s x), with 0 < s, c.
#[derive(Clone, Copy, Debug)]
pub(super) struct Frame {
    c: f64,
    s: f64,
    /// c² + s², which is 1 only to rounding.
    pub(super) area: f64,
}

impl Frame {
    /// The candidate angle in the first quadrant that maximises the least angle of any edge, both image axes
    /// included, to the vertical.
    pub(super) fn new(scene: &Scene) -> Self {
        let point = |v: usize| scene.vertices()[v];
        let mut directions: Vec<_> =
            scene.edges().map(|(_, [a, b])| (point(b) - point(a)).normalize_or_zero()).collect();
        directions.extend([DVec2::X, DVec2::Y]);
        let steepest = |angle: f64| {
            let axis = DVec2::from_angle(angle);
            directions.iter().map(|d| d.dot(axis).abs()).fold(f64::INFINITY, f64::min)
        };
        // No multiples of simple fractions of π.
        let angles = (0..200).map(|i| 0.151_713 + 0.006_341 * f64::from(i));
        let best = angles.max_by(|a, b| steepest(*a).total_cmp(&steepest(*b))).unwrap_or(0.739_085_1);
        Self::at(best)
    }

    /// The rotation by an angle in (0.15, 1.42).
    pub(super) fn at(angle: f64) -> Self {
        let (s, c) = angle.sin_cos();
        Self { c, s, area: c * c + s * s }
    }

    pub(super) fn turn(&self, p: DVec2) -> Point {
        let product = DoubleDouble::product;
        Point {
            x: product(self.c, p.x) + product(self.s, p.y),
            y: product(self.c, p.y) - product(self.s, p.x),
        }
    }

    pub(super) fn turn_vector(&self, v: DVec2) -> DVec2 {
        DVec2::new(self.c * v.x + self.s * v.y, self.c * v.y - self.s * v.x)
    }

    /// The image coordinates of the turned (x, y).
    pub(super) fn turn_back(&self, x: f64, y: Dual64) -> Vector2 {
        Vector([(y * -self.s + self.c * x) / self.area, (y * self.c + self.s * x) / self.area])
    }
}

/// A segment in turned coordinates whose two ends move.
#[derive(Clone, Debug)]
pub(super) struct Edge {
    pub(super) left: Point,
    pub(super) right: Point,
    slope: DoubleDouble,
    left_velocity: DVec2,
    /// dy/dx and its derivative.
    dual_slope: Dual64,
}

impl Edge {
    /// The segment between two points of the image with their velocities.
    pub(super) fn new(frame: &Frame, ends: [(DVec2, DVec2); 2]) -> Self {
        let [mut a, mut b] = ends.map(|(p, v)| (frame.turn(p), frame.turn_vector(v)));
        if b.0.x < a.0.x {
            std::mem::swap(&mut a, &mut b);
        }
        let (dx, dy) = (b.0.x - a.0.x, b.0.y - a.0.y);
        let dv = b.1 - a.1;
        Self {
            left: a.0,
            right: b.0,
            slope: dy.over(dx),
            left_velocity: a.1,
            dual_slope: Dual64::new(dy.value(), dv.y) / Dual64::new(dx.value(), dv.x),
        }
    }

    /// Its height at x, also beyond its ends.
    pub(super) fn height(&self, x: DoubleDouble) -> DoubleDouble {
        self.left.y + (x - self.left.x) * self.slope
    }

    /// Whether the edge reaches from the left of x, x included, to the right of it. At the x of a vertex,
    /// both, neither or only the right one of the two edges that meet there count.
    pub(super) fn spans(&self, x: DoubleDouble) -> bool {
        self.left.x <= x && x < self.right.x
    }

    /// The x at which it crosses another; `None` if they do not cross or are parallel.
    pub(super) fn crossing(&self, other: &Self) -> Option<DoubleDouble> {
        let from = if self.left.x > other.left.x { self.left.x } else { other.left.x };
        let to = if self.right.x < other.right.x { self.right.x } else { other.right.x };
        if from >= to {
            return None;
        }
        let zero = DoubleDouble::default();
        let before = self.height(from) - other.height(from);
        let after = self.height(to) - other.height(to);
        if (before < zero && after > zero) || (before > zero && after < zero) {
            Some(from + (to - from) * before.over(before - after))
        } else {
            None
        }
    }

    /// Its height above `origin` as a function of the offset from `origin` in x.
    pub(super) fn line(&self, origin: Point) -> Line {
        // y(x) = y₀ + (x − x₀) m. The real part is taken through the origin in 106 bits; the dual part from
        // the nearer end.
        let x = (self.left.x - origin.x).value();
        let velocity = self.left_velocity;
        Line {
            height: (self.height(origin.x) - origin.y).value(),
            slope: self.dual_slope,
            x: Dual64::new(x, velocity.x),
            velocity: velocity.y,
        }
    }
}

/// The line of a moving edge near a pixel.
#[derive(Clone, Copy, Debug)]
pub(super) struct Line {
    height: f64,
    slope: Dual64,
    x: Dual64,
    velocity: f64,
}

impl Line {
    /// dy/dx.
    pub(super) fn slope(&self) -> f64 {
        self.slope.re
    }

    /// y and ∂y/∂θ at a fixed x.
    pub(super) fn at(&self, x: f64) -> Dual64 {
        let moved = (-self.x + x) * self.slope + Dual64::new(0.0, self.velocity);
        Dual64::new(self.height + self.slope.re * x, moved.eps)
    }
}
