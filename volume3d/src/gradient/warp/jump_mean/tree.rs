//! Hierarchy of edges, by bounding boxes of their positions and of the directions from which they are
//! silhouettes.

use std::ops::Range;

use glam::DVec3;
use rayon::prelude::*;

use super::edge::{Cone, Edge, Rest};
use super::leaf::{LEAF, Leaf};
use super::node::{Bounds, Frame, Node, Query};
use super::parts::{Halving, Keys, apply, kinds};
use crate::lanes::{Instructions, Lanes, Task, WIDTH, next};

/// Hierarchy of edges.
#[derive(Clone, Debug, Default)]
pub(crate) struct Tree {
    nodes: Vec<Node>,
    /// Leaves of the hierarchy, followed by those of edges that are never silhouettes.
    leaves: Vec<Leaf>,
    /// Data of edges that leaves do not hold, [`LEAF`] for each leaf.
    rest: Vec<Rest>,
    frame: Frame,
    instructions: Instructions,
}

impl Tree {
    /// From edges that are needed from all viewpoints.
    pub(super) fn of_border(edges: Vec<Edge>) -> Self {
        Layout::of(edges, Bounds::from_everywhere).finish()
    }

    /// The edge of a slot.
    #[inline(always)]
    pub(super) fn edge(&self, slot: u32) -> Edge {
        let slot = slot as usize;
        self.leaves[slot / LEAF].edge(slot % LEAF, self.rest[slot])
    }

    /// Slots of all edges, in the order of the hierarchy.
    pub(super) fn slots(&self) -> impl Iterator<Item = u32> + '_ {
        let of = |(leaf, first): (&Leaf, u32)| first..first + leaf.len() as u32;
        self.leaves.iter().zip((0..).step_by(LEAF)).flat_map(of)
    }

    /// Number of edges.
    pub(super) fn len(&self) -> usize {
        self.leaves.iter().map(Leaf::len).sum()
    }

    /// Calls back with every edge that may count, among silhouettes or among other edges.
    pub(super) fn visit(&self, cone: &Cone<'_>, silhouettes: bool, mut f: impl FnMut(&Edge)) {
        if self.nodes.is_empty() {
            return;
        }
        let query = Query::new(cone, &self.frame);
        let mut descent = Descent::from_root();
        let step = Step { tree: self, cone, query: &query, silhouettes };
        while self.instructions.run((step, &mut descent)) {
            for &(first, mut entering) in &descent.found[..descent.count] {
                while entering != 0 {
                    f(&self.edge(first + next(&mut entering) as u32));
                }
            }
        }
    }
}

/// A hierarchy whose edges are in order and not yet in leaves.
pub(super) struct Layout {
    nodes: Vec<Node>,
    edges: Vec<Edge>,
    /// First edge of each leaf.
    leaves: Vec<u32>,
    frame: Frame,
}

impl Layout {
    /// From edges, and edges that are never silhouettes and appear only in the list.
    pub(super) fn new(edges: Vec<Edge>, flat: Vec<Edge>) -> Self {
        let mut layout = Self::of(edges, Bounds::around);
        let first = layout.edges.len();
        layout.leaves.extend((0..flat.len()).step_by(LEAF).map(|i| (first + i) as u32));
        layout.edges.extend(flat);
        layout
    }

    fn of(mut edges: Vec<Edge>, bounds: impl Fn(&[Edge]) -> Bounds + Copy) -> Self {
        let (low, high) = corners(edges.iter().flat_map(|e| e.places));
        let frame = Frame { middle: 0.5 * (low + high), unit: 1.0 / (high - low).max_element() };
        let parts = kinds(&mut edges, frame.unit);
        let mut order: Vec<u32> = (0..edges.len() as u32).collect();
        let halving = Halving { edges: &edges, unit: frame.unit };
        let plan = (!parts.is_empty()).then(|| Plan::new(halving, &mut order, parts, &mut vec![]));
        apply(order, &mut edges);
        let mut layout = Self { nodes: vec![], edges, leaves: vec![], frame };
        if let Some(plan) = plan {
            layout.node(plan, bounds);
        }
        layout
    }

