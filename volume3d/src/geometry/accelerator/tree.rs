//! The hierarchy in memory: nodes of eight boxes, leaves of up to eight triangles.

use std::ops::Range;

use glam::DVec3;
use rayon::prelude::*;

use super::Mesh;
use super::build::{Binary, Bounds, Reference};
use super::frame::Frame;
use super::lanes::{Lanes, Row, WIDTH};

/// What a cache line holds, in bytes.
const LINE: usize = 64;

/// A bound of an empty box: no depth lies above and below it, and products with reciprocals of
/// slopes stay ordered.
const NOWHERE: f32 = 1e30;

/// Boxes of eight children, in the frame.
#[derive(Clone, Debug)]
#[repr(align(64))]
pub(super) struct Node {
    /// By axis, the lower planes and the upper planes.
    pub(super) planes: [[Row; 2]; 3],
    pub(super) children: [Link; WIDTH],
}

/// Where a child is: a node, or a leaf with its number of triangles.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) struct Link(u32);

impl Link {
    const LEAF: u32 = 1 << 31;
    const COUNT_BITS: u32 = 3;
    pub(super) const ROOT: Self = Self(0);

    fn node(index: usize) -> Self {
        assert!(index < Self::LEAF as usize, "fewer than 2³¹ nodes");
        Self(index as u32)
    }

    fn leaf(index: usize, count: usize) -> Self {
        assert!(index < 1 << (31 - Self::COUNT_BITS), "fewer than 2²⁸ leaves");
        Self(Self::LEAF | (index as u32) << Self::COUNT_BITS | (count as u32 - 1))
    }

    pub(super) const fn bits(self) -> u32 {
        self.0
    }

    #[inline(always)]
    pub(super) fn from_bits(bits: u32) -> Self {
        Self(bits)
    }

    #[inline(always)]
    pub(super) fn is_leaf(self) -> bool {
        self.0 & Self::LEAF != 0
    }

    /// The node or leaf it points to.
    #[inline(always)]
    pub(super) fn index(self) -> usize {
        if self.is_leaf() { self.index_of_leaf() } else { self.0 as usize }
    }

    #[inline(always)]
    fn index_of_leaf(self) -> usize {
        ((self.0 & !Self::LEAF) >> Self::COUNT_BITS) as usize
    }

    /// One bit for each triangle of a leaf.
    #[inline(always)]
    pub(super) fn mask(self) -> u32 {
        (2 << (self.0 & ((1 << Self::COUNT_BITS) - 1))) - 1
    }
}

/// Up to eight triangles: for the filter in the frame, for the exact test by their vertices. Lanes past the last
/// repeat it.
#[derive(Clone, Debug)]
#[repr(align(64))]
pub(super) struct Leaf {
    /// By vertex and axis.
    pub(super) vertices: [[Row; 3]; 3],
    pub(super) triangles: [Triangle; WIDTH],
}

/// A triangle as the exact test finds it.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub(super) struct Triangle {
    /// Places in the tree's own positions.
    pub(super) vertices: [u32; 3],
    /// Index in the mesh.
    pub(super) index: u32,
}

/// Nodes in depth-first order, the root first, and leaves in the order they are met.
#[derive(Debug)]
pub(super) struct Tree {
    pub(super) nodes: Vec<Node>,
    pub(super) leaves: Vec<Leaf>,
    /// Corners of the triangles, in the order in which leaves use them: neighbours in space are
    /// neighbours in memory, whatever the mesh was like.
    pub(super) positions: Vec<[f64; 3]>,
    /// Root of the mean of half the surface of leaves.
    pub(super) leaf_size: f64,
    /// Most links a traversal keeps for later.
    pub(super) pending: usize,
}

impl Tree {
    /// Lays out a hierarchy over `references` to triangles of a mesh.
    pub(super) fn new(root: &Binary, references: &[Reference], frame: &Frame, mesh: Mesh<'_>) -> Self {
        let mut layout = Layout { nodes: Vec::new(), leaves: Vec::new(), surface: 0.0 };
        let depth = if root.is_leaf() { layout.root_leaf(root) } else { layout.node(root) };
        let (triangles, positions) = reordered(references, mesh);
        let leaves: Vec<Leaf> = layout
            .leaves
            .into_par_iter()
            .map(|range| Leaf::new(&triangles[range], &positions, frame))
            .collect();
        let leaf_size = (layout.surface / leaves.len().max(1) as f64).sqrt();
        Self { nodes: layout.nodes, leaves, positions, leaf_size, pending: depth * (WIDTH - 1) + 1 }
    }

