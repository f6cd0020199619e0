//! The hierarchy in memory: nodes of eight boxes, leaves of up to eight triangles.
//!
//! Beyond what the nearer caches hold, rays mostly wait for memory: what counts is how many lines a ray touches and how many
//! one after the other. So the filter has three lines a leaf, asked for when its box is entered, and the exact test
//! finds its part of a leaf by the same place, so that both are on their way at once.

use glam::{DVec3, Vec3A};
use rayon::prelude::*;

use super::build::{Binary, Bounds, Reference};
use super::collapse::LEAF_COST;
use super::frame::Frame;
use super::{Mesh, rounded_out};
use crate::lanes::{Lanes, Row, Steps, WIDTH};

/// What a cache line holds, in bytes.
const LINE: usize = 64;

/// A bound of an empty box: no depth lies above and below it, and products with reciprocals of
/// slopes stay ordered.
const NOWHERE: f32 = 1e30;

/// Vertices of a leaf: eight triangles that hang together by edges have ten at most. Leaves with more take the place of
/// several, of no more than they have triangles.
const VERTICES: usize = WIDTH + 2;

/// Smallest width of a grid: far below a rounding unit of single precision, far above its denormals.
const SMALLEST_STEP: f32 = 1e-12;

/// A place without a vertex.
const NO_VERTEX: u32 = u32::MAX;

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

/// Up to eight triangles for the filter, in three cache lines: in the frame, rounded to a grid. Lanes past the last repeat
/// it.
#[derive(Clone, Debug)]
#[repr(C, align(64))]
pub(super) struct Leaf {
    /// By vertex and axis, steps from the anchor.
    pub(super) vertices: [[Steps; 3]; 3],
    /// Lower corner of the leaf's box.
    pub(super) anchor: [f32; 3],
    /// Width of the grid: along each axis a vertex is off by half of it at most.
    pub(super) step: f32,
    /// By triangle and vertex, places among the leaf's positions.
    corners: [[u8; 3]; WIDTH],
}

/// Nodes in depth-first order, the root first, and leaves in the order they are met.
#[derive(Debug)]
pub(super) struct Tree {
    pub(super) nodes: Vec<Node>,
    pub(super) leaves: Vec<Leaf>,
    /// Indices in the mesh of the triangles of each leaf.
    pub(super) triangles: Vec<[u32; WIDTH]>,
    /// Vertices of leaves in the mesh, each once a leaf, from [`VERTICES`] times the leaf's place on, or [`NO_VERTEX`].
    vertices: Vec<u32>,
    /// Where they are.
    positions: Vec<[f64; 3]>,
    /// Root of the mean of half the surface of leaves.
    pub(super) leaf_size: f64,
    /// The median of the same root of leaves: a few large ones do not count.
    pub(super) typical_leaf: f64,
    /// Most links a traversal keeps for later.
    pub(super) pending: usize,
}

impl Tree {
    /// Lays out a hierarchy over `references` to triangles of a mesh, without places: see [`fit`](Self::fit).
    pub(super) fn new(root: &Binary, references: &[Reference], mesh: Mesh<'_>) -> Self {
        let mut layout = Layout { references, mesh, tree: Self::empty() };
        let depth = if root.is_leaf() { layout.root_leaf(root) } else { layout.node(root) };
        layout.tree.pending = depth * (WIDTH - 1) + 1;
        layout.tree.positions = vec![[0.0; 3]; layout.tree.vertices.len()];
        layout.tree
    }

    fn empty() -> Self {
        let (nodes, leaves, triangles, vertices) = (Vec::new(), Vec::new(), Vec::new(), Vec::new());
        Self {
            nodes,
            leaves,
            triangles,
            vertices,
            positions: Vec::new(),
            leaf_size: 0.0,
            typical_leaf: 0.0,
            pending: 0,
        }
    }

