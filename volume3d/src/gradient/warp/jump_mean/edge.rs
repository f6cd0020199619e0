//! An edge of a scene, and the test whether it is a silhouette within a cone of directions.

use glam::DVec3;

use super::arc::AngularSupport;
use crate::scene::{NONE, Span};

/// An edge with the data that decide whether it is a silhouette.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Edge {
    pub(crate) span: Span,
    pub(crate) places: [DVec3; 2],
    /// Normals of the two triangles that continue one another across it; zero if it is a discontinuity from
    /// every viewpoint: the border of a surface, an edge of three triangles, or a crossing.
    pub(super) normals: [DVec3; 2],
    /// Faces of these two triangles. They are forgotten in a hierarchy: the table of faces has their
    /// borders.
    pub(super) faces: [u32; 2],
    /// Faces that end at the edge, at most two; a softened field follows the edge exactly where one of them
    /// is visible.
    pub(super) owners: [u32; 2],
    /// Whether it is a discontinuity only as a silhouette.
    pub(super) seam: bool,
}

impl Edge {
    /// Whether the viewer sees one of the edge's triangles from the front and one from the back, or a border.
    pub(super) fn is_silhouette(&self, cone: &Cone<'_>) -> bool {
        let way = self.places[0] - cone.origin;
        let [a, b] = self.normals.map(|n| n.dot(way));
        // Seen from within one of the planes it is one, up to rounding.
        a * b <= 0.0 || a.abs().min(b.abs()) <= cone.rounding
    }
}

/// An edge without what the leaf of a hierarchy holds of it, its places and normals.
#[derive(Clone, Copy, Debug)]
pub(super) struct Rest {
    pub(super) span: Span,
    pub(super) owners: [u32; 2],
    pub(super) seam: bool,
}

impl Rest {
    /// No edge.
    pub(super) const NONE: Self = Self { span: Span::Edge([NONE; 2]), owners: [NONE; 2], seam: false };

    pub(super) fn of(edge: &Edge) -> Self {
        let Edge { span, owners, seam, .. } = *edge;
        Self { span, owners, seam }
    }

    /// The edge.
    #[inline(always)]
    pub(super) fn with(self, places: [DVec3; 2], normals: [DVec3; 2]) -> Edge {
        let Self { span, owners, seam } = self;
        Edge { span, places, normals, faces: [NONE; 2], owners, seam }
    }
}

/// A query: a cone of directions from a point, and planes in front of which edges must lie.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Cone<'p> {
    pub(crate) origin: DVec3,
    pub(crate) axis: DVec3,
    pub(crate) reach: AngularSupport,
    pub(crate) planes: &'p [HalfSpace],
    /// Distance to a plane within which a viewer counts as in it.
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

/// The pole of an edge's great circle as seen from a point; NaN if the edge is seen end-on.
#[derive(Clone, Copy, Debug)]
pub(super) struct Pole(pub(super) DVec3);

impl Pole {
    pub(super) fn new(places: [DVec3; 2], origin: DVec3) -> Self {
        let pole = (places[0] - origin).cross(places[1] - places[0]);
        Self(pole / pole.length())
    }
}