    /// Asks for what a link points to, ahead of time. Without a branch on what it is, which would be
    /// mispredicted.
    #[inline(always)]
    pub(super) fn prefetch<L: Lanes>(&self, lanes: L, link: Link) {
        // Addresses only: nothing is read here.
        let (nodes, leaves) = (self.nodes.as_ptr().cast::<i8>(), self.leaves.as_ptr().cast::<i8>());
        let node = nodes.wrapping_add(link.0 as usize * size_of::<Node>());
        let leaf = leaves.wrapping_add(link.index_of_leaf() * size_of::<Leaf>());
        let start = if link.is_leaf() { leaf } else { node };
        for line in 0..size_of::<Leaf>() / LINE {
            lanes.prefetch(start.wrapping_add(LINE * line));
        }
    }

    /// Corners of a triangle.
    #[inline(always)]
    pub(super) fn corners(&self, triangle: &Triangle) -> [&[f64; 3]; 3] {
        let [a, b, c] = triangle.vertices;
        [&self.positions[a as usize], &self.positions[b as usize], &self.positions[c as usize]]
    }
}

/// Triangles in the order of leaves, and their corners in the order of first use.
fn reordered(references: &[Reference], mesh: Mesh<'_>) -> (Vec<Triangle>, Vec<[f64; 3]>) {
    const UNUSED: u32 = u32::MAX;
    let mut places = vec![UNUSED; mesh.positions.len()];
    let mut ordered = Vec::new();
    let mut place = |vertex: u32| {
        let place = &mut places[vertex as usize];
        if *place == UNUSED {
            *place = ordered.len() as u32;
            ordered.push(mesh.positions[vertex as usize].to_array());
        }
        *place
    };
    let triangle = |&Reference { triangle: index, .. }: &Reference| Triangle {
        vertices: mesh.triangles[index as usize].map(&mut place),
        index,
    };
    (references.iter().map(triangle).collect(), ordered)
}

/// Nodes, and leaves as places in the order of triangles.
struct Layout {
    nodes: Vec<Node>,
    leaves: Vec<Range<usize>>,
    /// Sum of half the surfaces of leaves.
    surface: f64,
}

impl Layout {
    /// Appends a node and all below it; returns its depth.
    fn node(&mut self, binary: &Binary) -> usize {
        let index = self.nodes.len();
        self.nodes.push(Node::empty());
        let mut depth = 0;
        for (lane, child) in binary.children().into_iter().enumerate() {
            let link = if child.is_leaf() {
                self.leaf(child)
            } else {
                let link = Link::node(self.nodes.len());
                depth = depth.max(self.node(child));
                link
            };
            self.nodes[index].set(lane, child.bounds, link);
        }
        depth + 1
    }

    fn leaf(&mut self, binary: &Binary) -> Link {
        let range = binary.range();
        let link = Link::leaf(self.leaves.len(), range.len());
        self.leaves.push(range);
        self.surface += f64::from(binary.bounds.area());
        link
    }

    /// A node with one leaf, or with none if there are no triangles.
    fn root_leaf(&mut self, root: &Binary) -> usize {
        let mut node = Node::empty();
        if !root.range().is_empty() {
            node.set(0, root.bounds, self.leaf(root));
        }
        self.nodes.push(node);
        1
    }
}

impl Node {
    fn empty() -> Self {
        Self { planes: [[[NOWHERE; WIDTH], [-NOWHERE; WIDTH]]; 3], children: [Link::ROOT; WIDTH] }
    }

    fn set(&mut self, lane: usize, bounds: Bounds, link: Link) {
        for axis in 0..3 {
            self.planes[axis][0][lane] = bounds.lower[axis];
            self.planes[axis][1][lane] = bounds.upper[axis];
        }
        self.children[lane] = link;
    }
}

impl Leaf {
    fn new(triangles: &[Triangle], positions: &[[f64; 3]], frame: &Frame) -> Self {
        let mut leaf = Self { vertices: [[[0.0; WIDTH]; 3]; 3], triangles: [Triangle::default(); WIDTH] };
        for (lane, &triangle) in triangles.iter().enumerate() {
            // Every lane from here on, so that those left over repeat a triangle that is there.
            leaf.triangles[lane..].fill(triangle);
            for (rows, vertex) in leaf.vertices.iter_mut().zip(triangle.vertices) {
                let p = frame.place(DVec3::from_array(positions[vertex as usize])).as_vec3();
                for axis in 0..3 {
                    rows[axis][lane..].fill(p[axis]);
                }
            }
        }
        leaf
    }
}
