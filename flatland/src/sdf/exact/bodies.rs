//! Discs and polygons: ray intersection, and critical directions.

use glam::DVec2;

use super::ExactError;
use crate::sdf::Sdf;
use crate::sdf::shapes::{Circle, Polygon, RoundedBox, Shape, segments_meet};

/// A disc or a polygon, with the index of its first parameter.
#[derive(Clone, Copy, Debug)]
pub(super) struct Body<'a> {
    outline: Outline<'a>,
    /// Index of the body.
    index: usize,
    first: usize,
}

#[derive(Clone, Copy, Debug)]
enum Outline<'a> {
    Circle(&'a Circle),
    Polygon(&'a Polygon),
    Box(&'a RoundedBox),
}

/// A disc's arc, or an edge of a polygon.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) struct Element {
    pub(super) body: usize,
    /// The edge from this vertex to the next; 0 for an arc.
    pub(super) part: usize,
}

/// A direction in which L may be discontinuous.
pub(super) struct Critical {
    pub(super) angle: f64,
    pub(super) rate: f64,
    pub(super) distance: f64,
    /// The elements that meet there.
    pub(super) skip: Vec<Element>,
    /// The body's visible normal just below and just above the angle.
    pub(super) normals: [Option<DVec2>; 2],
}

/// The bodies of a shape, if it is a union of shapes with closed forms.
pub(super) fn bodies(shape: &Shape) -> Result<Vec<Body<'_>>, ExactError> {
    let mut found = vec![];
    let width = collect(shape, 0, &mut found)?;
    for (second, b) in found.iter().enumerate() {
        for (first, a) in found[..second].iter().enumerate() {
            let gap = a.gap(b);
            // NaN is not sufficient either.
            if !(gap >= width && gap > 0.0) {
                return Err(ExactError::Blended { first, second, gap, width });
            }
        }
    }
    Ok(found)
}

/// Appends the bodies of a shape and returns the sum of its blending widths: nested unions blend no wider
/// than that.
fn collect<'a>(shape: &'a Shape, first: usize, found: &mut Vec<Body<'a>>) -> Result<f64, ExactError> {
    let outline = match shape {
        Shape::Circle(circle) => Outline::Circle(circle),
        Shape::Polygon(polygon) => Outline::Polygon(polygon),
        Shape::Box(rectangle) if rectangle.rounding() == 0.0 => Outline::Box(rectangle),
        Shape::Box(_) => return Err(ExactError::NoClosedForm { shape: "rounded box" }),
        Shape::Grid(_) => return Err(ExactError::NoClosedForm { shape: "grid" }),
        Shape::Union(union) => {
            let (a, b) = union.children();
            let inner = collect(a, first, found)? + collect(b, first + a.parameter_count(), found)?;
            return Ok(inner + union.width());
        }
    };
    found.push(Body { outline, index: found.len(), first });
    Ok(0.0)
}

