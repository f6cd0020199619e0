//! Simple polygons, by exact signed distance.

use glam::{DMat2, DVec2};

use super::ShapeError;
use super::point::PointDistance;
use crate::sdf::distance::{Jet, Sdf, SecondOrder};

/// The signed distance to a simple polygon, of either orientation. Parameters: x and y of every vertex, in
/// order.
///
/// Outside a convex polygon φ is continuously differentiable. A reflex corner causes a medial axis in the
/// space outside, across which ∇φ is discontinuous.
#[derive(Clone, Debug, PartialEq)]
pub struct Polygon {
    vertices: Vec<DVec2>,
    /// 1 if the vertices are counter-clockwise (y up), −1 if not.
    orientation: f64,
}

/// Largest coordinate, for which products of two differences do not overflow.
const LARGEST: f64 = 1e150;

/// The part of the polygon nearest to a point.
enum Nearest {
    /// A vertex, and whether the point is outside (1) or inside (−1).
    Vertex { index: usize, side: f64 },
    /// The point (1 − s) a + s b of an edge.
    Edge { edge: Edge, ends: [usize; 2], s: f64 },
}

/// An edge and its line.
#[derive(Clone, Copy)]
struct Edge {
    start: DVec2,
    tangent: DVec2,
    normal: DVec2,
    length: f64,
}

impl Edge {
    /// φ̇ = −n·((1 − s) ȧ + s ḃ) and ∇φ̇ = −t n·(ḃ − ȧ)/|b − a|.
    fn rate(&self, s: f64, [a, b]: [DVec2; 2]) -> Jet<DVec2> {
        let [a, b] = [a, b].map(|velocity| self.normal.dot(velocity));
        Jet { value: -(1.0 - s) * a - s * b, gradient: self.tangent * ((a - b) / self.length) }
    }

    /// The covectors of ȧ and ḃ.
    fn transpose(&self, s: f64, covector: Jet<DVec2>) -> [DVec2; 2] {
        let turn = covector.gradient.dot(self.tangent) / self.length;
        [turn - (1.0 - s) * covector.value, -turn - s * covector.value].map(|c| c * self.normal)
    }
}

impl Polygon {
    /// A simple polygon of at least three vertices.
    ///
    /// # Errors
    /// If a coordinate is beyond ±10¹⁵⁰ or not a number, there are too few vertices, or two edges meet.
    pub fn new(vertices: Vec<DVec2>) -> Result<Self, ShapeError> {
        let count = vertices.len();
        if count < 3 {
            return Err(ShapeError::Vertices { count });
        }
        for v in &vertices {
            ShapeError::check("polygon", "vertex.x", v.x, "within ±1e150", v.x.abs() <= LARGEST)?;
            ShapeError::check("polygon", "vertex.y", v.y, "within ±1e150", v.y.abs() <= LARGEST)?;
        }
        check_simple(&vertices)?;
        let orientation = orientation(&vertices)?;
        Ok(Self { vertices, orientation })
    }

    pub(super) fn from_parameters(parameters: &[f64]) -> Result<Self, ShapeError> {
        Self::new(parameters.chunks_exact(2).map(|p| DVec2::new(p[0], p[1])).collect())
    }

    pub(super) fn parameters(&self) -> Vec<f64> {
        self.vertices.iter().flat_map(|v| [v.x, v.y]).collect()
    }

    /// The vertices.
    #[must_use]
    pub fn vertices(&self) -> &[DVec2] {
        &self.vertices
    }

    fn edge(&self, index: usize) -> Edge {
        let (a, b) = (self.vertices[index], self.vertices[self.next(index)]);
        let length = (b - a).length();
        let tangent = (b - a) / length;
        Edge { start: a, tangent, normal: -self.orientation * tangent.perp(), length }
    }

    /// The outward normal of the edge from this vertex to the next.
    pub(in crate::sdf) fn edge_normal(&self, index: usize) -> DVec2 {
        self.edge(index).normal
    }

    fn next(&self, index: usize) -> usize {
        if index + 1 == self.vertices.len() { 0 } else { index + 1 }
    }

    fn nearest(&self, x: DVec2) -> Nearest {
        let (mut best, mut least) = ((0, 0.0), f64::INFINITY);
        for index in 0..self.vertices.len() {
            let (a, b) = (self.vertices[index], self.vertices[self.next(index)]);
            let s = ((x - a).dot(b - a) / (b - a).length_squared()).clamp(0.0, 1.0);
            let square = (x - a - s * (b - a)).length_squared();
            if square < least {
                (best, least) = ((index, s), square);
            }
        }
        let (index, s) = best;
        if s <= 0.0 {
            self.corner(index, x)
        } else if s >= 1.0 {
            self.corner(self.next(index), x)
        } else {
            Nearest::Edge { edge: self.edge(index), ends: [index, self.next(index)], s }
        }
    }

    /// A convex corner is nearest only to points outside, a reflex one only to points inside, and a straight
    /// one is a point of its edges. Rounding alone assigns other points to a corner that is almost straight:
    /// for them too it is treated as a point of an edge.
    fn corner(&self, index: usize, x: DVec2) -> Nearest {
        let count = self.vertices.len();
        let previous = (index + count - 1) % count;
        let (edge, before) = (self.edge(index), self.edge(previous));
        let next = self.next(index);
        let side = self.orientation * turn(self.vertices[previous], edge.start, self.vertices[next]);
        let beside = (edge.normal + before.normal).dot(x - edge.start);
        let misplaced = edge.normal.dot(before.normal) > 0.0 && side * beside < 0.0;
        if side == 0.0 || misplaced {
            Nearest::Edge { edge, ends: [index, next], s: 0.0 }
        } else {
            Nearest::Vertex { index, side }
        }
    }

