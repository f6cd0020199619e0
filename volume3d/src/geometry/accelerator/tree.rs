//! The hierarchy in memory: nodes of eight boxes, leaves of up to eight triangles.

use glam::{DVec3, Vec3A};
use rayon::prelude::*;

use super::build::{Branch, Child, Reference};
use super::frame::Frame;
use super::lanes::{Row, WIDTH};

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

    #[inline(always)]
    pub(super) fn is_leaf(self) -> bool {
        self.0 & Self::LEAF != 0
    }

    /// The node or leaf it points to.
    #[inline(always)]
    pub(super) fn index(self) -> usize {
        if self.is_leaf() { ((self.0 & !Self::LEAF) >> Self::COUNT_BITS) as usize } else { self.0 as usize }
    }

    /// One bit for each triangle of a leaf.
    #[inline(always)]
    pub(super) fn mask(self) -> u32 {
        (2 << (self.0 & ((1 << Self::COUNT_BITS) - 1))) - 1
    }
}

/// Up to eight triangles, in the frame; lanes past the last repeat it.
#[derive(Clone, Debug)]
#[repr(align(32))]
pub(super) struct Leaf {
    /// By vertex and axis.
    pub(super) vertices: [[Row; 3]; 3],
    /// Place of the first triangle in the order of leaves.
    pub(super) first: u32,
}

/// Nodes in depth-first order, the root first, and leaves in the order they are met.
#[derive(Debug)]
pub(super) struct Tree {
    pub(super) nodes: Vec<Node>,
    pub(super) leaves: Vec<Leaf>,
    /// Most links a traversal keeps for later.
    pub(super) pending: usize,
}

impl Tree {
    /// Lays out a hierarchy over `references`, whose triangles have the given corners.
    pub(super) fn new(
        root: &Branch,
        references: &[Reference],
        frame: &Frame,
        corners: impl Fn(u32) -> [DVec3; 3] + Sync,
    ) -> Self {
        let mut ranges = Vec::new();
        let mut nodes = Vec::new();
        let depth = flatten(root, &mut nodes, &mut ranges);
        let leaves = ranges
            .par_iter()
            .map(|range| {
                let members = &references[range.clone()];
                Leaf::new(range.start, members.iter().map(|member| corners(member.triangle)), frame)
            })
            .collect();
        Self { nodes, leaves, pending: depth * (WIDTH - 1) + 1 }
    }
}

/// Appends a branch and all below it; returns its depth in nodes.
fn flatten(branch: &Branch, nodes: &mut Vec<Node>, leaves: &mut Vec<std::ops::Range<usize>>) -> usize {
    let index = nodes.len();
    nodes.push(Node::empty());
    let mut depth = 0;
    for (lane, (bounds, child)) in branch.children.iter().enumerate() {
        let link = match child {
            Child::Leaf(range) => {
                leaves.push(range.clone());
                Link::leaf(leaves.len() - 1, range.len())
            }
            Child::Branch(below) => {
                let link = Link::node(nodes.len());
                depth = depth.max(flatten(below, nodes, leaves));
                link
            }
        };
        nodes[index].set(lane, bounds.lower, bounds.upper, link);
    }
    depth + 1
}

impl Node {
    fn empty() -> Self {
        Self { planes: [[[NOWHERE; WIDTH], [-NOWHERE; WIDTH]]; 3], children: [Link::ROOT; WIDTH] }
    }

    fn set(&mut self, lane: usize, lower: Vec3A, upper: Vec3A, link: Link) {
        for axis in 0..3 {
            self.planes[axis][0][lane] = lower[axis];
            self.planes[axis][1][lane] = upper[axis];
        }
        self.children[lane] = link;
    }
}

impl Leaf {
    fn new(first: usize, triangles: impl ExactSizeIterator<Item = [DVec3; 3]>, frame: &Frame) -> Self {
        let mut leaf = Self { vertices: [[[0.0; WIDTH]; 3]; 3], first: first as u32 };
        for (lane, corners) in triangles.enumerate() {
            // Every lane from here on, so that the ones left over repeat a triangle that is there.
            for (vertex, corner) in leaf.vertices.iter_mut().zip(corners) {
                let p = frame.place(corner).as_vec3();
                for axis in 0..3 {
                    vertex[axis][lane..].fill(p[axis]);
                }
            }
        }
        leaf
    }
}
