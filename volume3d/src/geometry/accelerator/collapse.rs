//! Conversion of the binary hierarchy to eight children per node, at least expected cost.
//!
//! Ylitie, Karras and Laine, *Efficient Incoherent Ray Traversal on GPUs Through Compressed Wide BVHs*
//! (2017), section 3: C(n, i) is the least cost of the triangles below n as at most i children of some node.
//! One child is a leaf, if the triangles are few, or a node whose eight children are divided between n's
//! halves; several are divided between the halves. Costs are surface areas, proportional to hit
//! probabilities.

use crate::lanes::WIDTH;

/// Cost of a leaf's eight triangles relative to a node's eight boxes.
pub(super) const LEAF_COST: f32 = 1.5;

/// Optimal choices below a node of the binary hierarchy.
#[derive(Clone, Copy)]
pub(super) struct Plan {
    /// C(n, i + 1).
    costs: [f32; WIDTH - 1],
    /// Number of i + 1 children assigned to the first half; 0 if fewer children are as good (for one: a
    /// leaf). The last entry is for the eight children of n itself.
    shares: [u8; WIDTH],
    leaf: bool,
}

impl Plan {
    /// Plan of a node with half surface area `area`, from those of its halves.
    pub(super) fn new(area: f32, count: usize, halves: Option<[&Self; 2]>) -> Self {
        let leaf_cost = if count <= WIDTH { LEAF_COST * area } else { f32::INFINITY };
        let mut plan = Self { costs: [leaf_cost; WIDTH - 1], shares: [0; WIDTH], leaf: true };
        let Some([left, right]) = halves else { return plan };
        let (left, right) = (&left.costs, &right.costs);
        // D(n, j): least cost of j children divided between the halves, and the left one's share.
        let divided = |children: usize| {
            let choices =
                (1..children).map(|share| (left[share - 1] + right[children - share - 1], share as u8));
            choices.fold((f32::INFINITY, 1), |best, choice| if choice.0 < best.0 { choice } else { best })
        };
        let (cost, share) = divided(WIDTH);
        plan.shares[WIDTH - 1] = share;
        plan.leaf = leaf_cost <= area + cost;
        plan.costs[0] = leaf_cost.min(area + cost);
        for children in 2..WIDTH {
            let (cost, share) = divided(children);
            let fewer = plan.costs[children - 2];
            plan.costs[children - 1] = cost.min(fewer);
            plan.shares[children - 1] = if cost < fewer { share } else { 0 };
        }
        plan
    }

    /// Whether the node's triangles form one leaf.
    pub(super) fn is_leaf(&self) -> bool {
        self.leaf
    }

    /// Number of `children` assigned to the first half; 0 if fewer children are as good.
    pub(super) fn share(&self, children: usize) -> usize {
        self.shares[children - 1].into()
    }
}
