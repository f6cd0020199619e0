//! Arrangement of all edges: the visible shade of each face, and its discontinuities.

use std::collections::HashMap;

use glam::DVec2;

use super::ExactError;
use super::noding::Noded;
use crate::plane::box_tree::{Aabb, BoxTree};
use crate::plane::triangulate::{OUTSIDE, TriangulateError, Triangulation, undirected};
use crate::plane::{Attachment, Film, Scene};

/// A piece of an edge across which the visible shape changes, or on which edges of several visible shapes
/// coincide.
#[derive(Clone, Debug, PartialEq)]
pub struct Boundary {
    /// The two nodes.
    pub(super) nodes: [u32; 2],
    /// The visible shape on either side; `None` is the background. `minus` is to the left of the piece's
    /// direction (towards +y from +x), and ν points from minus to plus.
    pub(super) minus: Option<u32>,
    pub(super) plus: Option<u32>,
    /// The edges that lie here, of shapes visible here, as indices into [`Arrangement::edges`]. The
    /// derivative exists only if all have the same motion.
    pub(super) owners: Vec<u32>,
}

/// The faces in which one shape is visible, triangulated, and the boundaries between them.
#[derive(Clone, Debug)]
pub struct Arrangement<'a> {
    pub(super) scene: &'a Scene,
    pub(super) nodes: Vec<DVec2>,
    pub(super) mesh: Triangulation,
    /// The visible shape in each triangle.
    pub(super) visible: Vec<Option<u32>>,
    pub(super) boundaries: Vec<Boundary>,
    /// (shape, the two vertices by index in the whole scene).
    pub(super) edges: Vec<(usize, [usize; 2])>,
    face_tree: BoxTree,
    boundary_tree: BoxTree,
}

impl<'a> Arrangement<'a> {
    /// Builds the arrangement; the film only determines its extent.
    ///
    /// # Errors
    /// [`ExactError::Noding`] or [`ExactError::Coordinate`].
    pub fn new(scene: &'a Scene, film: &Film) -> Result<Self, ExactError> {
        let edges: Vec<_> = scene.edges().collect();
        let point = |v: usize| scene.vertices()[v];
        let mut sources: Vec<_> = edges.iter().map(|(_, e)| e.map(point)).collect();
        sources.extend(creases(scene));
        let mut noded = Noded::new(&sources)?;
        for corner in frame(scene, film) {
            noded.node(corner);
        }
        // Edges on each piece; creases have no owner.
        let mut owners: HashMap<[u32; 2], Vec<u32>> = HashMap::new();
        for piece in &noded.pieces {
            let here = owners.entry(undirected(piece.nodes)).or_default();
            if (piece.source as usize) < edges.len() {
                here.push(piece.source);
            }
        }
        let constraints: Vec<_> = owners.keys().copied().collect();
        let mesh = Triangulation::new(&noded.nodes, &sorted(constraints)).map_err(|error| match error {
            TriangulateError::Coordinate => ExactError::Coordinate,
            TriangulateError::Crossing => ExactError::Noding { rounds: 0, at: noded.nodes[0] },
        })?;
        let covers = covers(&mesh, &owners, &edges);
        let boundaries = boundaries(&mesh, &owners, &edges, &covers);
        let visible: Vec<_> = covers.iter().map(|c| c.last().copied()).collect();
        let node = |n: u32| noded.nodes[n as usize];
        let boxes: Vec<_> = mesh.triangles.iter().map(|t| Aabb::of(t.map(node))).collect();
        let face_tree = BoxTree::build(&boxes);
        let boxes: Vec<_> = boundaries.iter().map(|b| Aabb::of(b.nodes.map(node))).collect();
        let boundary_tree = BoxTree::build(&boxes);
        let nodes = noded.nodes;
        Ok(Self { scene, nodes, mesh, visible, boundaries, edges, face_tree, boundary_tree })
    }

    /// The corners of every triangle with the shape visible in it; `None` is the background.
    pub fn faces(&self) -> impl Iterator<Item = ([DVec2; 3], Option<usize>)> {
        (0..self.visible.len()).map(|t| (self.corners(t), self.visible[t].map(|s| s as usize)))
    }

    /// End points of every piece of edge on which the visible shape changes: the visible silhouettes. The
    /// first shape is on the left, the second on the right.
    pub fn silhouettes(&self) -> impl Iterator<Item = ([DVec2; 2], [Option<usize>; 2])> {
        self.boundaries.iter().filter(|b| b.minus != b.plus).map(|b| {
            let ends = b.nodes.map(|n| self.nodes[n as usize]);
            (ends, [b.minus, b.plus].map(|s| s.map(|s| s as usize)))
        })
    }

    /// Index of the silhouette piece nearest to u, and its distance; `None` if nothing is visible.
    pub(super) fn nearest_boundary(&self, u: DVec2) -> Option<(usize, f64)> {
        let distance_squared = |i: usize| {
            let b = &self.boundaries[i];
            if b.minus == b.plus {
                return f64::INFINITY;
            }
            let [p, q] = b.nodes.map(|n| self.nodes[n as usize]);
            crate::plane::segments::distance_squared(u, p, q)
        };
        self.boundary_tree.nearest(u, f64::INFINITY, distance_squared).map(|(i, d)| (i, d.sqrt()))
    }