pub(super) fn elements(bodies: &[Body<'_>]) -> Vec<Element> {
    let parts = |body: &Body<'_>| body.polygon().map_or(1, |p| p.vertices().len());
    bodies
        .iter()
        .flat_map(|body| (0..parts(body)).map(move |part| Element { body: body.index, part }))
        .collect()
}

fn outlines_meet(a: &Polygon, b: &Polygon) -> bool {
    let edges = |p: &Polygon| -> Vec<[DVec2; 2]> {
        let vertices = p.vertices();
        (0..vertices.len()).map(|i| [vertices[i], vertices[(i + 1) % vertices.len()]]).collect()
    };
    let others = edges(b);
    edges(a).iter().any(|&first| others.iter().any(|&second| segments_meet(first, second)))
}

impl Body<'_> {
    fn polygon(&self) -> Option<&Polygon> {
        match self.outline {
            Outline::Circle(_) => None,
            Outline::Polygon(polygon) => Some(polygon),
            Outline::Box(rectangle) => Some(rectangle.core()),
        }
    }

    /// Distance between two bodies; negative or 0 if they overlap. For two polygons whose edges do not meet
    /// it is attained at a vertex of one.
    fn gap(&self, other: &Self) -> f64 {
        match (self.outline, other.outline) {
            (Outline::Circle(a), Outline::Circle(b)) => {
                (a.centre() - b.centre()).length() - a.radius() - b.radius()
            }
            (Outline::Circle(a), _) => {
                other.polygon().map_or(f64::NAN, |p| p.jet(a.centre()).value) - a.radius()
            }
            (_, Outline::Circle(_)) => other.gap(self),
            _ => {
                let (Some(a), Some(b)) = (self.polygon(), other.polygon()) else { return f64::NAN };
                let one = |p: &Polygon, q: &Polygon| {
                    p.vertices().iter().map(|&v| q.jet(v).value).fold(f64::INFINITY, f64::min)
                };
                let gap = one(a, b).min(one(b, a));
                if outlines_meet(a, b) { gap.min(0.0) } else { gap }
            }
        }
    }

    fn ends(&self, part: usize) -> [DVec2; 2] {
        let vertices = self.polygon().map_or(&[] as &[DVec2], |p| p.vertices());
        [vertices[part], vertices[(part + 1) % vertices.len()]]
    }

    fn vertex_velocity(&self, vertex: usize, direction: &[f64]) -> DVec2 {
        let own = &direction[self.first..];
        match self.outline {
            Outline::Box(rectangle) => rectangle.corner_velocity(vertex, own),
            Outline::Circle(_) | Outline::Polygon(_) => DVec2::new(own[2 * vertex], own[2 * vertex + 1]),
        }
    }

    /// Distance to an element along a ray.
    pub(super) fn intersect(&self, part: usize, eye: DVec2, direction: DVec2) -> Option<f64> {
        if let Outline::Circle(circle) = self.outline {
            let offset = circle.centre() - eye;
            let (along, across) = (offset.dot(direction), offset.perp_dot(direction));
            let square = (circle.radius() - across) * (circle.radius() + across);
            let t = along - square.max(0.0).sqrt();
            return (square >= 0.0 && t > 0.0).then_some(t);
        }
        let [a, b] = self.ends(part).map(|v| v - eye);
        let (from, to) = (direction.perp_dot(a), direction.perp_dot(b));
        // An end point belongs to one side only.
        if (from < 0.0) == (to < 0.0) {
            return None;
        }
        let s = from / (from - to);
        let t = a.dot(direction) * (1.0 - s) + b.dot(direction) * s;
        (t > 0.0).then_some(t)
    }

    pub(super) fn normal(&self, part: usize, x: DVec2) -> DVec2 {
        match self.outline {
            Outline::Circle(circle) => (x - circle.centre()) / circle.radius(),
            _ => self.polygon().map_or(DVec2::ZERO, |p| p.edge_normal(part)),
        }
    }

    /// ẋ and ṅ of the point seen at x in a fixed direction ω.
    pub(super) fn rates(&self, part: usize, x: DVec2, omega: DVec2, direction: &[f64]) -> (DVec2, DVec2) {
        let n = self.normal(part, x);
        if let Outline::Circle(circle) = self.outline {
            let own = &direction[self.first..];
            let centre = DVec2::new(own[0], own[1]);
            let point = omega * ((n.dot(centre) + own[2]) / n.dot(omega));
            let turn = (point - centre) / circle.radius();
            return (point, turn - n.dot(turn) * n);
        }
        let [a, b] = self.ends(part);
        let next = (part + 1) % self.polygon().map_or(1, |p| p.vertices().len());
        let [va, vb] = [part, next].map(|vertex| self.vertex_velocity(vertex, direction));
        let length = (b - a).length();
        let tangent = (b - a) / length;
        let s = (x - a).dot(tangent) / length;
        let point = omega * (n.dot(va + s * (vb - va)) / n.dot(omega));
        (point, tangent * (-n.dot(vb - va) / length))
    }

    /// Tangents of a disc, or vertices of a polygon.
    pub(super) fn critical(&self, eye: DVec2, direction: &[f64]) -> Vec<Critical> {
        match self.outline {
            Outline::Circle(circle) => self.tangents(circle, eye, direction).into(),
            _ => {
                let count = self.polygon().map_or(0, |p| p.vertices().len());
                (0..count).map(|vertex| self.corner(vertex, count, eye, direction)).collect()
            }
        }
    }

    /// α = β ± atan(r/t) with t² = d² − r².
    fn tangents(&self, circle: &Circle, eye: DVec2, direction: &[f64]) -> [Critical; 2] {
        let own = &direction[self.first..];
        let (velocity, growth) = (DVec2::new(own[0], own[1]), own[2]);
        let offset = circle.centre() - eye;
        let (d, r) = (offset.length(), circle.radius());
        let t = ((d - r) * (d + r)).sqrt();
        let t_rate = (offset.dot(velocity) - r * growth) / t;
        let half = r.atan2(t);
        let half_rate = (growth * t - r * t_rate) / (d * d);
        let (middle, middle_rate) = (offset.to_angle(), offset.perp_dot(velocity) / (d * d));
        [-1.0, 1.0].map(|side| {
            let angle = middle + side * half;
            // The normal points away from the disc: −perp at the lower tangent.
            let normal = side * DVec2::from_angle(angle).perp();
            Critical {
                angle,
                rate: middle_rate + side * half_rate,
                distance: t,
                skip: vec![Element { body: self.index, part: 0 }],
                normals: if side > 0.0 { [Some(normal), None] } else { [None, Some(normal)] },
            }
        })
    }

    fn corner(&self, vertex: usize, count: usize, eye: DVec2, direction: &[f64]) -> Critical {
        let before = (vertex + count - 1) % count;
        let [here, next] = self.ends(vertex);
        let previous = self.ends(before)[0];
        let offset = here - eye;
        let distance = offset.length();
        let velocity = self.vertex_velocity(vertex, direction);
        let edges = [(before, previous), (vertex, next)];
        // On one side the visible edge is the one that leaves to that side and faces the eye.
        let seen = |side: f64| {
            let facing = edges.iter().filter(|(_, end)| side * offset.perp_dot(*end - here) > 0.0);
            let normals = facing.map(|(part, _)| self.normal(*part, here));
            normals.into_iter().find(|n| n.dot(offset) < 0.0)
        };
        Critical {
            angle: offset.to_angle(),
            rate: offset.perp_dot(velocity) / (distance * distance),
            distance,
            skip: edges.map(|(part, _)| Element { body: self.index, part }).into(),
            normals: [seen(-1.0), seen(1.0)],
        }
    }
}
