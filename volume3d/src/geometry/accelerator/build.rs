//! Binary hierarchy by the surface area heuristic with binning.
//!
//! Wald, *On fast Construction of SAH-based Bounding Volume Hierarchies* (2007). Halves are built in
//! parallel, and every choice depends only on the range of triangles, so the tree does not depend on the
//! number of threads.

use std::ops::Range;

use glam::Vec3A;
use rayon::prelude::*;

use super::collapse::Plan;
use crate::lanes::WIDTH;

/// Bins of an axis.
const BINS: usize = 16;
/// Size above which a range is binned by several threads.
const SHARED: usize = 1 << 14;
/// Depth below which ranges are halved by number, which bounds the depth for any input.
const DEEPEST: usize = 64;
/// Ranges of this size are not divided. Smaller ones would give leaves more choice, at a higher cost.
const SMALLEST: usize = 2;

/// A box, in the frame.
#[derive(Clone, Copy, Debug)]
pub(super) struct Bounds {
    pub(super) lower: Vec3A,
    pub(super) upper: Vec3A,
}

impl Bounds {
    pub(super) const EMPTY: Self = Self { lower: Vec3A::INFINITY, upper: Vec3A::NEG_INFINITY };

    pub(super) fn union(self, other: Self) -> Self {
        Self { lower: self.lower.min(other.lower), upper: self.upper.max(other.upper) }
    }

    /// Half the surface area; 0 if empty.
    pub(super) fn area(self) -> f32 {
        let size = (self.upper - self.lower).max(Vec3A::ZERO);
        size.x * size.y + size.y * size.z + size.z * size.x
    }
}

/// The bounding box of a triangle.
#[derive(Clone, Copy, Debug)]
pub(super) struct Reference {
    pub(super) bounds: Bounds,
    pub(super) triangle: u32,
}

impl Reference {
    /// Twice the centre of the box.
    fn centre(&self) -> Vec3A {
        self.bounds.lower + self.bounds.upper
    }
}

/// Node of the binary hierarchy: a range of references and, unless it is small, its two halves.
pub(super) struct Binary {
    first: u32,
    count: u32,
    pub(super) halves: Option<Box<[Binary; 2]>>,
    plan: Plan,
}

impl Binary {
    /// Range in the array of references.
    pub(super) fn range(&self) -> Range<usize> {
        self.first as usize..(self.first + self.count) as usize
    }

    /// Whether its triangles form one leaf.
    pub(super) fn is_leaf(&self) -> bool {
        self.plan.is_leaf()
    }

    /// Children of a node of the wide hierarchy, at most eight.
    pub(super) fn children(&self) -> Vec<&Self> {
        let mut children = Vec::with_capacity(WIDTH);
        self.gather(WIDTH, &mut children);
        children
    }

    fn gather<'a>(&'a self, count: usize, children: &mut Vec<&'a Self>) {
        let share = self.plan.share(count);
        match &self.halves {
            Some(halves) if share > 0 => {
                halves[0].gather(share, children);
                halves[1].gather(count - share, children);
            }
            _ if count > 1 => self.gather(count - 1, children),
            _ => children.push(self),
        }
    }
}

/// Bounds of a range of references.
#[derive(Clone, Copy)]
struct Extent {
    bounds: Bounds,
    /// Bounds of the centres.
    centres: Bounds,
}

impl Extent {
    const EMPTY: Self = Self { bounds: Bounds::EMPTY, centres: Bounds::EMPTY };

    fn add(&mut self, reference: &Reference) {
        let centre = reference.centre();
        self.bounds = self.bounds.union(reference.bounds);
        self.centres = self.centres.union(Bounds { lower: centre, upper: centre });
    }

    fn union(self, other: Self) -> Self {
        Self { bounds: self.bounds.union(other.bounds), centres: self.centres.union(other.centres) }
    }
}

/// A fold over references, by several threads if there are many. `union` is exact and commutative, so that
/// the result is the same for any partition.
fn fold<T: Copy + Send + Sync>(
    references: &[Reference],
    empty: T,
    add: impl Fn(&mut T, &Reference) + Sync,
    union: impl Fn(T, T) -> T + Send + Sync,
) -> T {
    let sum = |references: &[Reference]| {
        let mut sum = empty;
        references.iter().for_each(|reference| add(&mut sum, reference));
        sum
    };
    if references.len() <= SHARED {
        sum(references)
    } else {
        references.par_chunks(SHARED).map(sum).reduce(|| empty, union)
    }
}

/// Builds the hierarchy and sorts `references` into the order of its leaves.
pub(super) fn build(references: &mut [Reference]) -> Binary {
    let extent = fold(references, Extent::EMPTY, Extent::add, Extent::union);
    divide(references, 0, extent, 0)
}