    /// Appends a node and its descendants; returns its index.
    fn node(&mut self, plan: Plan, bounds: impl Fn(&[Edge]) -> Bounds + Copy) -> u32 {
        let index = self.nodes.len();
        let bounded = plan.children.iter().map(|(part, _)| bounds(&self.edges[part.clone()]));
        let node = Node::new(bounded, &self.frame);
        self.nodes.push(node);
        let mut pairs = vec![];
        for (lane, (part, below)) in plan.children.into_iter().enumerate() {
            let leaf = self.leaves.len() as u32;
            self.nodes[index].child[lane] = match below {
                Below::Node(below) => self.node(below, bounds),
                Below::Pair => {
                    self.leaves.extend([part.start as u32, (part.start + LEAF) as u32]);
                    pairs.push((lane, leaf, part));
                    continue;
                }
                Below::Leaf => {
                    self.leaves.push(part.start as u32);
                    leaf | IS_LEAF
                }
            };
        }
        for pairs in pairs.chunks(GROUPS) {
            let shared = self.nodes.len();
            let halves = pairs.iter().flat_map(|(_, _, part)| {
                [part.start..part.start + LEAF, part.start + LEAF..part.end]
                    .map(|half| bounds(&self.edges[half]))
            });
            let mut node = Node::new(halves, &self.frame);
            for (group, &(lane, leaf, _)) in pairs.iter().enumerate() {
                (node.child[2 * group], node.child[2 * group + 1]) = (leaf | IS_LEAF, (leaf + 1) | IS_LEAF);
                self.nodes[index].child[lane] = shared as u32 | ((GROUPS + group) as u32) << GROUP_SHIFT;
            }
            self.nodes.push(node);
        }
        index as u32
    }

    /// All edges with their slots, in the order of the hierarchy.
    pub(super) fn slots(&self) -> impl Iterator<Item = (u32, &Edge)> {
        let ends = self.leaves[1.min(self.leaves.len())..].iter().copied().chain([self.edges.len() as u32]);
        let parts =
            self.leaves.iter().zip(ends).map(|(&start, end)| &self.edges[start as usize..end as usize]);
        parts.zip((0..).step_by(LEAF)).flat_map(|(part, first)| (first..).zip(part))
    }

    /// The edge of a slot.
    pub(super) fn edge(&self, slot: u32) -> &Edge {
        &self.edges[self.leaves[slot as usize / LEAF] as usize + slot as usize % LEAF]
    }

    /// Puts edges into leaves, from the last on, and frees their table on the way: both are large.
    pub(super) fn finish(self) -> Tree {
        let Self { nodes, mut edges, leaves: firsts, frame } = self;
        let mut leaves = Vec::with_capacity(firsts.len());
        let mut rest = Vec::with_capacity(LEAF * firsts.len());
        for first in firsts.into_iter().rev() {
            let part = &edges[first as usize..];
            leaves.push(Leaf::new(part));
            rest.extend((0..LEAF).rev().map(|lane| part.get(lane).map_or(Rest::NONE, Rest::of)));
            edges.truncate(first as usize);
            if edges.len() < edges.capacity() / 8 * 7 {
                edges.shrink_to_fit();
            }
        }
        leaves.reverse();
        rest.reverse();
        Tree { nodes, leaves, rest, frame, instructions: Instructions::detect() }
    }
}

/// Layout below a node: ranges of edges, and what they become.
struct Plan {
    children: Vec<(Range<usize>, Below)>,
}

/// Subtree of a range of edges.
enum Below {
    /// One leaf.
    Leaf,
    /// Two leaves, the first of which is full: a part of a node that several such pairs share.
    Pair,
    Node(Plan),
}

/// Number of edges from which on parts are planned in parallel.
const PARALLEL: usize = 1 << 14;

impl Plan {
    /// From adjacent ranges of edges in an order, which is sorted.
    fn new(halving: Halving<'_>, order: &mut [u32], parts: Vec<Range<usize>>, keys: &mut Keys) -> Self {
        let start = parts[0].start;
        let parts = split(halving, order, parts, keys);
        let below = |(part, order): (Range<usize>, &mut [u32]), keys: &mut Keys| {
            let below = match part.len() {
                0..=LEAF => Below::Leaf,
                n if n <= 2 * LEAF => {
                    halving.halve(order, keys);
                    Below::Pair
                }
                _ => Below::Node(Self::new(halving, order, vec![part.clone()], keys)),
            };
            (part, below)
        };
        let is_large = order.len() > PARALLEL;
        let (mut slices, mut left, mut from) = (vec![], order, start);
        for part in parts {
            let (own, others) = left.split_at_mut(part.end - from);
            (left, from) = (others, part.end);
            slices.push((part, own));
        }
        let children = if is_large {
            slices.into_par_iter().map(|slice| below(slice, &mut vec![])).collect()
        } else {
            slices.into_iter().map(|slice| below(slice, keys)).collect()
        };
        Self { children }
    }
}

