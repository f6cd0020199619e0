//! Curves: segments and arcs of circles, and where rays meet them.

use std::f64::consts::TAU;

use glam::DVec2;

use crate::calculus::{Number, Vec2};

/// A segment, or an arc of a circle.
///
/// The point at s ∈ [0, 1] is a material point: it moves with the curve, and s does not change. The left side
/// is to the left of increasing s.
#[derive(Clone, Copy, Debug)]
pub enum Curve<T = f64> {
    /// From the first point, s = 0, to the second.
    Segment([Vec2<T>; 2]),
    /// The points c + R (cos α, sin α) at α = start + s extent.
    Arc {
        /// c.
        centre: Vec2<T>,
        /// R.
        radius: T,
        /// The angle at s = 0, in radians, from +x towards +y.
        start: T,
        /// The angle from s = 0 to s = 1, in radians, in [−2π, 2π]. The centre is on the left side if it is
        /// positive. A full turn that opens has no derivative: its extent must not change.
        extent: T,
    },
}

/// Fraction of a curve that counts as its end. Rounding of a contact is some 10⁻¹⁶ of the coordinates, so
/// that ends of curves of 10⁻⁷ of their coordinates are still recognised.
const END: f64 = 1e-9;

/// Rounding of a ray's intersection with a circle, relative to the coordinates of ray and circle.
const ROUNDING: f64 = 8.0 * f64::EPSILON;

/// A ray's intersection with a curve, without derivatives.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Meeting {
    /// Distance along the unit direction.
    pub(crate) distance: f64,
    /// Whether the ray has met the arc's circle before.
    pub(crate) is_far: bool,
}

/// A ray's intersection with a curve, with derivatives.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Contact<T> {
    pub(crate) point: Vec2<T>,
    /// Its material coordinate.
    pub(crate) s: T,
    /// The unit normal on the left side.
    pub(crate) normal: Vec2<T>,
    /// R − |ω × (c − o)|: how far inside the arc's tangent the ray passes. `None` for a segment.
    pub(crate) depth: Option<T>,
}

impl Curve {
    /// A segment from a to b.
    #[must_use]
    pub fn segment(a: DVec2, b: DVec2) -> Self {
        Self::Segment([a, b].map(Vec2::constant))
    }

    /// An arc of a circle, from the angle `start` to the angle `start + extent`.
    #[must_use]
    pub fn arc(centre: DVec2, radius: f64, start: f64, extent: f64) -> Self {
        Self::Arc { centre: Vec2::constant(centre), radius, start, extent }
    }

    /// The point at s.
    #[must_use]
    pub fn at(&self, s: f64) -> DVec2 {
        match *self {
            Self::Segment([a, b]) => a.value().lerp(b.value(), s),
            Self::Arc { centre, radius, start, extent } => {
                centre.value() + radius * DVec2::from_angle(start + s * extent)
            }
        }
    }

    /// Its numbers: 4 coordinates, or centre, radius, start and extent.
    #[must_use]
    pub fn numbers(&self) -> Vec<f64> {
        match *self {
            Self::Segment([a, b]) => vec![a.x, a.y, b.x, b.y],
            Self::Arc { centre, radius, start, extent } => vec![centre.x, centre.y, radius, start, extent],
        }
    }

    /// The curve with other numbers, in the order of [`numbers`](Self::numbers).
    pub(super) fn with(&self, numbers: &[f64]) -> Self {
        match (self, numbers) {
            (Self::Segment(_), &[ax, ay, bx, by, ..]) => {
                Self::Segment([Vec2::new(ax, ay), Vec2::new(bx, by)])
            }
            (Self::Arc { .. }, &[x, y, radius, start, extent, ..]) => {
                Self::Arc { centre: Vec2::new(x, y), radius, start, extent }
            }
            _ => *self,
        }
    }

    /// The nearest intersection with a ray. A ray `from_self` starts on the curve, and its start does not
    /// count.
    pub(crate) fn meet(&self, origin: DVec2, direction: DVec2, from_self: bool) -> Option<Meeting> {
        match self {
            Self::Segment(_) if from_self => None,
            Self::Segment(ends) => {
                let [a, b] = ends.map(|p| p.value() - origin);
                let (left, right) = (direction.perp_dot(a), direction.perp_dot(b));
                if (left < 0.0) == (right < 0.0) {
                    return None;
                }
                let edge = b - a;
                let distance = a.perp_dot(edge) / direction.perp_dot(edge);
                (distance > 0.0).then_some(Meeting { distance, is_far: false })
            }
            &Self::Arc { centre, radius, .. } => {
                let to_centre = centre.value() - origin;
                let (along, aside) = (direction.dot(to_centre), direction.perp_dot(to_centre).abs());
                if aside >= radius {
                    return None;
                }
                // A ray along the tangent does not enter: a chord shorter than the rounding of its ends.
                let rounding = ROUNDING * (origin.length() + centre.value().length() + radius);
                let half_chord = ((radius - aside) * (radius + aside)).sqrt();
                [false, true].into_iter().find_map(|is_far| {
                    let distance = if is_far { along + half_chord } else { along - half_chord };
                    // From the circle itself one intersection is the start, and the other exists inwards.
                    let is_start = from_self && (!is_far || along <= rounding);
                    let on_arc = || {
                        let s = self.parameter(origin + distance * direction - centre.value());
                        (0.0..=1.0).contains(&s)
                    };
                    (distance > 0.0 && !is_start && on_arc()).then_some(Meeting { distance, is_far })
                })
            }
        }
    }

