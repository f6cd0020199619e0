//! All edges of a scene, and those of them near a direction at which what is seen may jump.

use std::collections::HashMap;

use glam::DVec3;

use super::arc::Reach;
use crate::scene::Scene;

/// An edge with what decides whether it is a silhouette.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Edge {
    /// Indices of the scene's positions.
    pub(crate) ends: [u32; 2],
    pub(crate) places: [DVec3; 2],
    /// The normals of the two triangles that continue one another across it; zero where it is seen from everywhere, as
    /// the border of a surface or the meeting of three triangles is.
    normals: [DVec3; 2],
}

impl Edge {
    /// Whether a viewer sees one of the edge's triangles from the front and one from the back, or a border.
    fn is_silhouette(&self, origin: DVec3) -> bool {
        let way = self.places[0] - origin;
        let [a, b] = self.normals.map(|n| n.dot(way));
        // From within one of the planes it is one, but for rounding.
        a * b <= 0.0 || a.abs().min(b.abs()) <= IN_PLANE * way.length()
    }
}

/// The sine of the angle at which a viewer is in a plane.
const IN_PLANE: f64 = 1e-12;

/// A box around edges, with a cone around the normals of their triangles.
#[derive(Clone, Copy, Debug)]
struct Node {
    centre: DVec3,
    /// Half the box's extent.
    half: DVec3,
    radius: f64,
    axis: DVec3,
    /// Cosine and sine of the cone's half angle; without limit, −1 and 0.
    cosine: f64,
    sine: f64,
    /// Children, the first of two, or edges.
    first: u32,
    /// Of edges; 0 for an inner node.
    count: u32,
}

/// The edges of a scene in a hierarchy.
#[derive(Clone, Debug, Default)]
pub(crate) struct Tree {
    nodes: Vec<Node>,
    edges: Vec<Edge>,
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
    pub(crate) fn new(scene: &Scene) -> Self {
        let mut edges = edges(scene);
        let mut tree = Self::default();
        if !edges.is_empty() {
            tree.nodes.push(Node::around(&edges));
            tree.split(0, &mut edges, 0);
        }
        tree.edges = edges;
        tree
    }

    /// Halves a node's edges by the middle of their boxes' longest side.
    fn split(&mut self, node: usize, edges: &mut [Edge], first: usize) {
        if edges.len() <= LEAF {
            (self.nodes[node].first, self.nodes[node].count) = (first as u32, edges.len() as u32);
            return;
        }
        let (low, high) = bounds(edges.iter().map(|e| e.places[0] + e.places[1]));
        let axis = (high - low).max_position();
        let middle = edges.len() / 2;
        let key = |e: &Edge| (e.places[0] + e.places[1])[axis];
        edges.select_nth_unstable_by(middle, |a, b| key(a).total_cmp(&key(b)));
        let (left, right) = edges.split_at_mut(middle);
        let child = self.nodes.len();
        self.nodes.extend([Node::around(left), Node::around(right)]);
        self.nodes[node].first = child as u32;
        self.split(child, left, first);
        self.split(child + 1, right, first + middle);
    }

    /// Calls with every silhouette of the scene that may be within the cone, and before all its planes.
    pub(crate) fn for_each(&self, cone: &Cone<'_>, mut f: impl FnMut(&Edge)) {
        if self.nodes.is_empty() {
            return;
        }
        let mut stack = [0_u32; DEPTH];
        let mut height = 1;
        while height > 0 {
            height -= 1;
            let node = &self.nodes[stack[height] as usize];
            if !node.counts(cone) {
                continue;
            }
            if node.count == 0 {
                stack[height] = node.first;
                stack[height + 1] = node.first + 1;
                height += 2;
                continue;
            }
            let edges = &self.edges[node.first as usize..(node.first + node.count) as usize];
            edges.iter().filter(|e| e.is_silhouette(cone.origin)).for_each(&mut f);
        }
    }
}

/// Halving 2³² edges takes 32 steps, each of which leaves one node behind.
const DEPTH: usize = 40;