    pub(super) fn corners(&self, triangle: usize) -> [DVec2; 3] {
        self.mesh.triangles[triangle].map(|n| self.nodes[n as usize])
    }

    pub(super) fn faces_in(&self, min: DVec2, max: DVec2, visit: impl FnMut(usize)) {
        self.face_tree.visit(|b| b.overlaps(&Aabb { min, max }), visit);
    }

    pub(super) fn boundaries_in(&self, min: DVec2, max: DVec2, visit: impl FnMut(usize)) {
        self.boundary_tree.visit(|b| b.overlaps(&Aabb { min, max }), visit);
    }

    /// The triangle that contains u, with barycentric coordinates; `None` outside the frame.
    pub(super) fn locate(&self, u: DVec2) -> Option<(usize, [f64; 3])> {
        let test = |t: usize| {
            let [a, b, c] = self.corners(t);
            let w = [(b, c), (c, a), (a, b)].map(|(p, q)| crate::plane::orient(p, q, u));
            let sum: f64 = w.iter().sum();
            w.iter().all(|&w| w >= 0.0).then(|| w.map(|w| w / sum))
        };
        self.face_tree.last_at(u, test)
    }
}

fn sorted(mut edges: Vec<[u32; 2]>) -> Vec<[u32; 2]> {
    edges.sort_unstable();
    edges
}

/// The shapes that cover each triangle, in painter's order. Crossing a piece toggles the shapes that own it
/// an odd number of times, so rounding can never make a face inconsistent.
fn covers(
    mesh: &Triangulation,
    owners: &HashMap<[u32; 2], Vec<u32>>,
    edges: &[(usize, [usize; 2])],
) -> Vec<Vec<u32>> {
    let mut covers: Vec<Vec<u32>> = vec![vec![]; mesh.triangles.len()];
    mesh.flood(|from, edge, to| {
        let mut cover = if from == OUTSIDE { vec![] } else { covers[from as usize].clone() };
        for &owner in owners.get(&undirected(edge)).into_iter().flatten() {
            let shape = edges[owner as usize].0 as u32;
            match cover.binary_search(&shape) {
                Ok(i) => drop(cover.remove(i)),
                Err(i) => cover.insert(i, shape),
            }
        }
        covers[to as usize] = cover;
    });
    covers
}

fn boundaries(
    mesh: &Triangulation,
    owners: &HashMap<[u32; 2], Vec<u32>>,
    edges: &[(usize, [usize; 2])],
    covers: &[Vec<u32>],
) -> Vec<Boundary> {
    let mut boundaries = vec![];
    for t in 0..mesh.triangles.len() {
        for k in 0..3 {
            let (nodes, n) = (mesh.edge(t, k), mesh.neighbours[t][k]);
            let Some(here) = owners.get(&undirected(nodes)) else { continue };
            // Each piece once, from the triangle on its left; the hull has no second triangle.
            if here.is_empty() || (n != OUTSIDE && nodes[0] > nodes[1]) {
                continue;
            }
            let left = &covers[t];
            let right: &[u32] = if n == OUTSIDE { &[] } else { &covers[n as usize] };
            // A shape that covers both sides hides every edge below it.
            let hidden_below = left.iter().rev().find(|s| right.contains(s));
            let seen =
                |&&owner: &&u32| hidden_below.is_none_or(|&limit| edges[owner as usize].0 as u32 >= limit);
            let owners: Vec<u32> = here.iter().filter(seen).copied().collect();
            let (minus, plus) = (left.last().copied(), right.last().copied());
            if minus != plus || owners.len() > 1 {
                boundaries.push(Boundary { nodes, minus, plus, owners });
            }
        }
    }
    boundaries
}

/// Lines on which a visible shade or its motion is not smooth, as segments that quadrature must not straddle:
/// the stops of ramps, and the inner edges of triangulated material.
fn creases(scene: &Scene) -> Vec<[DVec2; 2]> {
    let mut creases = vec![];
    for (shape, s) in scene.shapes().iter().enumerate() {
        if s.shade().is_constant() {
            continue;
        }
        let polygon = s.polygon();
        if s.shade().attachment() == Attachment::Material {
            let outline: std::collections::HashSet<_> =
                polygon.edges().map(|e| undirected(e.map(|v| v as u32))).collect();
            let base = scene.vertex_range(shape).start;
            for t in polygon.triangles() {
                for k in 0..3 {
                    let e = [t[k], t[(k + 1) % 3]];
                    if e[0] < e[1] && !outline.contains(&e) {
                        creases.push(e.map(|v| scene.vertices()[base + v as usize]));
                    }
                }
            }
        }
        for t in polygon.triangles() {
            let base = scene.vertex_range(shape).start;
            let corners = t.map(|v| base + v as usize);
            creases.extend(scene.shade_creases(shape, corners));
        }
    }
    creases
}

/// Four corners around everything, so that every pixel lies in triangles.
fn frame(scene: &Scene, film: &Film) -> [DVec2; 4] {
    let (mut min, mut max) = film.extent();
    if let Some((low, high)) = scene.bounds() {
        (min, max) = (min.min(low), max.max(high));
    }
    let margin = DVec2::splat(0.5 * (max - min).max_element());
    let (min, max) = (min - margin, max + margin);
    [min, DVec2::new(max.x, min.y), max, DVec2::new(min.x, max.y)]
}