    /// Makes all boxes and grids those of the mesh's positions. Returns the cost of the hierarchy: the surface of all boxes
    /// over that of the root's, which is the expected number of boxes that a ray which meets the root's enters, leaves
    /// counted as often as they take longer.
    pub(super) fn fit(&mut self, frame: &Frame, mesh: Mesh<'_>) -> f64 {
        self.positions.par_iter_mut().zip(&self.vertices).for_each(|(position, &vertex)| {
            if let Some(p) = mesh.positions.get(vertex as usize) {
                *position = p.to_array();
            }
        });
        let positions = &self.positions;
        let leaves = self.leaves.par_iter_mut().enumerate();
        let boxes: Vec<Bounds> =
            leaves.map(|(place, leaf)| leaf.fit(&positions[VERTICES * place..], frame)).collect();
        // Children come after their parents.
        let (mut inner, mut outer, mut count) = (0.0, 0.0, 0_u32);
        let mut areas = Vec::with_capacity(boxes.len());
        for index in (0..self.nodes.len()).rev() {
            for lane in 0..WIDTH {
                let link = self.nodes[index].children[lane];
                if link == Link::ROOT {
                    continue;
                }
                let bounds =
                    if link.is_leaf() { boxes[link.index()] } else { self.nodes[link.index()].hull() };
                self.nodes[index].set(lane, bounds);
                if link.is_leaf() {
                    outer += f64::from(bounds.area());
                    count += 1;
                    areas.push(bounds.area());
                } else {
                    inner += f64::from(bounds.area());
                }
            }
        }
        self.leaf_size = (outer / f64::from(count.max(1))).sqrt();
        let middle = areas.len() / 2;
        if middle < areas.len() {
            self.typical_leaf = f64::from(*areas.select_nth_unstable_by(middle, f32::total_cmp).1).sqrt();
        }
        let root = f64::from(self.nodes[0].hull().area());
        if root > 0.0 { (inner + f64::from(LEAF_COST) * outer) / root } else { 0.0 }
    }

    /// Asks for what a link points to, ahead of time: a node, or what the filter needs of a leaf. Without a branch on
    /// what it is, which would be mispredicted.
    #[inline(always)]
    pub(super) fn prefetch<L: Lanes>(&self, lanes: L, link: Link) {
        let leaf = address(&self.leaves, link.index_of_leaf());
        let start = if link.is_leaf() { leaf } else { address(&self.nodes, link.0 as usize) };
        // A leaf has fewer lines: its last one again.
        let last = if link.is_leaf() { size_of::<Leaf>() / LINE - 1 } else { size_of::<Node>() / LINE - 1 };
        for line in 0..size_of::<Node>() / LINE {
            lanes.prefetch(start.wrapping_add(LINE * line.min(last)));
        }
    }

    /// Asks for what the exact test needs of a leaf, which lies far from what the filter needs: without this a ray waits
    /// for memory once more. Of a node, for what has been asked for before.
    #[inline(always)]
    pub(super) fn prefetch_exact<L: Lanes>(&self, lanes: L, link: Link) {
        let node = address(&self.nodes, link.0 as usize);
        let positions = address(&self.positions, VERTICES * link.index_of_leaf());
        let start = if link.is_leaf() { positions } else { node };
        for line in 0..(VERTICES * size_of::<[f64; 3]>()).div_ceil(LINE) {
            lanes.prefetch(start.wrapping_add(LINE * line));
        }
        let triangles = address(&self.triangles, link.index_of_leaf());
        lanes.prefetch(if link.is_leaf() { triangles } else { node });
    }

    /// Indices in the mesh of the triangles of a leaf.
    #[inline(always)]
    pub(super) fn triangles(&self, leaf: Link) -> &[u32; WIDTH] {
        &self.triangles[leaf.index_of_leaf()]
    }

    /// Corners of a triangle of a leaf.
    #[inline(always)]
    pub(super) fn corners(&self, leaf: Link, lane: usize) -> [&[f64; 3]; 3] {
        let place = leaf.index_of_leaf();
        let [a, b, c] = self.leaves[place].corners[lane];
        let first = VERTICES * place;
        [
            &self.positions[first + usize::from(a)],
            &self.positions[first + usize::from(b)],
            &self.positions[first + usize::from(c)],
        ]
    }
}

/// Where an element is or would be: nothing is read.
#[inline(always)]
fn address<T>(elements: &[T], index: usize) -> *const i8 {
    elements.as_ptr().cast::<i8>().wrapping_add(index * size_of::<T>())
}

/// A hierarchy while it is laid out, in the order in which nodes and leaves are met.
struct Layout<'a> {
    references: &'a [Reference],
    mesh: Mesh<'a>,
    tree: Tree,
}

