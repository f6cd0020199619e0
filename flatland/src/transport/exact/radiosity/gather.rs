//! Light gathered at a point: direct light in closed form, and weights of all nodes' values.

use std::collections::BTreeMap;

use glam::DVec2;

use super::panels::{NODES, Panels, Rule, Side};
use crate::calculus::{Dual, Number, Vec2};
use crate::transport::exact::direct::{Surface, SurfaceMotion, may_scatter, turn};
use crate::transport::exact::visible::{End, Interval};
use crate::transport::{Tangent, World};

/// Ratio of distances over a piece of directions above which it is halved: the parameter of the visible point
/// must be a smooth function of the angle.
const MOST_STRETCH: f64 = 2.5;
/// Largest number of halvings.
const MOST_HALVINGS: usize = 48;

/// Panels of all relevant sides.
pub(super) type Mesh = BTreeMap<Side, Panels>;

/// Weights of nodes' values, by node.
pub(super) type Row = Vec<(usize, Dual<1>)>;

/// A gathering point: its surface and motion.
pub(super) struct Gather<'a> {
    pub(super) world: &'a World,
    pub(super) change: &'a Tangent,
    pub(super) surface: Surface<'a>,
    /// Segment of the surface.
    pub(super) segment: usize,
    pub(super) motion: SurfaceMotion,
    /// ρ.
    pub(super) reflectance: Dual<1>,
}

/// The part of an interval in which one panel is visible.
#[derive(Clone, Copy)]
struct Part {
    /// The segment's first end point and its edge, in the surface's frame.
    start: Vec2<Dual<1>>,
    edge: Vec2<Dual<1>>,
    /// The panel's ends, and the index of its first node's value.
    panel: [f64; 2],
    first: usize,
}

