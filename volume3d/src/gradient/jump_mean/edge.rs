//! An edge of a scene, and the query whether it is a silhouette within a cone of directions.

use glam::DVec3;

use super::arc::AngularSupport;
use crate::scene::Span;

/// An edge with what decides whether it is a silhouette.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Edge {
    pub(crate) span: Span,
    pub(crate) places: [DVec3; 2],
    /// The normals of the two triangles that continue one another across it; zero where it is seen from everywhere, as
    /// the border of a surface, the meeting of three triangles or a crossing is.
    pub(super) normals: [DVec3; 2],
    /// The faces of these two triangles.
    pub(super) faces: [u32; 2],
    /// The faces that end there, if they are one or two: what a softened field follows exactly where one of them is seen.
    pub(super) owners: [u32; 2],
    /// Whether it is no jump of what is seen unless it is a silhouette.
    pub(super) seam: bool,
}

impl Edge {
    /// Whether a viewer sees one of the edge's triangles from the front and one from the back, or a border.
    pub(super) fn is_silhouette(&self, cone: &Cone<'_>) -> bool {
        let way = self.places[0] - cone.origin;
        let [a, b] = self.normals.map(|n| n.dot(way));
        // From within one of the planes it is one, but for rounding.
        a * b <= 0.0 || a.abs().min(b.abs()) <= cone.rounding
    }
}

/// What a query is about: a direction from a point, and planes before which edges must be.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Cone<'p> {
    pub(crate) origin: DVec3,
    pub(crate) axis: DVec3,
    pub(crate) reach: AngularSupport,
    pub(crate) planes: &'p [HalfSpace],
    /// A viewer this near to a plane is within it.
    pub(crate) rounding: f64,
}

/// {y: n·(y − p) ≥ −slack}, |n| = 1.
#[derive(Clone, Copy, Debug)]
pub(crate) struct HalfSpace {
    pub(crate) normal: DVec3,
    pub(crate) point: DVec3,
    pub(crate) slack: f64,
}

impl HalfSpace {
    pub(crate) fn height(&self, y: DVec3) -> f64 {
        self.normal.dot(y - self.point) + self.slack
    }
}

/// The pole of the great circle of an edge as seen from a point: NaN if it is seen end-on.
#[derive(Clone, Copy, Debug)]
pub(super) struct Pole(pub(super) DVec3);

impl Pole {
    pub(super) fn new(places: [DVec3; 2], origin: DVec3) -> Self {
        let pole = (places[0] - origin).cross(places[1] - places[0]);
        Self(pole / pole.length())
    }
}