impl Layout<'_> {
    /// Appends a node and all below it; returns its depth.
    fn node(&mut self, binary: &Binary) -> usize {
        let index = self.tree.nodes.len();
        self.tree.nodes.push(Node::empty());
        let mut depth = 0;
        for (lane, child) in binary.children().into_iter().enumerate() {
            self.tree.nodes[index].children[lane] = if child.is_leaf() {
                self.leaf(child)
            } else {
                let link = Link::node(self.tree.nodes.len());
                depth = depth.max(self.node(child));
                link
            };
        }
        depth + 1
    }

    fn leaf(&mut self, binary: &Binary) -> Link {
        let range = binary.range();
        let link = Link::leaf(self.tree.leaves.len(), range.len());
        let start = self.tree.vertices.len();
        let mut corners = [[0; 3]; WIDTH];
        let mut triangles = [0; WIDTH];
        let (references, mesh) = (self.references, self.mesh);
        for (lane, &Reference { triangle, .. }) in references[range].iter().enumerate() {
            // Every lane from here on, so that those left over repeat a triangle that is there.
            triangles[lane..].fill(triangle);
            corners[lane..].fill(mesh.triangles[triangle as usize].map(|vertex| self.place(start, vertex)));
        }
        let tree = &mut self.tree;
        let places = (tree.vertices.len() - start).div_ceil(VERTICES);
        tree.vertices.resize(start + places * VERTICES, NO_VERTEX);
        tree.leaves.push(Leaf { corners, ..Leaf::EMPTY });
        tree.triangles.push(triangles);
        tree.triangles.resize(tree.triangles.len() + places - 1, [0; WIDTH]);
        tree.leaves.resize(tree.leaves.len() + places - 1, Leaf::EMPTY);
        link
    }

    /// The place of a vertex among those of the leaf that begins at `start`.
    fn place(&mut self, start: usize, vertex: u32) -> u8 {
        let own = &self.tree.vertices[start..];
        let place = own.iter().position(|&other| other == vertex).unwrap_or(own.len());
        if place == own.len() {
            self.tree.vertices.push(vertex);
        }
        place as u8
    }

    /// A node with one leaf, or with none if there are no triangles.
    fn root_leaf(&mut self, root: &Binary) -> usize {
        let mut node = Node::empty();
        if !root.range().is_empty() {
            node.children[0] = self.leaf(root);
        }
        self.tree.nodes.push(node);
        1
    }
}

impl Node {
    fn empty() -> Self {
        Self { planes: [[[NOWHERE; WIDTH], [-NOWHERE; WIDTH]]; 3], children: [Link::ROOT; WIDTH] }
    }

    fn set(&mut self, lane: usize, bounds: Bounds) {
        for axis in 0..3 {
            self.planes[axis][0][lane] = bounds.lower[axis];
            self.planes[axis][1][lane] = bounds.upper[axis];
        }
    }

    /// The box around all children. Lanes without one do not matter.
    fn hull(&self) -> Bounds {
        let fold = |side: usize, f: fn(f32, f32) -> f32, start: f32| {
            Vec3A::from_array(std::array::from_fn(|axis| self.planes[axis][side].into_iter().fold(start, f)))
        };
        Bounds { lower: fold(0, f32::min, NOWHERE), upper: fold(1, f32::max, -NOWHERE) }
    }
}

impl Leaf {
    const EMPTY: Self = Self {
        vertices: [[[0; WIDTH]; 3]; 3],
        anchor: [0.0; 3],
        step: SMALLEST_STEP,
        corners: [[0; 3]; WIDTH],
    };

    /// Whether it only makes room for vertices of the one before: no triangle has one corner.
    fn is_spare(&self) -> bool {
        self.corners[0] == [0; 3]
    }

    /// Rounds the vertices to a grid over their box, and returns the box.
    fn fit(&mut self, positions: &[[f64; 3]], frame: &Frame) -> Bounds {
        if self.is_spare() {
            return Bounds::EMPTY;
        }
        // Vertices come in the order in which corners name them first.
        let count = 1 + usize::from(self.corners.as_flattened().iter().copied().max().unwrap_or(0));
        let mut places = [DVec3::ZERO; 3 * WIDTH];
        let (mut lower, mut upper) = (DVec3::INFINITY, DVec3::NEG_INFINITY);
        for (place, &position) in places.iter_mut().zip(&positions[..count]) {
            *place = frame.place(DVec3::from_array(position));
            (lower, upper) = (lower.min(*place), upper.max(*place));
        }
        let bounds = rounded_out(lower, upper);
        let Bounds { lower, upper } = bounds;
        // Rounded up, so that the box is within all steps.
        let step = ((upper - lower).max_element() / f32::from(u16::MAX)) * (1.0 + 2.0 * f32::EPSILON);
        (self.anchor, self.step) = (lower.to_array(), step.max(SMALLEST_STEP));
        let (anchor, step) = (DVec3::from_array(self.anchor.map(f64::from)), f64::from(self.step));
        // To the nearest: steps are not negative.
        let mut steps = [[0; 3]; 3 * WIDTH];
        for (steps, &place) in steps.iter_mut().zip(&places[..count]) {
            *steps = ((place - anchor) / step).to_array().map(|steps| (steps + 0.5) as u16);
        }
        for (lane, corners) in self.corners.iter().enumerate() {
            for (vertex, &corner) in corners.iter().enumerate() {
                for (axis, &steps) in steps[usize::from(corner)].iter().enumerate() {
                    self.vertices[vertex][axis][lane] = steps;
                }
            }
        }
        bounds
    }
}