impl Gather<'_> {
    /// The visible sides that scatter light, or do so with θ.
    pub(super) fn sides(&self) -> impl Iterator<Item = Side> + '_ {
        self.surface.intervals().iter().filter_map(|i| self.side(i))
    }

    /// Emission and direct light.
    pub(super) fn direct(&self) -> Dual<1> {
        let rate = self.surface.rate(self.change, &self.motion);
        Dual::new(self.surface.radiance(), [rate.interior + rate.boundary])
    }

    /// ρ/2 ∫ ℓ_k cos φ dφ of every node's Lagrange polynomial ℓ_k.
    pub(super) fn row(&self, mesh: &Mesh, rule: &Rule) -> Row {
        let mut row = vec![];
        for interval in self.surface.intervals() {
            if let Some((side, panels)) = self.side(interval).and_then(|s| Some((s, mesh.get(&s)?))) {
                self.interval(interval, side.0, panels, rule, &mut row);
            }
        }
        row
    }

    fn side(&self, interval: &Interval) -> Option<Side> {
        let segment = interval.seen?;
        let seen = &self.world.segments()[segment];
        let own = &self.world.segments()[self.segment];
        let shared = own.vertices.iter().position(|v| seen.vertices.contains(v));
        // All of a segment is on one side of its neighbour, but from the common corner, or near it, rounding
        // makes the point itself inconclusive.
        let point = shared.map_or(self.surface.view().point(), |k| own.ends()[1 - k]);
        let side = seen.edge.perp_dot(point - seen.start) > 0.0;
        may_scatter(self.world, self.change, segment).then_some((segment, side))
    }

    fn interval(&self, interval: &Interval, segment: usize, panels: &Panels, rule: &Rule, row: &mut Row) {
        let ends = [&interval.start, &interval.end].map(|end| self.angle_of(end));
        let corners = self.world.segments()[segment].ends();
        if let Some(k) = corners.iter().position(|corner| *corner == self.surface.view().point()) {
            return self.corner(k, panels, ends, rule, row);
        }
        let part = self.part(segment);
        let [low, high] = [&interval.start, &interval.end].map(|end| self.parameter(end, segment, &part));
        let rising = low < high;
        let (least, most) = if rising { (low, high) } else { (high, low) };
        for (k, pair) in panels.breaks.windows(2).enumerate() {
            if pair[1] <= least || pair[0] >= most {
                continue;
            }
            let inside =
                |s: f64, end: Dual<1>| if s > least && s < most { self.angle_at(segment, s) } else { end };
            let order = if rising { [pair[0], pair[1]] } else { [pair[1], pair[0]] };
            let angles = [inside(order[0], ends[0]), inside(order[1], ends[1])];
            let part = Part { panel: [pair[0], pair[1]], first: panels.first + k * NODES, ..part };
            let base = row.len();
            let zero = Dual::constant(0.0);
            row.extend((0..NODES).map(|n| (part.first + n, zero)));
            self.panel(&part, angles, rule, &mut row[base..], 0);
        }
    }

    /// Weights at a corner, as the limit of a point that approaches it: in all directions of the neighbouring
    /// segment, only its end at that corner is visible.
    fn corner(&self, end: usize, panels: &Panels, [a, b]: [Dual<1>; 2], rule: &Rule, row: &mut Row) {
        let last = panels.breaks.len() - 2;
        let first = panels.first + NODES * [0, last][end];
        let factor = self.reflectance * (b.sin() - a.sin()) * 0.5;
        let basis = rule.basis(end as f64);
        row.extend(basis.iter().enumerate().map(|(n, (value, _))| (first + n, factor * *value)));
    }

    /// Adds the weights of a panel between two angles.
    fn panel(
        &self,
        part: &Part,
        [a, b]: [Dual<1>; 2],
        rule: &Rule,
        row: &mut [(usize, Dual<1>)],
        halvings: usize,
    ) {
        if a.value >= b.value {
            return;
        }
        let [near, far] = [a, b].map(|angle| part.distance(angle.value));
        let stretched = near.max(far) > MOST_STRETCH * near.min(far) || b.value - a.value > 1.0;
        if stretched && halvings < MOST_HALVINGS {
            let middle = (a + b) * 0.5;
            self.panel(part, [a, middle], rule, row, halvings + 1);
            self.panel(part, [middle, b], rule, row, halvings + 1);
            return;
        }
        let length = part.panel[1] - part.panel[0];
        for &(t, weight) in &rule.points {
            let angle = a + (b - a) * t;
            let cos = angle.cos();
            let s = part.parameter(Vec2::new(cos, angle.sin()));
            let local = (s.value - part.panel[0]) / length;
            let factor = self.reflectance * cos * (b - a) * (0.5 * weight);
            for (entry, (value, slope)) in row.iter_mut().zip(rule.basis(local)) {
                entry.1 = entry.1 + factor * Dual::new(value, [slope * s.slope() / length]);
            }
        }
    }

    fn part(&self, segment: usize) -> Part {
        let seen = &self.world.segments()[segment];
        let [a, b] = seen.vertices.map(|v| self.change.vertices[v]);
        let start = self.in_frame(seen.start - self.surface.view().point(), a - self.motion.velocity);
        Part { start, edge: self.in_frame(seen.edge, b - a), panel: [0.0, 1.0], first: 0 }
    }

    /// A vector in the moving frame of normal and tangent.
    fn in_frame(&self, value: DVec2, slope: DVec2) -> Vec2<Dual<1>> {
        let view = self.surface.view();
        let rotate = |v: DVec2| DVec2::new(view.axis().dot(v), view.tangent().dot(v));
        let local = rotate(value);
        let [x, y] = Dual::path(local, rotate(slope) - self.motion.normal_turn * local.perp());
        Vec2::new(x, y)
    }

    fn angle_of(&self, end: &End) -> Dual<1> {
        if end.vertex.is_none() || end.cos == 0.0 {
            return Dual::constant(end.angle);
        }
        let turned = turn(self.surface.view(), end, self.change, self.motion.velocity);
        Dual::new(end.angle, [turned - self.motion.normal_turn])
    }

    /// Angle in which the point of a segment at s is seen.
    fn angle_at(&self, segment: usize, s: f64) -> Dual<1> {
        let seen = &self.world.segments()[segment];
        let to = seen.at(s) - self.surface.view().point();
        let velocity = seen.material_point(s).velocity(&self.change.vertices) - self.motion.velocity;
        let slope = to.perp_dot(velocity) / to.length_squared() - self.motion.normal_turn;
        Dual::new(self.surface.view().angle(to), [slope])
    }

    /// Parameter of the point seen at an end of an interval.
    fn parameter(&self, end: &End, segment: usize, part: &Part) -> f64 {
        let vertices = self.world.segments()[segment].vertices;
        if let Some(k) = vertices.iter().position(|v| end.vertex == Some(*v)) {
            return k as f64;
        }
        let direction = Vec2::constant(DVec2::new(end.cos, end.sin));
        part.parameter(direction).value.clamp(0.0, 1.0)
    }
}

impl Part {
    /// s with direction × (start + s edge) = 0.
    fn parameter(&self, direction: Vec2<Dual<1>>) -> Dual<1> {
        -(direction.cross(self.start) / direction.cross(self.edge))
    }

    /// Distance of the segment's line.
    fn distance(&self, angle: f64) -> f64 {
        let (sin, cos) = angle.sin_cos();
        let height = self.start.x.value * self.edge.y.value - self.start.y.value * self.edge.x.value;
        (height / (cos * self.edge.y.value - sin * self.edge.x.value)).abs()
    }
}
