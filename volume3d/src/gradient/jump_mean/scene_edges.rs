//! All edges of a scene, with queries for discontinuities near a direction.

use std::sync::{Arc, OnceLock};

use glam::DVec3;

use super::crowding::Crowding;
use super::edge::{Cone, Edge};
use super::extent::Extents;
use super::faces::Faces;
use super::tree::{Layout, Tree};
use crate::geometry::Edges;
use crate::scene::{NONE, Scene, Span};

/// Edges of a scene and the faces that they bound.
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
        let faces = Faces::grown(scene);
        let all = Self::assemble(edges(scene, &faces), faces);
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

/// Every edge once, ordered by its ends, and every crossing; without edges between triangles of one face that
/// are neither discontinuities nor possible silhouettes.
pub(super) fn edges(scene: &Scene, first: &[u32]) -> Vec<Edge> {
    let normal = |t: u32| {
        let [a, b, c] = scene.corners(t);
        (b - a).cross(c - a).normalize_or_zero()
    };
    let edges = Edges::of(scene.triangles.iter().map(|t| t.positions));
    let mut all = Vec::with_capacity(edges.iter().count() + scene.crossings().all().len());
    let edges = edges
        .iter()
        .map(|sides| {
            let ends = sides[0].ends;
            let (normals, faces, seam) = match sides {
                [a, b] if a.ascending != b.ascending => {
                    let [s, t] = [a.triangle, b.triangle];
                    let faces = [s, t].map(|t| first[t as usize]);
                    ([normal(s), normal(t)], faces, !scene.adjacency.jumps(s, a.corner as usize))
                }
                _ => ([DVec3::ZERO; 2], [NONE; 2], false),
            };
            let places = ends.map(|i| scene.positions[i as usize]);
            // Within a face it can only be a silhouette.
            let faces = if seam && faces[0] == faces[1] { [NONE; 2] } else { faces };
            let owners = match sides {
                [a] => [first[a.triangle as usize], NONE],
                [a, b] => [a, b].map(|side| first[side.triangle as usize]),
                _ => [NONE; 2],
            };
            Edge { span: Span::Edge(ends), places, normals, faces, owners, seam }
        })
        .filter(|e| e.places[0] != e.places[1] && !(is_flat(e.normals) && e.faces == [NONE; 2]));
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
