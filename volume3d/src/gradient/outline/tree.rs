//! All edges of a scene, and those of them near a direction at which what is seen may jump.

use std::ops::Range;

use glam::DVec3;
use rayon::prelude::*;

use super::arc::Reach;
use super::faces::Faces;
use super::node::{Bounds, Node, Query, WIDTH};
use crate::scene::{NONE, Scene, Span};

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

/// The edges of a scene in a hierarchy.
#[derive(Clone, Debug, Default)]
pub(crate) struct Tree {
    nodes: Vec<Node>,
    /// Those in the hierarchy, and after them those that are silhouettes from nowhere.
    edges: Vec<Edge>,
    /// One over the size of all edges' box.
    unit: f64,
    /// Nothing in the tree of a border.
    faces: Faces,
}

/// Edges in a leaf.
const LEAF: usize = 4;

/// What a query is about: a direction from a point, and planes before which edges must be.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Cone<'p> {
    pub(crate) origin: DVec3,
    pub(crate) axis: DVec3,
    pub(crate) reach: Reach,
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

impl Tree {
    /// Of a scene's edges and crossings.
    pub(crate) fn new(scene: &Scene) -> Self {
        let faces = Faces::grow(scene);
        let edges = edges(scene, &faces);
        Self::assemble(edges, faces)
    }

    /// Of edges, and the first triangle of each triangle's face.
    pub(super) fn assemble(edges: Vec<Edge>, faces: Vec<u32>) -> Self {
        let (edges, flat): (Vec<Edge>, Vec<Edge>) = edges.into_iter().partition(|e| !is_flat(e.normals));
        let mut tree = Self::of(edges, Bounds::around);
        tree.edges.extend(flat);
        tree.faces = Faces::new(faces, &tree.edges);
        tree
    }

    /// Of edges that are looked up from everywhere.
    pub(super) fn of_border(edges: Vec<Edge>) -> Self {
        Self::of(edges, Bounds::from_everywhere)
    }

    fn of(edges: Vec<Edge>, bounds: impl Fn(&[Edge]) -> Bounds + Copy) -> Self {
        let (low, high) = corners(edges.iter().flat_map(|e| e.places));
        let unit = 1.0 / (high - low).max_element();
        let mut tree = Self { nodes: vec![], edges, unit, faces: Faces::default() };
        if !tree.edges.is_empty() {
            tree.node(0..tree.edges.len(), bounds);
        }
        tree
    }

    /// Appends a node of some edges, and all below it; returns its index.
    fn node(&mut self, range: Range<usize>, bounds: impl Fn(&[Edge]) -> Bounds + Copy) -> u32 {
        let index = self.nodes.len();
        let parts = self.split(range);
        self.nodes.push(Node::new(parts.iter().map(|part| bounds(&self.edges[part.clone()])), self.unit));
        for (lane, part) in parts.into_iter().enumerate() {
            let (first, count) = if part.len() > LEAF {
                (self.node(part, bounds), 0)
            } else {
                (part.start as u32, part.len() as u32)
            };
            (self.nodes[index].first[lane], self.nodes[index].count[lane]) = (first, count);
        }
        index as u32
    }

    /// Up to eight parts of a range, each half of one before it.
    fn split(&mut self, range: Range<usize>) -> Vec<Range<usize>> {
        let mut parts = vec![range];
        while parts.len() < WIDTH {
            let largest = (0..parts.len()).max_by_key(|&i| parts[i].len()).filter(|&i| parts[i].len() > LEAF);
            let Some(largest) = largest else { break };
            let part = parts[largest].clone();
            let middle = part.start + halve(&mut self.edges[part.clone()]);
            parts[largest] = part.start..middle;
            parts.insert(largest + 1, middle..part.end);
        }
        parts
    }

    /// The triangle whose plane is that of a triangle's face.
    pub(crate) fn plane(&self, triangle: u32) -> u32 {
        self.faces.plane(triangle)
    }

    /// Calls with every edge of the border of a triangle's face that is no silhouette and may be within the cone.
    pub(crate) fn for_each_of_face(&self, triangle: u32, cone: &Cone<'_>, f: impl FnMut(&Edge)) {
        self.faces.for_each(&self.edges, triangle, cone, f);
    }

    /// Calls with every silhouette of the scene that may be within the cone, and before all its planes.
    pub(crate) fn for_each(&self, cone: &Cone<'_>, mut f: impl FnMut(&Edge)) {
        self.visit(cone, |edge| {
            if edge.is_silhouette(cone) {
                f(edge);
            }
        });
    }

