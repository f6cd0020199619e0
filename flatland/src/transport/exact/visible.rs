//! Visibility from a point: the exact partition of a half circle of directions.
//!
//! A rotational sweep over the end points of all segments, with the segments that cross the current direction
//! in a list. Between two consecutive end points the nearest segment does not change, as segments do not
//! cross.

use std::f64::consts::FRAC_PI_2;

use glam::DVec2;

use crate::transport::{Segment, World};

/// Distance that represents zero in the limit of a point that approaches the end of its segment.
const LIMIT: f64 = 1e-200;

/// A point and the half circle of directions around a unit vector, in which directions are the angles
/// φ ∈ [−π/2, π/2] from that vector, positive from +x towards +y.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct View {
    point: DVec2,
    axis: DVec2,
    own: Option<Own>,
}

/// The segment a view's point lies on.
#[derive(Clone, Copy, Debug, PartialEq)]
struct Own {
    segment: usize,
    vertices: [usize; 2],
    ends: [DVec2; 2],
    /// Offsets from the point to the ends along the tangent: relatively accurate also near the ends.
    tangent: [f64; 2],
}

/// An end of an interval of directions.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct End {
    /// φ.
    pub angle: f64,
    /// cos φ, to full relative accuracy.
    pub cos: f64,
    /// sin φ.
    pub sin: f64,
    /// Distance of the vertex; infinite if there is none.
    pub distance: f64,
    /// The vertex that moves this end; `None` at the ends of the half circle.
    pub vertex: Option<usize>,
    /// The nearer one of the two segments that meet in this direction.
    pub nearer: Option<usize>,
}

/// Directions in which one segment, or the environment, is visible.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Interval {
    /// Its start.
    pub start: End,
    /// Its end, at no smaller angle.
    pub end: End,
    /// Its width in radians, relatively accurate if it spans a whole segment.
    pub width: f64,
    /// The visible segment; `None` is the environment.
    pub seen: Option<usize>,
}

impl View {
    /// From the point of a segment at the parameter s, on the side of the normal (`side` > 0) or on the
    /// other. At the ends of the segment it is the limit from inside.
    ///
    /// # Panics
    /// If the world has no such segment.
    #[must_use]
    pub fn of_segment(world: &World, segment: usize, s: f64, side: f64) -> Self {
        let own = &world.segments()[segment];
        let sign = 1.0_f64.copysign(side);
        let length = own.edge.length();
        // The tangent is the axis rotated by a right angle: opposite to the edge on the normal's side.
        let tangent = [sign * (s * length).max(LIMIT), -sign * ((1.0 - s) * length).max(LIMIT)];
        let own_of = Own { segment, vertices: own.vertices, ends: own.ends(), tangent };
        Self { point: own.at(s), axis: sign * own.normal(), own: Some(own_of) }
    }

    /// From a point that is not on a segment, around a unit vector.
    #[must_use]
    pub fn free(point: DVec2, axis: DVec2) -> Self {
        Self { point, axis, own: None }
    }

    /// The point.
    #[must_use]
    pub fn point(&self) -> DVec2 {
        self.point
    }

    /// The unit vector in the middle of the half circle.
    #[must_use]
    pub fn axis(&self) -> DVec2 {
        self.axis
    }

    /// The unit vector at φ = π/2.
    #[must_use]
    pub fn tangent(&self) -> DVec2 {
        self.axis.perp()
    }

    /// The direction of an end.
    #[must_use]
    pub fn direction(&self, end: &End) -> DVec2 {
        end.cos * self.axis + end.sin * self.tangent()
    }

    /// The angle φ of a direction, in (−π, π].
    #[must_use]
    pub fn angle(&self, direction: DVec2) -> f64 {
        self.tangent().dot(direction).atan2(self.axis.dot(direction))
    }

    /// Position of a vertex in the view, possibly below the horizon.
    fn place(&self, vertex: usize, at: DVec2) -> Place {
        let local = self.local(vertex, at);
        let end = if local.x == 0.0 {
            End::horizon(local.y)
        } else {
            let distance = local.length();
            let [cos, sin] = (local / distance).to_array();
            End { angle: local.y.atan2(local.x), cos, sin, distance, vertex: None, nearer: None }
        };
        Place { local, end: End { vertex: Some(vertex), ..end } }
    }