    /// Whether two curves meet or overlap. A contact of an end with an end is allowed.
    pub(super) fn meets(&self, other: &Self) -> bool {
        let points: Vec<DVec2> = match (self, other) {
            (Self::Segment([a, b]), _) => other.crossings([a.value(), b.value()]),
            (_, Self::Segment([a, b])) => self.crossings([a.value(), b.value()]),
            (&Self::Arc { centre: c, radius: r, .. }, &Self::Arc { centre: d, radius: q, .. }) => {
                let between = d.value() - c.value();
                let distance = between.length();
                let along = 0.5 * (distance + (r - q) * (r + q) / distance);
                let across = (r - along) * (r + along);
                if across < 0.0 || !along.is_finite() {
                    vec![]
                } else {
                    let axis = between / distance;
                    [1.0, -1.0].map(|k| c.value() + along * axis + k * across.sqrt() * axis.perp()).to_vec()
                }
            }
        };
        let is_inside = |s: f64| (END..=1.0 - END).contains(&s);
        let crosses = points.into_iter().any(|p| {
            let places = [self, other].map(|curve| curve.nearest(p));
            places.iter().all(|s| (-END..=1.0 + END).contains(s)) && places.into_iter().any(is_inside)
        });
        // Curves of one line or circle have no crossings: their ends, or the middles of equal ones, coincide.
        let lies_on = |a: &Self, b: &Self| {
            [0.0, 0.5, 1.0].into_iter().any(|s| {
                let (p, t) = (a.at(s), b.nearest(a.at(s)));
                is_inside(t) && p.distance(b.at(t)) <= END * b.length()
            })
        };
        crosses || lies_on(self, other) || lies_on(other, self)
    }

    /// Intersections of the line through two points with the line or circle of the curve.
    fn crossings(&self, [from, to]: [DVec2; 2]) -> Vec<DVec2> {
        let way = to - from;
        match self {
            Self::Segment([a, b]) => {
                let edge = b.value() - a.value();
                let t = (a.value() - from).perp_dot(edge) / way.perp_dot(edge);
                if t.is_finite() { vec![from + t * way] } else { vec![] }
            }
            Self::Arc { centre, radius, .. } => {
                let direction = way.normalize();
                let to_centre = centre.value() - from;
                let (along, aside) = (direction.dot(to_centre), direction.perp_dot(to_centre));
                let square = radius * radius - aside * aside;
                if square < 0.0 {
                    return vec![];
                }
                [along - square.sqrt(), along + square.sqrt()].map(|t| from + t * direction).to_vec()
            }
        }
    }

    /// s of the point of the curve's line or circle that is nearest to a point.
    fn nearest(&self, point: DVec2) -> f64 {
        match self {
            Self::Segment([a, b]) => {
                let edge = b.value() - a.value();
                (point - a.value()).dot(edge) / edge.length_squared()
            }
            Self::Arc { centre, .. } => self.parameter(point - centre.value()),
        }
    }

    /// s of a point on an arc's circle, relative to the centre: the one that is nearest to [0, 1].
    fn parameter(&self, from_centre: DVec2) -> f64 {
        let &Self::Arc { start, extent, .. } = self else { return 0.0 };
        // Not glam's angle, which is rounded to 10⁻⁸.
        let angle = Vec2::constant(DVec2::from_angle(start)).angle_to(Vec2::constant(from_centre));
        (angle + turns(angle, extent)) / extent
    }
}

/// The multiple of 2π that brings an angle from an arc's start, in (−π, π], nearest to the arc.
fn turns(angle: f64, extent: f64) -> f64 {
    let outside = |turn: f64| {
        let s = (angle + turn) / extent;
        (s - 1.0).max(-s)
    };
    let other = TAU.copysign(extent);
    if outside(other) < outside(0.0) { other } else { 0.0 }
}

impl<T: Number> Curve<T> {
    /// Intersection of the ray o + tω with the curve; ray and curve may move. With `touches` it is the limit
    /// of a ray tangent to the arc.
    pub(crate) fn contact(
        &self,
        [origin, direction]: [Vec2<T>; 2],
        is_far: bool,
        touches: bool,
    ) -> Contact<T> {
        match *self {
            Self::Segment([a, b]) => {
                let edge = b - a;
                let distance = (a - origin).cross(edge) / direction.cross(edge);
                let point = origin + direction * distance;
                let s = (point - a).dot(edge) / edge.dot(edge);
                Contact { point, s, normal: edge.perp().normalized(), depth: None }
            }
            Self::Arc { centre, radius, start, extent } => {
                let to_centre = centre - origin;
                let (along, aside) = (direction.dot(to_centre), direction.cross(to_centre).abs());
                let depth = radius - aside;
                let half_chord =
                    if touches { T::constant(0.0) } else { (depth * (radius + aside)).positive().sqrt() };
                let distance = if is_far { along + half_chord } else { along - half_chord };
                let point = origin + direction * distance;
                let outwards = point - centre;
                let angle = Vec2::new(start.cos(), start.sin()).angle_to(outwards);
                let turned = angle + T::constant(turns(angle.value(), extent.value()));
                let outwards = outwards.normalized();
                let normal = if extent.value() > 0.0 { -outwards } else { outwards };
                Contact { point, s: turned / extent, normal, depth: Some(depth) }
            }
        }
    }

    /// The curve's length.
    pub(crate) fn length(&self) -> f64 {
        match *self {
            Self::Segment([a, b]) => a.value().distance(b.value()),
            Self::Arc { radius, extent, .. } => (radius.value() * extent.value()).abs(),
        }
    }
}
