//! Flat worlds: reflecting and emitting polylines and polygons, with ray queries.

mod error;

use glam::DVec2;

use super::Material;
use crate::plane::{Aabb, BoxTree, MaterialPoint, Meeting};

pub use error::WorldError;

/// A polyline, open or closed, of one material.
#[derive(Clone, Debug, PartialEq)]
pub struct Shape {
    points: Vec<DVec2>,
    closed: bool,
    material: Material,
}

impl Shape {
    /// Segments from each point to the next.
    #[must_use]
    pub fn open(points: impl IntoIterator<Item = DVec2>, material: Material) -> Self {
        Self { points: points.into_iter().collect(), closed: false, material }
    }

    /// A polygon: segments from each point to the next, and from the last to the first.
    #[must_use]
    pub fn closed(points: impl IntoIterator<Item = DVec2>, material: Material) -> Self {
        Self { points: points.into_iter().collect(), closed: true, material }
    }

    /// The points in order.
    #[must_use]
    pub fn points(&self) -> &[DVec2] {
        &self.points
    }

    /// Whether a segment joins the last point to the first.
    #[must_use]
    pub fn is_closed(&self) -> bool {
        self.closed
    }

    /// The material.
    #[must_use]
    pub fn material(&self) -> &Material {
        &self.material
    }

    /// Number of segments.
    fn segments(&self) -> usize {
        self.points.len() - usize::from(!self.closed)
    }
}

/// A segment of a shape.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Segment {
    /// Index of its shape.
    pub shape: usize,
    /// Indices of its end points in the whole world.
    pub vertices: [usize; 2],
    /// The first end point.
    pub start: DVec2,
    /// The second end point.
    pub end: DVec2,
    /// Vector from the first end point to the second, rounded.
    pub edge: DVec2,
}

impl Segment {
    /// The point at the parameter s ∈ [0, 1].
    #[must_use]
    pub fn at(&self, s: f64) -> DVec2 {
        // From the nearer end, so that both ends are exact.
        if s <= 0.5 { self.start + s * self.edge } else { self.end - (1.0 - s) * self.edge }
    }

    /// The end points.
    #[must_use]
    pub fn ends(&self) -> [DVec2; 2] {
        [self.start, self.end]
    }

    /// The unit normal: the edge's direction rotated from +x towards +y by a right angle.
    #[must_use]
    pub fn normal(&self) -> DVec2 {
        self.edge.normalize().perp()
    }

    /// The material point at the parameter s.
    #[must_use]
    pub fn material_point(&self, s: f64) -> MaterialPoint {
        MaterialPoint::on_edge(self.vertices, s)
    }

    /// Covectors of both end points' velocities in the segment's rotation rate, in radians: (e × ė)/|e|².
    #[must_use]
    pub(crate) fn turning_rate(&self) -> [DVec2; 2] {
        let covector = self.edge.perp() / self.edge.length_squared();
        [-covector, covector]
    }
}

/// Start of a ray: a free point, or a point of a segment, which the ray then cannot hit.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Origin {
    /// The point.
    pub point: DVec2,
    /// The segment that contains it, if any.
    pub segment: Option<usize>,
}

impl Origin {
    /// A point that is not on a segment.
    #[must_use]
    pub fn free(point: DVec2) -> Self {
        Self { point, segment: None }
    }
}

/// Intersection of a ray with the world.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Hit {
    /// The segment.
    pub segment: usize,
    /// The parameter of the point on it, in [0, 1].
    pub s: f64,
    /// The distance along the unit direction.
    pub distance: f64,
}

/// Disjoint shapes in an environment of constant radiance.
#[derive(Clone, Debug)]
pub struct World {
    environment: f64,
    shapes: Vec<Shape>,
    /// First vertex of each shape, followed by the number of vertices.
    first_vertex: Vec<usize>,
    /// First segment of each shape, followed by the number of segments.
    first_segment: Vec<usize>,
    segments: Vec<Segment>,
    tree: BoxTree,
    emitters: Vec<usize>,
}