    /// From the point to a vertex, along the axis and the tangent.
    fn local(&self, vertex: usize, at: DVec2) -> DVec2 {
        let difference = at - self.point;
        let Some(own) = &self.own else {
            return DVec2::new(self.axis.dot(difference), self.tangent().dot(difference));
        };
        if let Some(k) = own.vertices.iter().position(|&v| v == vertex) {
            // The sign is kept if the point is the vertex: the limit from inside.
            return DVec2::new(0.0, own.tangent[k]);
        }
        // The height over the segment's line is the same from everywhere on it.
        let [a, b] = own.ends.map(|end| at - end);
        let near = if a.length_squared() < b.length_squared() { a } else { b };
        DVec2::new(self.axis.dot(near), self.tangent().dot(difference))
    }

    fn local_edge(&self, segment: &Segment) -> DVec2 {
        DVec2::new(self.axis.dot(segment.edge), self.tangent().dot(segment.edge))
    }

    /// Visible intervals, ordered by angle, from −π/2 to π/2 without a gap.
    #[must_use]
    pub fn intervals(&self, world: &World) -> Vec<Interval> {
        let places: Vec<Place> = world.vertices().enumerate().map(|(v, at)| self.place(v, at)).collect();
        let own = self.own.map(|own| own.segment);
        let mut arcs = Vec::with_capacity(world.segments().len());
        let mut events = Vec::with_capacity(2 * world.segments().len());
        for (i, segment) in world.segments().iter().enumerate() {
            if own == Some(i) {
                continue;
            }
            if let Some(arc) = Arc::of(i, segment, self, &places) {
                events.push(Event { angle: arc.ends[0].angle, arc: arcs.len(), starts: true });
                events.push(Event { angle: arc.ends[1].angle, arc: arcs.len(), starts: false });
                arcs.push(arc);
            }
        }
        events.sort_unstable_by(|a, b| a.angle.total_cmp(&b.angle).then(a.arc.cmp(&b.arc)));
        Sweep { arcs: &arcs, active: vec![], intervals: vec![] }.run(&events, world, self, &places)
    }
}

/// A vertex in the coordinates of a view.
#[derive(Clone, Copy, Debug)]
struct Place {
    local: DVec2,
    end: End,
}

/// The part of a segment above the horizon.
#[derive(Clone, Copy, Debug)]
struct Arc {
    segment: usize,
    ends: [End; 2],
    /// The nearer end point and the edge, along the axis and the tangent.
    start: DVec2,
    edge: DVec2,
}

#[derive(Clone, Copy, Debug)]
struct Event {
    angle: f64,
    arc: usize,
    starts: bool,
}

impl Arc {
    fn of(index: usize, segment: &Segment, view: &View, places: &[Place]) -> Option<Self> {
        let [a, b] = segment.vertices.map(|v| places[v]);
        if a.local.x.max(b.local.x) <= 0.0 {
            return None;
        }
        let edge = view.local_edge(segment);
        // From the nearer end, whose digits matter: the digits of the farther one may be lost near a corner.
        let start = if a.end.distance <= b.end.distance { a.local } else { b.local };
        let turn = start.perp_dot(edge);
        if turn == 0.0 {
            return None;
        }
        let clipped = |p: &Place, q: &Place| if p.local.x < 0.0 { horizon_crossing(p, q) } else { p.end };
        let mut ends = [clipped(&a, &b), clipped(&b, &a)].map(|e| End { nearer: Some(index), ..e });
        if turn < 0.0 {
            ends.swap(0, 1);
        }
        (ends[0].angle < ends[1].angle).then_some(Self { segment: index, ends, start, edge })
    }

    /// Distance along a direction to the segment's line.
    fn distance(&self, towards: DVec2) -> f64 {
        let t = self.start.perp_dot(self.edge) / towards.perp_dot(self.edge);
        // Edge-on up to rounding: as far as its nearer end.
        if t > 0.0 { t } else { self.ends[0].distance.min(self.ends[1].distance) }
    }
}

/// Crossing of the segment from p, below the horizon, to q with the horizon.
fn horizon_crossing(p: &Place, q: &Place) -> End {
    let part = p.local.x / (p.local.x - q.local.x);
    End::horizon(p.local.y + part * (q.local.y - p.local.y))
}

