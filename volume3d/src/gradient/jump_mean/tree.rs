//! Edges in a hierarchy of boxes of their places and of the directions that see them as silhouettes.

use std::ops::Range;

use glam::DVec3;

use super::edge::{Cone, Edge};
use super::leaf::{LEAF, Leaf};
use super::node::{Bounds, Frame, Node, Query};
use super::parts::{Order, kinds};
use crate::lanes::{Instructions, Lanes, Task, WIDTH, next};

/// Edges in a hierarchy.
#[derive(Clone, Debug, Default)]
pub(crate) struct Tree {
    nodes: Vec<Node>,
    leaves: Vec<Leaf>,
    /// Those in the hierarchy, and after them those that are silhouettes from nowhere.
    edges: Vec<Edge>,
    frame: Frame,
    instructions: Instructions,
}

impl Tree {
    /// Of edges, and of those that are silhouettes from nowhere, which are in its list only.
    pub(super) fn new(edges: Vec<Edge>, flat: Vec<Edge>) -> Self {
        let mut tree = Self::of(edges, Bounds::around);
        tree.edges.extend(flat);
        tree
    }

    /// Of edges that are looked up from everywhere.
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

    /// Appends a node, and all below it; returns its index.
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

    /// Appends a leaf; returns its index, as that of no node.
    fn leaf(&mut self, range: Range<usize>) -> u32 {
        self.leaves.push(Leaf::new(&self.edges[range.clone()], range.start));
        (self.leaves.len() - 1) as u32 | IS_LEAF
    }

    /// All edges, in the order of the hierarchy.
    pub(super) fn edges(&self) -> &[Edge] {
        &self.edges
    }

    /// Calls with every edge that may count: of silhouettes, or of edges that are none.
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

/// What is below a node: parts of all edges, with what is below them unless they are leaves.
struct Plan {
    children: Vec<(Range<usize>, Option<Plan>)>,
}

impl Plan {
    /// Of parts of edges, which are put in order.
    fn new(order: &mut Order, parts: Vec<Range<usize>>) -> Self {
        let parts = split(order, parts);
        let below = |part: Range<usize>| {
            let plan = (part.len() > LEAF).then(|| Self::new(order, vec![part.clone()]));
            (part, plan)
        };
        Self { children: parts.into_iter().map(below).collect() }
    }
}

/// The same in up to eight parts, each half of one before it.
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

/// How far a query has come.
struct Descent {
    /// Nodes that are still to be gone down from, with their children that are entered, as bits.
    stack: [(u32, u32); DEPTH],
    height: usize,
    /// Leaves with edges that may count: the place of the first of them among all edges, and bits.
    found: [(u32, u32); WIDTH],
    count: usize,
    begun: bool,
}

impl Descent {
    fn from_root() -> Self {
        Self { stack: [(0, 0); DEPTH], height: 0, found: [(0, 0); WIDTH], count: 0, begun: false }
    }
}

/// Goes on to the next node with leaves in which edges may count; whether there is one.
#[derive(Clone, Copy)]
struct Step<'a> {
    tree: &'a Tree,
    cone: &'a Cone<'a>,
    query: &'a Query,
    silhouettes: bool,
}

impl Task for (Step<'_>, &mut Descent) {
    type Output = bool;

    /// All children of a node are compared before one of them is gone down from, and none of that waits for what becomes of another.
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
                // No branch depends on what is found.
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

/// Asks for something ahead of time.
#[inline(always)]
fn fetch<L: Lanes, T>(lanes: L, what: &T) {
    let start = std::ptr::from_ref(what).cast::<i8>();
    for line in 0..size_of::<T>().div_ceil(LINE) {
        lanes.prefetch(start.wrapping_add(LINE * line));
    }
}

/// What a cache line holds, in bytes.
const LINE: usize = 64;

/// Tells leaves from nodes.
const IS_LEAF: u32 = 1 << 31;

/// Splitting 2³² edges in eight takes 11 steps, each of which leaves seven nodes behind.
const DEPTH: usize = 96;

fn corners(points: impl Iterator<Item = DVec3>) -> (DVec3, DVec3) {
    points.fold((DVec3::INFINITY, DVec3::NEG_INFINITY), |(low, high), p| (low.min(p), high.max(p)))
}
