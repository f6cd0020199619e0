//! Hierarchy of edges, by bounding boxes of their positions and of the directions from which they are
//! silhouettes.

use std::ops::Range;

use glam::DVec3;

use super::edge::{Cone, Edge};
use super::leaf::{LEAF, Leaf};
use super::node::{Bounds, Frame, Node, Query};
use super::parts::{Order, kinds};
use crate::lanes::{Instructions, Lanes, Task, WIDTH, next};

/// Hierarchy of edges.
#[derive(Clone, Debug, Default)]
pub(crate) struct Tree {
    nodes: Vec<Node>,
    leaves: Vec<Leaf>,
    /// Edges in the hierarchy, followed by those that are never silhouettes.
    edges: Vec<Edge>,
    frame: Frame,
    instructions: Instructions,
}

impl Tree {
    /// From edges, and edges that are never silhouettes and appear only in the list.
    pub(super) fn new(edges: Vec<Edge>, flat: Vec<Edge>) -> Self {
        let mut tree = Self::of(edges, Bounds::around);
        tree.edges.extend(flat);
        tree
    }

    /// From edges that are needed from all viewpoints.
    pub(super) fn of_border(edges: Vec<Edge>) -> Self {
        Self::of(edges, Bounds::from_everywhere)
    }

    fn of(mut edges: Vec<Edge>, bounds: impl Fn(&[Edge]) -> Bounds + Copy) -> Self {
        let (low, high) = corners(edges.iter().flat_map(|e| e.places));
        let frame = Frame { middle: 0.5 * (low + high), unit: 1.0 / (high - low).max_element() };
        let parts = kinds(&mut edges, frame.unit);
        let mut order = Order::of(&edges, frame.unit);
        let plan = (!parts.is_empty()).then(|| Plan::new(&mut order, parts));
        order.apply(&mut edges);
        let instructions = Instructions::detect();
        let mut tree = Self { nodes: vec![], leaves: vec![], edges, frame, instructions };
        if let Some(plan) = plan {
            tree.node(plan, bounds);
        }
        tree
    }

    /// Appends a node and its descendants; returns its index.
    fn node(&mut self, plan: Plan, bounds: impl Fn(&[Edge]) -> Bounds + Copy) -> u32 {
        let index = self.nodes.len();
        let bounded = plan.children.iter().map(|(part, _)| bounds(&self.edges[part.clone()]));
        let node = Node::new(bounded, &self.frame);
        self.nodes.push(node);
        for (lane, (part, below)) in plan.children.into_iter().enumerate() {
            let child = match below {
                Some(below) => self.node(below, bounds),
                None => self.leaf(part),
            };
            self.nodes[index].child[lane] = child;
        }
        index as u32
    }

    /// Appends a leaf; returns its index, marked as a leaf.
    fn leaf(&mut self, range: Range<usize>) -> u32 {
        self.leaves.push(Leaf::new(&self.edges[range.clone()], range.start));
        (self.leaves.len() - 1) as u32 | IS_LEAF
    }

    /// All edges, in the order of the hierarchy.
    pub(super) fn edges(&self) -> &[Edge] {
        &self.edges
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
                    f(&self.edges[first as usize + next(&mut entering)]);
                }
            }
        }
    }
}

/// Layout below a node: ranges of edges, with their subdivision unless they are leaves.
struct Plan {
    children: Vec<(Range<usize>, Option<Plan>)>,
}

impl Plan {
    /// From ranges of edges, which are sorted.
    fn new(order: &mut Order, parts: Vec<Range<usize>>) -> Self {
        let parts = split(order, parts);
        let below = |part: Range<usize>| {
            let plan = (part.len() > LEAF).then(|| Self::new(order, vec![part.clone()]));
            (part, plan)
        };
        Self { children: parts.into_iter().map(below).collect() }
    }
}

/// Up to eight ranges, by repeated halving.
fn split(order: &mut Order, mut parts: Vec<Range<usize>>) -> Vec<Range<usize>> {
    while parts.len() < WIDTH {
        let largest = (0..parts.len()).max_by_key(|&i| parts[i].len()).filter(|&i| parts[i].len() > LEAF);
        let Some(largest) = largest else { break };
        let part = parts[largest].clone();
        let middle = order.halve(part.clone());
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
    /// Leaves with edges that may count: index of the first edge, and bit mask.
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
        let (Step { tree, cone, query, silhouettes }, descent) = self;
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
                    let entered = query.entered(lanes, &tree.nodes[child as usize]);
                    descent.stack[descent.height] = (child, entered);
                    descent.height += usize::from(entered != 0);
                } else {
                    let leaf = &tree.leaves[(child ^ IS_LEAF) as usize];
                    let entering = leaf.entering(lanes, cone, silhouettes);
                    descent.found[descent.count] = (leaf.first, entering);
                    descent.count += usize::from(entering != 0);
                    let mut ahead = entering;
                    while ahead != 0 {
                        fetch(lanes, &tree.edges[leaf.first as usize + next(&mut ahead)]);
                    }
                }
            }
        }
        true
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

/// Dividing 2³² edges by eight takes 11 levels, each of which leaves seven nodes on the stack.
const DEPTH: usize = 96;

fn corners(points: impl Iterator<Item = DVec3>) -> (DVec3, DVec3) {
    points.fold((DVec3::INFINITY, DVec3::NEG_INFINITY), |(low, high), p| (low.min(p), high.max(p)))
}