impl End {
    /// On the horizon, at the signed distance `t` along the tangent.
    fn horizon(t: f64) -> Self {
        let sin = 1.0_f64.copysign(t);
        Self { angle: sin * FRAC_PI_2, cos: 0.0, sin, distance: t.abs(), vertex: None, nearer: None }
    }
}

/// State of the sweep.
struct Sweep<'a> {
    arcs: &'a [Arc],
    active: Vec<usize>,
    intervals: Vec<Interval>,
}

impl Sweep<'_> {
    fn run(mut self, events: &[Event], world: &World, view: &View, places: &[Place]) -> Vec<Interval> {
        let (first, last) = (End::horizon(f64::NEG_INFINITY), End::horizon(f64::INFINITY));
        let mut from = first;
        let mut before: &[Event] = &[];
        for group in events.chunk_by(|a, b| a.angle == b.angle) {
            let to = self.end(&group[0]);
            self.step(&from, &to, before);
            self.update(group);
            (from, before) = (to, group);
        }
        self.step(&from, &last, before);
        if let Some(interval) = self.intervals.last_mut() {
            interval.end = last;
        }
        for interval in &mut self.intervals {
            interval.width = width(interval, world, view, places);
        }
        self.intervals
    }

    fn end(&self, event: &Event) -> End {
        self.arcs[event.arc].ends[usize::from(!event.starts)]
    }

    fn update(&mut self, group: &[Event]) {
        for event in group {
            if event.starts {
                self.active.push(event.arc);
            } else {
                self.active.retain(|&arc| arc != event.arc);
            }
        }
    }

    /// Adds the directions between two consecutive groups of events.
    fn step(&mut self, from: &End, to: &End, before: &[Event]) {
        if from.angle >= to.angle {
            return;
        }
        let middle = DVec2::new(from.cos + to.cos, from.sin + to.sin);
        // Both ends of the half circle sum to zero.
        let middle = if middle.x > 0.0 { middle } else { DVec2::X };
        let near = |&a: &usize, &b: &usize| {
            let [a, b] = [a, b].map(|i| self.arcs[i].distance(middle));
            a.total_cmp(&b)
        };
        let seen = self.active.iter().copied().min_by(near).map(|arc| self.arcs[arc].segment);
        match self.intervals.last_mut() {
            Some(last) if last.seen == seen => last.end = *to,
            Some(last) => {
                let start = between(self.arcs, before, last.seen, seen).unwrap_or(*from);
                last.end = start;
                self.intervals.push(Interval { start, end: *to, width: 0.0, seen });
            }
            None => {
                let start = End::horizon(f64::NEG_INFINITY);
                self.intervals.push(Interval { start, end: *to, width: 0.0, seen });
            }
        }
    }
}

/// Among the segment ends in one direction, the one between the two segments visible on both sides of it: the
/// nearer one, if one of them ends and the other starts there.
fn between(arcs: &[Arc], group: &[Event], low: Option<usize>, high: Option<usize>) -> Option<End> {
    let concerns = |event: &&Event| {
        let segment = Some(arcs[event.arc].segment);
        if event.starts { segment == high } else { segment == low }
    };
    let end = |event: &Event| arcs[event.arc].ends[usize::from(!event.starts)];
    let nearest = |events: &mut dyn Iterator<Item = &Event>| {
        events.map(end).min_by(|a, b| a.distance.total_cmp(&b.distance))
    };
    nearest(&mut group.iter().filter(concerns)).or_else(|| nearest(&mut group.iter()))
}

/// The width of an interval.
fn width(interval: &Interval, world: &World, view: &View, places: &[Place]) -> f64 {
    let Interval { start, end, seen, .. } = interval;
    if let Some(segment) = seen.map(|i| &world.segments()[i]) {
        let [a, b] = segment.vertices;
        if [(start.vertex, end.vertex), (end.vertex, start.vertex)].contains(&(Some(a), Some(b))) {
            // From the edge itself: for a short segment, the difference of both directions has lost its
            // digits.
            let edge = view.local_edge(segment);
            let near = if places[a].end.distance <= places[b].end.distance { a } else { b };
            return places[near].local.perp_dot(edge).abs().atan2(places[a].local.dot(places[b].local));
        }
    }
    let cross = start.cos * end.sin - start.sin * end.cos;
    // −0 would reverse the half circle.
    cross.abs().atan2(start.cos * end.cos + start.sin * end.sin)
}