/// Divides a range, which starts at `first`, at the bin of least cost, or in the middle if all centres
/// coincide or the tree is deep.
fn divide(references: &mut [Reference], first: usize, extent: Extent, depth: usize) -> Binary {
    let count = references.len();
    let halves = (count > SMALLEST).then(|| {
        let split = (depth < DEEPEST).then(|| best_split(references, &extent)).flatten();
        let middle = match split {
            Some(split) => partition(references, |reference| split.is_left(reference)),
            None => count / 2,
        };
        let (left, right) = references.split_at_mut(middle);
        let half = |references: &mut [Reference], first| {
            let extent = fold(references, Extent::EMPTY, Extent::add, Extent::union);
            divide(references, first, extent, depth + 1)
        };
        let (left, right) = if count > SHARED {
            rayon::join(|| half(left, first), || half(right, first + middle))
        } else {
            (half(left, first), half(right, first + middle))
        };
        Box::new([left, right])
    });
    let plan =
        Plan::new(extent.bounds.area(), count, halves.as_ref().map(|h| h.each_ref().map(|half| &half.plan)));
    Binary { first: first as u32, count: count as u32, halves, plan }
}

/// Map from centres to bins.
#[derive(Clone, Copy)]
struct Binning {
    lower: Vec3A,
    scale: Vec3A,
}

impl Binning {
    fn new(centres: Bounds) -> Self {
        let size = centres.upper - centres.lower;
        // Flat directions have one bin. The product with the size can round up to BINS: bins are clamped.
        let scale = Vec3A::select(size.cmpgt(Vec3A::ZERO), BINS as f32 / size, Vec3A::ZERO);
        let scale = Vec3A::select(scale.is_finite_mask(), scale, Vec3A::ZERO);
        Self { lower: centres.lower, scale }
    }

    fn bins(&self, reference: &Reference) -> [usize; 3] {
        let place = (reference.centre() - self.lower) * self.scale;
        place.to_array().map(|x| (x as usize).min(BINS - 1))
    }
}

struct Split {
    binning: Binning,
    axis: usize,
    /// First bin of the right side.
    bin: usize,
}

impl Split {
    fn is_left(&self, reference: &Reference) -> bool {
        self.binning.bins(reference)[self.axis] < self.bin
    }
}

/// Contents of a bin.
#[derive(Clone, Copy)]
struct Bin {
    bounds: Bounds,
    count: u32,
}

impl Bin {
    const EMPTY: Self = Self { bounds: Bounds::EMPTY, count: 0 };

    fn union(self, other: Self) -> Self {
        Self { bounds: self.bounds.union(other.bounds), count: self.count + other.count }
    }

    /// Surface area times number.
    fn cost(&self) -> f32 {
        self.bounds.area() * self.count as f32
    }
}

type Bins = [[Bin; BINS]; 3];

/// The split of least cost with nonempty sides.
fn best_split(references: &[Reference], extent: &Extent) -> Option<Split> {
    let binning = Binning::new(extent.centres);
    let add = |bins: &mut Bins, reference: &Reference| {
        for (axis, bin) in binning.bins(reference).into_iter().enumerate() {
            let bin = &mut bins[axis][bin];
            *bin = bin.union(Bin { bounds: reference.bounds, count: 1 });
        }
    };
    let union = |a: Bins, b: Bins| -> Bins {
        std::array::from_fn(|axis| std::array::from_fn(|i| a[axis][i].union(b[axis][i])))
    };
    let bins = fold(references, [[Bin::EMPTY; BINS]; 3], add, union);
    let mut best = None;
    for (axis, bins) in bins.iter().enumerate() {
        let mut right = [Bin::EMPTY; BINS];
        for i in (1..BINS).rev() {
            right[i - 1] = right[i].union(bins[i]);
        }
        let mut left = Bin::EMPTY;
        for i in 0..BINS - 1 {
            left = left.union(bins[i]);
            let cost = left.cost() + right[i].cost();
            let cheaper = best.as_ref().is_none_or(|&(least, _)| cost < least);
            if left.count > 0 && right[i].count > 0 && cheaper {
                best = Some((cost, Split { binning, axis, bin: i + 1 }));
            }
        }
    }
    best.map(|(_, split)| split)
}

/// Moves the references on the left to the front; returns their number.
fn partition(references: &mut [Reference], is_left: impl Fn(&Reference) -> bool) -> usize {
    let (mut start, mut end) = (0, references.len());
    while start < end {
        if is_left(&references[start]) {
            start += 1;
        } else {
            end -= 1;
            references.swap(start, end);
        }
    }
    start
}