    /// Calls with every edge that may count.
    pub(super) fn visit(&self, cone: &Cone<'_>, mut f: impl FnMut(&Edge)) {
        if self.nodes.is_empty() {
            return;
        }
        let query = Query::new(cone, self.unit);
        let mut stack = [0_u32; DEPTH];
        let mut height = 1;
        while height > 0 {
            height -= 1;
            let node = &self.nodes[stack[height] as usize];
            let mut entered = query.entered(node);
            while entered != 0 {
                let lane = entered.trailing_zeros() as usize;
                entered &= entered - 1;
                let (first, count) = (node.first[lane], node.count[lane]);
                if count == 0 {
                    stack[height] = first;
                    height += 1;
                    continue;
                }
                let edges = &self.edges[first as usize..(first + count) as usize];
                edges.iter().for_each(&mut f);
            }
        }
    }
}

/// Splitting 2³² edges in eight takes 11 steps, each of which leaves seven nodes behind.
const DEPTH: usize = 96;

/// Reorders edges by the middle of their boxes' longest side, and returns where the second half begins.
fn halve(edges: &mut [Edge]) -> usize {
    let (low, high) = corners(edges.iter().map(|e| e.places[0] + e.places[1]));
    let axis = (high - low).max_position();
    let middle = edges.len() / 2;
    let key = |e: &Edge| (e.places[0] + e.places[1])[axis];
    edges.select_nth_unstable_by(middle, |a, b| key(a).total_cmp(&key(b)));
    middle
}

fn corners(points: impl Iterator<Item = DVec3>) -> (DVec3, DVec3) {
    points.fold((DVec3::INFINITY, DVec3::NEG_INFINITY), |(low, high), p| (low.min(p), high.max(p)))
}

/// Every edge once, in the order of their ends, and every crossing; but not the edges between triangles of one face, if
/// nothing jumps there and they are silhouettes from nowhere.
pub(super) fn edges(scene: &Scene, first: &[u32]) -> Vec<Edge> {
    // Edges with a triangle's side each, and whether it runs along them from the lower index to the higher.
    let mut sides: Vec<([u32; 2], (u32, u8), bool)> = Vec::with_capacity(3 * scene.triangles.len());
    for (t, triangle) in scene.triangles.iter().enumerate() {
        for k in 0..3 {
            let [a, b] = [triangle.positions[k], triangle.positions[(k + 1) % 3]];
            sides.push(([a.min(b), a.max(b)], (t as u32, k as u8), a < b));
        }
    }
    sides.par_sort_unstable();
    let normal = |t: u32| {
        let [a, b, c] = scene.triangles[t as usize].positions.map(|i| scene.positions[i as usize]);
        (b - a).cross(c - a).normalize_or_zero()
    };
    sides
        .chunk_by(|a, b| a.0 == b.0)
        .map(|sides| {
            let ends = sides[0].0;
            let (normals, faces, seam) = match *sides {
                [(_, (s, k), along), (_, (t, _), other)] if along != other => {
                    let faces = [s, t].map(|t| first[t as usize]);
                    ([normal(s), normal(t)], faces, !scene.edges.jumps(s, k as usize))
                }
                _ => ([DVec3::ZERO; 2], [NONE; 2], false),
            };
            let places = ends.map(|i| scene.positions[i as usize]);
            // Within a face it is a silhouette at most.
            let faces = if seam && faces[0] == faces[1] { [NONE; 2] } else { faces };
            Edge { span: Span::Edge(ends), places, normals, faces, seam }
        })
        .filter(|e| e.places[0] != e.places[1] && !(is_flat(e.normals) && e.faces == [NONE; 2]))
        .chain(crossings(scene))
        .collect()
}

/// Every crossing.
fn crossings(scene: &Scene) -> impl Iterator<Item = Edge> {
    scene.crossings().all().iter().zip(0..).map(|(crossing, index)| Edge {
        span: Span::Crossing(index),
        places: crossing.places,
        normals: [DVec3::ZERO; 2],
        faces: [NONE; 2],
        seam: false,
    })
}

/// Whether an edge continues a plane so exactly that it is a silhouette from nowhere but in that plane.
fn is_flat([m, n]: [DVec3; 2]) -> bool {
    m == n && m != DVec3::ZERO
}