/// Up to eight ranges, by repeated halving of what an order has from the first on.
fn split(
    halving: Halving<'_>,
    order: &mut [u32],
    mut parts: Vec<Range<usize>>,
    keys: &mut Keys,
) -> Vec<Range<usize>> {
    let start = parts[0].start;
    while parts.len() < WIDTH {
        let largest = (0..parts.len()).max_by_key(|&i| parts[i].len()).filter(|&i| parts[i].len() > LEAF);
        let Some(largest) = largest else { break };
        let part = parts[largest].clone();
        let middle = part.start + halving.halve(&mut order[part.start - start..part.end - start], keys);
        parts[largest] = part.start..middle;
        parts.insert(largest + 1, middle..part.end);
    }
    parts
}

/// State of a query.
struct Descent {
    /// Nodes still to be descended from, with bit masks of their entered children.
    stack: [(u32, u32); DEPTH],
    height: usize,
    /// Leaves with edges that may count: slot of the first edge, and bit mask.
    found: [(u32, u32); WIDTH],
    count: usize,
    begun: bool,
}

impl Descent {
    fn from_root() -> Self {
        Self { stack: [(0, 0); DEPTH], height: 0, found: [(0, 0); WIDTH], count: 0, begun: false }
    }
}

/// Advances to the next node with leaves in which edges may count; returns whether there is one.
#[derive(Clone, Copy)]
struct Step<'a> {
    tree: &'a Tree,
    cone: &'a Cone<'a>,
    query: &'a Query,
    silhouettes: bool,
}

impl Task for (Step<'_>, &mut Descent) {
    type Output = bool;

    /// All children of a node are tested before one of them is descended into; the tests are independent.
    #[inline(always)]
    fn run<L: Lanes>(self, lanes: L) -> bool {
        let (step, descent) = self;
        step.advance(lanes, descent)
    }
}

impl Step<'_> {
    #[inline(always)]
    fn advance<L: Lanes>(self, lanes: L, descent: &mut Descent) -> bool {
        let Step { tree, query, .. } = self;
        if !descent.begun {
            descent.begun = true;
            descent.stack[0] = (0, query.entered(lanes, &tree.nodes[0]));
            descent.height = 1;
        }
        descent.count = 0;
        while descent.count == 0 {
            if descent.height == 0 {
                return false;
            }
            descent.height -= 1;
            let (node, mut entered) = descent.stack[descent.height];
            let node = &tree.nodes[node as usize];
            while entered != 0 {
                let child = node.child[next(&mut entered)];
                // Branchless in the results.
                if child & IS_LEAF == 0 {
                    let (index, lanes_of) = (child & INDEX, LANES_OF[(child >> GROUP_SHIFT) as usize]);
                    let entered = query.entered(lanes, &tree.nodes[index as usize]) & lanes_of;
                    descent.stack[descent.height] = (index, entered);
                    descent.height += usize::from(entered != 0);
                } else {
                    self.look_in(lanes, child ^ IS_LEAF, descent);
                }
            }
        }
        true
    }

    /// Appends a leaf with edges that may count.
    #[inline(always)]
    fn look_in<L: Lanes>(self, lanes: L, leaf: u32, descent: &mut Descent) {
        let entering = self.tree.leaves[leaf as usize].entering(lanes, self.cone, self.silhouettes);
        let first = LEAF as u32 * leaf;
        descent.found[descent.count] = (first, entering);
        descent.count += usize::from(entering != 0);
        let mut ahead = entering;
        while ahead != 0 {
            fetch(lanes, &self.tree.rest[first as usize + next(&mut ahead)]);
        }
    }
}

/// Prefetches a value.
#[inline(always)]
fn fetch<L: Lanes, T>(lanes: L, what: &T) {
    let start = std::ptr::from_ref(what).cast::<i8>();
    for line in 0..size_of::<T>().div_ceil(LINE) {
        lanes.prefetch(start.wrapping_add(LINE * line));
    }
}

/// Bytes of a cache line.
const LINE: usize = 64;

/// Bit that marks leaves.
const IS_LEAF: u32 = 1 << 31;

/// Pairs of leaves that a node has room for.
const GROUPS: usize = WIDTH / 2;
/// A child that is a node is its index, and above that which of its lanes are the child's.
const GROUP_SHIFT: u32 = 28;
const INDEX: u32 = (1 << GROUP_SHIFT) - 1;
/// All of them, or those of one pair.
const LANES_OF: [u32; 2 * GROUPS] = [u32::MAX, 0, 0, 0, 0b11, 0b11 << 2, 0b11 << 4, 0b11 << 6];

/// Dividing 2³² edges by eight takes 11 levels, each of which leaves seven nodes on the stack.
const DEPTH: usize = 96;

fn corners(points: impl Iterator<Item = DVec3>) -> (DVec3, DVec3) {
    points.fold((DVec3::INFINITY, DVec3::NEG_INFINITY), |(low, high), p| (low.min(p), high.max(p)))
}
