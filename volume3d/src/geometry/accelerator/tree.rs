//! Memory layout of the hierarchy: nodes of eight boxes, leaves of up to eight triangles.
//!
//! Beyond the nearer caches, rays mostly wait for memory: the cost is the number of cache lines that a ray
//! touches, and touches sequentially. The filter therefore has three lines per leaf, prefetched when its box
//! is entered, and the exact test finds its part of a leaf at the same index, so that both are fetched at
//! once.

use glam::{DVec3, Vec3A};
use rayon::prelude::*;

use super::build::{Binary, Bounds, Reference};
use super::collapse::LEAF_COST;
use super::frame::Frame;
use super::{Mesh, rounded_out};
use crate::lanes::{Lanes, Row, Steps, WIDTH};

/// Bytes of a cache line.
const LINE: usize = 64;

/// A bound of an empty box: no depth lies above and below it, and products with reciprocals of slopes stay
/// ordered.
const NOWHERE: f32 = 1e30;

/// Largest number of vertices of a leaf: eight triangles connected by edges have at most ten. Leaves with
/// more occupy the space of several, no more than they have triangles.
const VERTICES: usize = WIDTH + 2;

/// Smallest width of a grid: far below a rounding unit of single precision, far above its denormals.
const SMALLEST_STEP: f32 = 1e-12;

/// An index without a vertex.
const NO_VERTEX: u32 = u32::MAX;

/// Boxes of eight children, in the frame.
#[derive(Clone, Debug)]
#[repr(align(64))]
pub(super) struct Node {
    /// By axis, the lower planes and the upper planes.
    pub(super) planes: [[Row; 2]; 3],
    pub(super) children: [Link; WIDTH],
}

/// Link to a child: a node, or a leaf with its number of triangles.
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

    /// Index of the node or leaf.
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

/// Up to eight triangles for the filter, in three cache lines: in the frame, rounded to a grid. Lanes past
/// the last repeat it.
#[derive(Clone, Debug)]
#[repr(C, align(64))]
pub(super) struct Leaf {
    /// By vertex and axis, steps from the anchor.
    pub(super) vertices: [[Steps; 3]; 3],
    /// Lower corner of the leaf's box.
    pub(super) anchor: [f32; 3],
    /// Width of the grid: along each axis a vertex is off by at most half of it.
    pub(super) step: f32,
    /// By triangle and vertex, indices into the leaf's positions.
    corners: [[u8; 3]; WIDTH],
}

/// Nodes in depth-first order, the root first, and leaves in the order in which they are reached.
#[derive(Clone, Debug)]
pub(super) struct Tree {
    pub(super) nodes: Vec<Node>,
    pub(super) leaves: Vec<Leaf>,
    /// Mesh indices of each leaf's triangles.
    pub(super) triangles: Vec<[u32; WIDTH]>,
    /// Mesh indices of leaves' vertices, each once per leaf, from [`VERTICES`] times the leaf's index on, or
    /// [`NO_VERTEX`].
    vertices: Vec<u32>,
    /// Positions of these vertices.
    positions: Vec<[f64; 3]>,
    /// Root of the mean of half the surface area of leaves.
    pub(super) leaf_size: f64,
    /// Median of that root over leaves, insensitive to a few large ones.
    pub(super) typical_leaf: f64,
    /// Largest number of links that a traversal stores.
    pub(super) pending: usize,
}

impl Tree {
    /// Lays out a hierarchy over `references` to triangles of a mesh, without positions: see
    /// [`fit`](Self::fit).
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

    /// Fits all boxes and grids to the mesh's positions. Returns the cost of the hierarchy: the surface area
    /// of all boxes relative to the root's, which is the expected number of boxes entered by a ray that meets
    /// the root's, with leaves weighted by their cost.
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

    /// Prefetches the target of a link: a node, or the filter's part of a leaf. Without a branch on the kind,
    /// which would be mispredicted.
    #[inline(always)]
    pub(super) fn prefetch<L: Lanes>(&self, lanes: L, link: Link) {
        let leaf = address(&self.leaves, link.index_of_leaf());
        let start = if link.is_leaf() { leaf } else { address(&self.nodes, link.0 as usize) };
        // A leaf has fewer lines: its last one is repeated.
        let last = if link.is_leaf() { size_of::<Leaf>() / LINE - 1 } else { size_of::<Node>() / LINE - 1 };
        for line in 0..size_of::<Node>() / LINE {
            lanes.prefetch(start.wrapping_add(LINE * line.min(last)));
        }
    }

    /// Prefetches the exact test's part of a leaf, which is far from the filter's part: otherwise a ray would
    /// wait for memory again. For a node, what has been prefetched before.
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

    /// Mesh indices of a leaf's triangles.
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

/// Address of an element, existing or not: nothing is read.
#[inline(always)]
fn address<T>(elements: &[T], index: usize) -> *const i8 {
    elements.as_ptr().cast::<i8>().wrapping_add(index * size_of::<T>())
}

/// A hierarchy during layout, in the order in which nodes and leaves are reached.
struct Layout<'a> {
    references: &'a [Reference],
    mesh: Mesh<'a>,
    tree: Tree,
}

impl Layout<'_> {
    /// Appends a node and its descendants; returns its depth.
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
            // Every lane from here on, so that unused ones repeat an existing triangle.
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

    /// Index of a vertex among those of the leaf that starts at `start`.
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

    /// The box around all children. Lanes without one have no effect.
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

    /// Whether it only provides space for vertices of the previous leaf: no triangle has one corner.
    fn is_spare(&self) -> bool {
        self.corners[0] == [0; 3]
    }

    /// Rounds the vertices to a grid over their box, and returns the box.
    fn fit(&mut self, positions: &[[f64; 3]], frame: &Frame) -> Bounds {
        if self.is_spare() {
            return Bounds::EMPTY;
        }
        // Vertices are in the order in which corners first refer to them.
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