impl Node {
    fn around(edges: &[Edge]) -> Self {
        let (low, high) = bounds(edges.iter().flat_map(|e| e.places));
        let normals = || edges.iter().flat_map(|e| e.normals);
        let axis = normals().sum::<DVec3>().normalize_or_zero();
        let cosine = normals().map(|n| n.dot(axis)).fold(1.0, f64::min);
        // A border's normals are zero: with cosine 0 it opens the cone to where nothing is left out.
        let (cosine, sine) = if cosine > MARGIN {
            (cosine - MARGIN, (1.0 - (cosine - MARGIN).powi(2)).sqrt())
        } else {
            (-1.0, 0.0)
        };
        let (centre, half) = (0.5 * (low + high), 0.5 * (1.0 + MARGIN) * (high - low));
        Self { centre, half, radius: half.length(), axis, cosine, sine, first: 0, count: 0 }
    }

    fn counts(&self, cone: &Cone<'_>) -> bool {
        let way = self.centre - cone.origin;
        // The plane that touches the cone on the side of the box.
        let along = way.dot(cone.axis);
        let across = way - along * cone.axis;
        let apart = across.length();
        let normal =
            across * (cone.reach.cosine / apart.max(f64::MIN_POSITIVE)) - cone.axis * cone.reach.sine;
        let height = apart * cone.reach.cosine - along * cone.reach.sine;
        if height > self.half.dot(normal.abs()) + MARGIN * (apart + along.abs()) {
            return false;
        }
        if cone.planes.iter().any(|p| p.height(self.centre) < -self.half.dot(p.normal.abs())) {
            return false;
        }
        if self.cosine < 0.0 {
            return true;
        }
        let distance = way.length();
        if distance <= self.radius {
            return true;
        }
        // The half angle β of the box's ball as seen from the origin.
        let sine = self.radius / distance;
        let cosine = (1.0 - sine * sine).sqrt();
        // Every triangle shows its front, or every one its back, unless the angle of way and axis is within
        // θ + β of a right one.
        let within_quarter = self.cosine * cosine > self.sine * sine;
        !within_quarter
            || way.dot(self.axis).abs() <= (self.sine * cosine + self.cosine * sine + MARGIN) * distance
    }
}

/// Rounding must not lose an edge.
const MARGIN: f64 = 1e-9;

fn bounds(points: impl Iterator<Item = DVec3>) -> (DVec3, DVec3) {
    points.fold((DVec3::INFINITY, DVec3::NEG_INFINITY), |(low, high), p| (low.min(p), high.max(p)))
}

/// Every edge once.
fn edges(scene: &Scene) -> Vec<Edge> {
    let mut sides: HashMap<[u32; 2], Vec<(u32, bool)>> = HashMap::with_capacity(scene.triangles.len() * 2);
    for (t, triangle) in scene.triangles.iter().enumerate() {
        for k in 0..3 {
            let [a, b] = [triangle.positions[k], triangle.positions[(k + 1) % 3]];
            sides.entry([a.min(b), a.max(b)]).or_default().push((t as u32, a < b));
        }
    }
    let normal = |t: u32| {
        let [a, b, c] = scene.triangles[t as usize].positions.map(|i| scene.positions[i as usize]);
        (b - a).cross(c - a).normalize_or_zero()
    };
    let mut edges: Vec<Edge> = sides
        .into_iter()
        .map(|(ends, sides)| {
            let normals = match *sides.as_slice() {
                [(s, along), (t, other)] if along != other => [normal(s), normal(t)],
                _ => [DVec3::ZERO; 2],
            };
            Edge { ends, places: ends.map(|i| scene.positions[i as usize]), normals }
        })
        .filter(|e| e.places[0] != e.places[1] && !is_flat(e.normals))
        .collect();
    // The order of a hash map must not reach any result.
    edges.sort_unstable_by_key(|e| e.ends);
    edges
}

/// Whether an edge continues a plane so exactly that it is a silhouette from nowhere but in that plane.
fn is_flat([m, n]: [DVec3; 2]) -> bool {
    m == n && m != DVec3::ZERO
}