impl World {
    /// Builds a world from its shapes.
    ///
    /// # Errors
    /// A [`WorldError`] that names the shape.
    pub fn new(environment: f64, shapes: Vec<Shape>) -> Result<Self, WorldError> {
        if !(environment >= 0.0 && environment.is_finite()) {
            return Err(WorldError::Environment { environment });
        }
        let (mut first_vertex, mut first_segment) = (vec![0], vec![0]);
        let mut segments = vec![];
        for (shape, content) in shapes.iter().enumerate() {
            check_shape(shape, content)?;
            let first = *first_vertex.last().unwrap_or(&0);
            let count = content.points.len();
            first_vertex.push(first + count);
            for i in 0..content.segments() {
                let j = (i + 1) % count;
                let (start, end) = (content.points[i], content.points[j]);
                if start == end {
                    return Err(WorldError::NoLength { shape, segment: i });
                }
                let vertices = [first + i, first + j];
                segments.push(Segment { shape, vertices, start, end, edge: end - start });
            }
            first_segment.push(segments.len());
        }
        let boxes: Vec<Aabb> = segments.iter().map(|s| Aabb::of(s.ends())).collect();
        let tree = BoxTree::build(&boxes);
        let emits = |s: &Segment| shapes[s.shape].material.emission > 0.0;
        let emitters = (0..segments.len()).filter(|&i| emits(&segments[i])).collect();
        let this = Self { environment, shapes, first_vertex, first_segment, segments, tree, emitters };
        this.check_disjoint(&boxes)?;
        Ok(this)
    }

    /// The environment's radiance.
    #[must_use]
    pub fn environment(&self) -> f64 {
        self.environment
    }

    /// The shapes.
    #[must_use]
    pub fn shapes(&self) -> &[Shape] {
        &self.shapes
    }

    /// All segments, shape by shape.
    #[must_use]
    pub fn segments(&self) -> &[Segment] {
        &self.segments
    }

    /// The segments that emit.
    #[must_use]
    pub fn emitters(&self) -> &[usize] {
        &self.emitters
    }

    /// The number of vertices.
    #[must_use]
    pub fn vertex_count(&self) -> usize {
        self.first_vertex[self.shapes.len()]
    }

