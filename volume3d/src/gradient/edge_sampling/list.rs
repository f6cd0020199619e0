//! The edges of a scene, each once, with the triangles that meet in it.

use glam::DVec3;

use crate::scene::Scene;

/// Two faces at a smaller angle are one plane, to rounding.
const FLAT: f64 = 1e-12;

/// A triangle at an edge.
#[derive(Clone, Copy, Debug)]
pub(super) struct Face {
    pub(super) triangle: u32,
    /// The corner that is not on the edge.
    opposite: u32,
}

/// An edge: two positions, and where its triangles are in the list.
#[derive(Clone, Copy, Debug)]
pub(super) struct Edge {
    pub(super) ends: [u32; 2],
    pub(super) shape: u32,
    /// Whether what is seen jumps there from wherever it is seen; if not, only where it is a silhouette.
    pub(super) jump: bool,
    first: u32,
    count: u32,
}

/// All edges at which what is seen may jump.
#[derive(Clone, Debug, Default)]
pub(super) struct EdgeList {
    pub(super) edges: Vec<Edge>,
    faces: Vec<Face>,
}

impl EdgeList {
    pub(super) fn new(scene: &Scene) -> Self {
        let mut sides: Vec<([u32; 2], u32, usize)> = Vec::with_capacity(3 * scene.triangles.len());
        for (t, triangle) in scene.triangles.iter().enumerate() {
            for k in 0..3 {
                let [a, b] = [triangle.positions[k], triangle.positions[(k + 1) % 3]];
                sides.push(([a.min(b), a.max(b)], t as u32, k));
            }
        }
        sides.sort_unstable();
        let mut list = Self::default();
        for group in sides.chunk_by(|a, b| a.0 == b.0) {
            let (ends, triangle, k) = group[0];
            let edge = Edge {
                ends,
                shape: scene.triangles[triangle as usize].shape,
                jump: scene.edges.jumps(triangle, k),
                first: list.faces.len() as u32,
                count: group.len() as u32,
            };
            list.faces.extend(group.iter().map(|&(_, triangle, k)| Face {
                triangle,
                opposite: scene.triangles[triangle as usize].positions[(k + 2) % 3],
            }));
            list.edges.push(edge);
        }
        list
    }

    /// The triangles that meet in an edge.
    pub(super) fn faces(&self, edge: &Edge) -> &[Face] {
        &self.faces[edge.first as usize..(edge.first + edge.count) as usize]
    }

    /// Whether what is seen can jump at an edge: not where two coplanar triangles continue one another.
    ///
    /// At a fold with smooth shading it does as well: a light may be above the horizon of one face and below that of
    /// the other, while the shading normals reflect it on both.
    pub(super) fn may_jump(&self, scene: &Scene, edge: &Edge) -> bool {
        edge.jump || self.limits(scene, edge).is_none_or(|[u, v]| u.distance(v) > FLAT)
    }

    /// On which sides of the plane through an edge, with this normal, triangles lie: before it and behind it.
    pub(super) fn occupied(&self, scene: &Scene, edge: &Edge, normal: DVec3) -> [bool; 2] {
        let start = scene.positions[edge.ends[0] as usize];
        let mut sides = [false; 2];
        for face in self.faces(edge) {
            let height = (scene.positions[face.opposite as usize] - start).dot(normal);
            sides[usize::from(height > 0.0)] = true;
        }
        sides
    }

    /// Of an edge of two triangles: unit vectors orthogonal to it, one into the first triangle and one away from
    /// the second. The edge is a silhouette in directions between the two, and their opposites.
    pub(super) fn limits(&self, scene: &Scene, edge: &Edge) -> Option<[DVec3; 2]> {
        let [f, g] = self.faces(edge) else { return None };
        let [a, b] = edge.span(scene);
        let e = (b - a).normalize_or_zero();
        let away = |face: &Face| {
            let way = scene.positions[face.opposite as usize] - a;
            (way - way.dot(e) * e).normalize_or_zero()
        };
        Some([away(f), -away(g)])
    }

    pub(super) fn has(&self, edge: &Edge, triangle: u32) -> bool {
        self.faces(edge).iter().any(|f| f.triangle == triangle)
    }
}

impl Edge {
    /// Both ends.
    pub(super) fn span(&self, scene: &Scene) -> [DVec3; 2] {
        self.ends.map(|i| scene.positions[i as usize])
    }
}

/// The corners of a triangle.
pub(super) fn corners(scene: &Scene, triangle: u32) -> [DVec3; 3] {
    scene.triangles[triangle as usize].positions.map(|i| scene.positions[i as usize])
}