    /// [`rate`](Sdf::rate) from the velocity of each vertex.
    pub(super) fn rate_of(&self, x: DVec2, velocity: impl Fn(usize) -> DVec2) -> Jet<DVec2> {
        match self.nearest(x) {
            Nearest::Vertex { index, side } => {
                PointDistance::new(x, self.vertices[index]).rate(velocity(index)) * side
            }
            Nearest::Edge { edge, ends, s } => edge.rate(s, ends.map(velocity)),
        }
    }

    /// The transpose of [`rate_of`](Self::rate_of).
    pub(super) fn scatter(&self, x: DVec2, covector: Jet<DVec2>, mut add: impl FnMut(usize, DVec2)) {
        match self.nearest(x) {
            Nearest::Vertex { index, side } => {
                let point = PointDistance::new(x, self.vertices[index]);
                add(index, point.transpose(covector * side));
            }
            Nearest::Edge { edge, ends, s } => {
                let [a, b] = edge.transpose(s, covector);
                add(ends[0], a);
                add(ends[1], b);
            }
        }
    }
}

/// 1 if a → b → c turns left, −1 if right, 0 if neither, exactly (Shewchuk 1997).
fn turn(a: DVec2, b: DVec2, c: DVec2) -> f64 {
    let [a, b, c] = [a, b, c].map(|p| robust::Coord { x: p.x, y: p.y });
    let area = robust::orient2d(a, b, c);
    if area == 0.0 { 0.0 } else { area.signum() }
}

/// Whether p lies on the segment from a to b.
fn within([a, b]: [DVec2; 2], p: DVec2) -> bool {
    turn(a, b, p) == 0.0 && p.cmpge(a.min(b)).all() && p.cmple(a.max(b)).all()
}

/// Whether two segments share a point.
pub(in crate::sdf) fn segments_meet(first: [DVec2; 2], second: [DVec2; 2]) -> bool {
    let sides = |[a, b]: [DVec2; 2], other: [DVec2; 2]| other.map(|p| turn(a, b, p)).iter().product::<f64>();
    let crossing = sides(first, second) < 0.0 && sides(second, first) < 0.0;
    crossing || second.iter().any(|&p| within(first, p)) || first.iter().any(|&p| within(second, p))
}

/// Tests all pairs of edges.
fn check_simple(vertices: &[DVec2]) -> Result<(), ShapeError> {
    let count = vertices.len();
    let edge = |i: usize| [vertices[i], vertices[(i + 1) % count]];
    for first in 0..count {
        let [a, b] = edge(first);
        if a == b {
            return Err(ShapeError::NotSimple { first, second: first });
        }
        for second in first + 1..count {
            let [c, d] = edge(second);
            // Neighbours share one vertex and no more.
            let meet = if second == first + 1 {
                within([a, b], d) || within([c, d], a)
            } else if first == 0 && second + 1 == count {
                within([a, b], c) || within([c, d], b)
            } else {
                segments_meet([a, b], [c, d])
            };
            if meet {
                return Err(ShapeError::NotSimple { first, second });
            }
        }
    }
    Ok(())
}

/// The orientation at the lowest of the leftmost vertices of a simple polygon, which is convex.
fn orientation(vertices: &[DVec2]) -> Result<f64, ShapeError> {
    let count = vertices.len();
    let order = |a: &usize, b: &usize| {
        let (a, b) = (vertices[*a], vertices[*b]);
        a.x.total_cmp(&b.x).then(a.y.total_cmp(&b.y))
    };
    let lowest = (0..count).min_by(order).unwrap_or(0);
    let before = (lowest + count - 1) % count;
    let found = turn(vertices[before], vertices[lowest], vertices[(lowest + 1) % count]);
    // Only if the polygon is so small that its area underflows.
    if found == 0.0 { Err(ShapeError::NotSimple { first: before, second: lowest }) } else { Ok(found) }
}

impl Sdf<DVec2> for Polygon {
    fn jet(&self, x: DVec2) -> Jet<DVec2> {
        match self.nearest(x) {
            Nearest::Vertex { index, side } => PointDistance::new(x, self.vertices[index]).jet() * side,
            Nearest::Edge { edge, .. } => {
                Jet { value: edge.normal.dot(x - edge.start), gradient: edge.normal }
            }
        }
    }

    fn second_order(&self, x: DVec2) -> SecondOrder<DVec2> {
        let hessian = match self.nearest(x) {
            Nearest::Vertex { index, side } => {
                PointDistance::new(x, self.vertices[index]).second_order().hessian * side
            }
            Nearest::Edge { .. } => DMat2::ZERO,
        };
        SecondOrder { jet: self.jet(x), hessian }
    }

    fn parameter_count(&self) -> usize {
        2 * self.vertices.len()
    }

    fn rate(&self, x: DVec2, direction: &[f64]) -> Jet<DVec2> {
        self.rate_of(x, |i| DVec2::new(direction[2 * i], direction[2 * i + 1]))
    }

    fn add_parameter_gradient(&self, x: DVec2, covector: Jet<DVec2>, gradient: &mut [f64]) {
        self.scatter(x, covector, |i, c| {
            gradient[2 * i] += c.x;
            gradient[2 * i + 1] += c.y;
        });
    }
}