    /// All vertices, shape by shape.
    pub fn vertices(&self) -> impl Iterator<Item = DVec2> + '_ {
        self.shapes.iter().flat_map(|s| s.points.iter().copied())
    }

    /// Vertices of a shape, by index in the whole world.
    ///
    /// # Panics
    /// If the world has no such shape.
    #[must_use]
    pub fn vertices_of(&self, shape: usize) -> std::ops::Range<usize> {
        self.first_vertex[shape]..self.first_vertex[shape + 1]
    }

    /// Position of a vertex.
    ///
    /// # Panics
    /// If the world has no such vertex.
    #[must_use]
    pub fn vertex(&self, vertex: usize) -> DVec2 {
        let shape = self.first_vertex.partition_point(|&first| first <= vertex) - 1;
        self.shapes[shape].points[vertex - self.first_vertex[shape]]
    }

    /// The one or two segments that end at a vertex.
    ///
    /// # Panics
    /// If the world has no such vertex.
    pub(crate) fn segments_at(&self, vertex: usize) -> impl Iterator<Item = usize> + '_ {
        let shape = self.first_vertex.partition_point(|&first| first <= vertex) - 1;
        let own = self.first_segment[shape]..self.first_segment[shape + 1];
        let count = own.len();
        let place = vertex - self.first_vertex[shape];
        let before = if place == 0 { self.shapes[shape].closed.then(|| count - 1) } else { Some(place - 1) };
        let after = (place < count).then_some(place);
        before.into_iter().chain(after).map(move |i| own.start + i)
    }

    /// The material of a segment.
    ///
    /// # Panics
    /// If the world has no such segment.
    #[must_use]
    pub fn material(&self, segment: usize) -> &Material {
        &self.shapes[self.segments[segment].shape].material
    }

    /// The nearest hit along a unit direction.
    ///
    /// Watertight: whether a segment is to the left or the right of the ray is decided per end point, equally
    /// for both segments that share it.
    #[must_use]
    pub fn trace(&self, origin: Origin, direction: DVec2) -> Option<Hit> {
        self.trace_unless(origin, direction, |_| false)
    }

    /// The nearest hit along a unit direction on segments that do not end at a vertex.
    pub(crate) fn trace_past(&self, origin: Origin, direction: DVec2, vertex: usize) -> Option<Hit> {
        self.trace_unless(origin, direction, |i| self.segments[i].vertices.contains(&vertex))
    }

    fn trace_unless(&self, origin: Origin, direction: DVec2, skipped: impl Fn(usize) -> bool) -> Option<Hit> {
        let mut best: Option<Hit> = None;
        self.tree.along(origin.point, direction, f64::INFINITY, |i, limit| {
            if origin.segment == Some(i) || skipped(i) {
                return limit;
            }
            match meet(&self.segments[i], origin.point, direction) {
                Some((s, distance)) if distance < limit => {
                    best = Some(Hit { segment: i, s, distance });
                    distance
                }
                _ => limit,
            }
        });
        best
    }

    /// The point of a hit.
    ///
    /// # Panics
    /// If the world has no such segment.
    #[must_use]
    pub fn point(&self, hit: &Hit) -> DVec2 {
        self.segments[hit.segment].at(hit.s)
    }

    /// The point of a hit as the start of another ray.
    ///
    /// # Panics
    /// If the world has no such segment.
    #[must_use]
    pub fn origin(&self, hit: &Hit) -> Origin {
        Origin { point: self.point(hit), segment: Some(hit.segment) }
    }

    fn check_disjoint(&self, boxes: &[Aabb]) -> Result<(), WorldError> {
        let place = |i: usize| {
            let shape = self.segments[i].shape;
            [shape, i - self.first_segment[shape]]
        };
        for (i, first) in self.segments.iter().enumerate() {
            let mut meets = None;
            self.tree.visit(
                |b| b.overlaps(&boxes[i]),
                |j| {
                    if j > i && meets.is_none_or(|k| j < k) && do_meet(first, &self.segments[j]) {
                        meets = Some(j);
                    }
                },
            );
            if let Some(j) = meets {
                return Err(WorldError::Meet { first: place(i), second: place(j) });
            }
        }
        Ok(())
    }
}

fn check_shape(shape: usize, content: &Shape) -> Result<(), WorldError> {
    let found = content.points.len();
    if found < 2 + usize::from(content.closed) {
        return Err(WorldError::TooFewPoints { shape, found });
    }
    if let Some(point) = content.points.iter().position(|p| !p.is_finite()) {
        return Err(WorldError::NotFinite { shape, point });
    }
    content.material.check().map_err(|what| WorldError::Material { shape, what })
}

/// Whether two segments share more than a common vertex.
fn do_meet(first: &Segment, second: &Segment) -> bool {
    let (a, b) = (first.ends(), second.ends());
    if !Meeting::of(a, b).is_none() {
        return true;
    }
    // Coincident end points of different vertices; and consecutive segments that fold back completely.
    let coincide = |i: usize, j: usize| a[i] == b[j] && first.vertices[i] != second.vertices[j];
    let pairs = [(0, 0), (0, 1), (1, 0), (1, 1)];
    let shared = pairs.into_iter().filter(|&(i, j)| a[i] == b[j]).count();
    shared > 1 || pairs.into_iter().any(|(i, j)| coincide(i, j))
}

/// Parameter and distance at which a ray meets a segment.
fn meet(segment: &Segment, origin: DVec2, direction: DVec2) -> Option<(f64, f64)> {
    let [a, b] = segment.ends().map(|p| p - origin);
    let (left, right) = (direction.perp_dot(a), direction.perp_dot(b));
    if (left < 0.0) == (right < 0.0) {
        return None;
    }
    let s = left / (left - right);
    // Height of the origin over the segment's line, divided by the sine between line and ray.
    let distance = a.perp_dot(segment.edge) / direction.perp_dot(segment.edge);
    (distance > 0.0).then_some((s, distance))
}
