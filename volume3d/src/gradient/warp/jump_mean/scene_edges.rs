//! Hierarchy of a scene's edges, with queries for discontinuities near a direction.

use std::sync::{Arc, OnceLock};

use glam::DVec3;

use super::crowding::Crowding;
use super::edge::{Cone, Edge};
use super::extent::Extents;
use super::faces::Faces;
use super::tree::{Layout, Tree};
use crate::gradient::edges::EdgeList;
use crate::scene::{NONE, Scene, Span};

/// Hierarchy of the edges of a scene, and the faces that they bound.
#[derive(Clone, Debug, Default)]
pub(crate) struct SceneEdges {
    tree: Tree,
    faces: Faces,
    /// Sizes of faces, once they are measured.
    extents: OnceLock<Extents>,
    crowding: Crowding,
}

impl SceneEdges {
    /// Edges and crossings of a scene.
    pub(crate) fn new(scene: &Scene) -> Self {
        let list = scene.derived(EdgeList::new);
        let all = Self::assemble(edges(scene, &list, list.first()), Arc::clone(list.first()));
        Self { crowding: Crowding::of(&all.tree, scene.rounding()), ..all }
    }

    /// From edges and the first triangle of each triangle's face.
    pub(super) fn assemble(mut edges: Vec<Edge>, faces: Arc<[u32]>) -> Self {
        let flat: Vec<Edge> = edges.iter().filter(|e| is_flat(e.normals)).copied().collect();
        if !flat.is_empty() {
            edges.retain(|e| !is_flat(e.normals));
        }
        let layout = Layout::new(edges, flat);
        let faces = Faces::new(faces, &layout);
        let tree = layout.finish();
        Self { tree, faces, extents: OnceLock::new(), crowding: Crowding::default() }
    }

    /// Measures faces, which softened fields need.
    pub(crate) fn measure(&self, scene: &Scene) {
        self.extents.get_or_init(|| Extents::new(scene, self.faces.first()));
    }

    /// The reach, in radians, reduced where silhouettes are dense.
    pub(crate) fn reach(&self, angle: f64) -> f64 {
        self.crowding.within(angle)
    }

    /// The triangle whose plane represents a triangle's face.
    pub(crate) fn plane(&self, triangle: u32) -> u32 {
        self.faces.plane(triangle)
    }

    /// Softness, in radians, with which a softened field follows the border of a triangle's face seen from
    /// `origin`, given that of other discontinuities: 0 unless the face is narrow.
    ///
    /// # Panics
    /// If the softness is not 0, and faces are not [measured](Self::measure).
    pub(crate) fn border_softness(&self, triangle: u32, origin: DVec3, softness: f64) -> f64 {
        if softness == 0.0 {
            return 0.0;
        }
        let extents = self.extents.get().expect("faces are measured for softened fields");
        extents.border_softness(self.plane(triangle), origin, softness)
    }

    /// Calls back with every non-silhouette edge of a triangle's face that may be within the cone.
    pub(crate) fn for_each_of_face(&self, triangle: u32, cone: &Cone<'_>, f: impl FnMut(&Edge)) {
        self.faces.for_each(&self.tree, triangle, cone, f);
    }

    /// Calls back with every silhouette of the scene that may be within the cone, in front of all its planes.
    pub(crate) fn for_each(&self, cone: &Cone<'_>, f: impl FnMut(&Edge)) {
        self.tree.visit(cone, true, f);
    }
}

/// Every edge of the list, ordered by its ends, and every crossing; without edges between triangles of one
/// face that are neither discontinuities nor possible silhouettes. `first` has the first triangle of each
/// triangle's face.
pub(super) fn edges(scene: &Scene, list: &EdgeList, first: &[u32]) -> Vec<Edge> {
    let normal = |t: u32| {
        let [a, b, c] = scene.corners(t);
        (b - a).cross(c - a).normalize_or_zero()
    };
    let listed = list.by_ends();
    let mut all = Vec::with_capacity(listed.len() + scene.crossings().all().len());
    let edges = listed.into_iter().map(|edge| {
        let face = |k: usize| list.faces(edge).get(k).map_or(NONE, |face| first[face.triangle as usize]);
        let owners = if list.faces(edge).len() <= 2 { [face(0), face(1)] } else { [NONE; 2] };
        let (normals, seam) = match list.faces(edge) {
            [s, t] if edge.is_continued => ([normal(s.triangle), normal(t.triangle)], !edge.is_discontinuity),
            _ => ([DVec3::ZERO; 2], false),
        };
        // Within a face it can only be a silhouette.
        let is_within = seam && owners[0] == owners[1];
        let faces = if edge.is_continued && !is_within { owners } else { [NONE; 2] };
        Edge { span: edge.span, places: edge.span(scene), normals, faces, owners, seam }
    });
    let edges = edges.filter(|e| e.places[0] != e.places[1] && !(is_flat(e.normals) && e.faces == [NONE; 2]));
    all.extend(edges.chain(crossings(scene)));
    all
}

/// Every crossing.
fn crossings(scene: &Scene) -> impl Iterator<Item = Edge> {
    scene.crossings().all().iter().zip(0..).map(|(crossing, index)| Edge {
        span: Span::Crossing(index),
        places: crossing.places,
        normals: [DVec3::ZERO; 2],
        faces: [NONE; 2],
        owners: [NONE; 2],
        seam: false,
    })
}

/// Whether an edge continues a plane so exactly that it is a silhouette only from within that plane.
fn is_flat([m, n]: [DVec3; 2]) -> bool {
    m == n && m != DVec3::ZERO
}
