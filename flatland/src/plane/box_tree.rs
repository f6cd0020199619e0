//! Bounding-volume hierarchy of axis-aligned boxes in the plane.
//!
//! The same structure serves visible triangles, edges for distance queries and the faces of the exact
//! arrangement: each caller supplies its own primitive test as a closure.

use glam::DVec2;

use super::orient;

/// An axis-aligned box, closed on every side.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Aabb {
    pub(crate) min: DVec2,
    pub(crate) max: DVec2,
}

impl Aabb {
    pub(crate) const EMPTY: Self =
        Self { min: DVec2::splat(f64::INFINITY), max: DVec2::splat(f64::NEG_INFINITY) };

    pub(crate) fn of(points: impl IntoIterator<Item = DVec2>) -> Self {
        points.into_iter().fold(Self::EMPTY, |b, p| Self { min: b.min.min(p), max: b.max.max(p) })
    }

    pub(crate) fn union(self, other: Self) -> Self {
        Self { min: self.min.min(other.min), max: self.max.max(other.max) }
    }

    pub(crate) fn contains(&self, p: DVec2) -> bool {
        p.cmpge(self.min).all() && p.cmple(self.max).all()
    }

    pub(crate) fn overlaps(&self, other: &Self) -> bool {
        self.min.cmple(other.max).all() && other.min.cmple(self.max).all()
    }

    pub(crate) fn distance_squared(&self, p: DVec2) -> f64 {
        (self.min - p).max(p - self.max).max(DVec2::ZERO).length_squared()
    }

    /// The parameter t ≥ 0 at which the ray with reciprocal direction `slope` enters the box; `None` if it
    /// misses. Rounding never turns a hit into a miss: the exit is rounded up by three units in the last
    /// place (Ize 2013).
    fn entered_at(&self, origin: DVec2, slope: DVec2) -> Option<f64> {
        let (a, b) = ((self.min - origin) * slope, (self.max - origin) * slope);
        // 0 · ∞ = NaN indicates that the origin is on a side parallel to the ray: inside, so no limit.
        let low = |a: f64, b: f64| if a.is_nan() || b.is_nan() { f64::NEG_INFINITY } else { a.min(b) };
        let high = |a: f64, b: f64| if a.is_nan() || b.is_nan() { f64::INFINITY } else { a.max(b) };
        let enter = low(a.x, b.x).max(low(a.y, b.y)).max(0.0);
        let leave = high(a.x, b.x).min(high(a.y, b.y)) * (1.0 + 6.0 * f64::EPSILON);
        (enter <= leave).then_some(enter)
    }

    fn half_perimeter(&self) -> f64 {
        let e = self.max - self.min;
        (e.x + e.y).max(0.0)
    }
}

/// A node: a box over the primitives `first .. first + count` when `count > 0`, otherwise over
/// the two nodes `first` and `first + 1`.
#[derive(Clone, Copy, Debug)]
struct Node {
    bounds: Aabb,
    first: u32,
    count: u32,
    /// The largest primitive index below, which is the topmost in painter's order.
    last: u32,
}

/// The hierarchy over primitives `0 .. n`.
#[derive(Clone, Debug, Default)]
pub(crate) struct BoxTree {
    nodes: Vec<Node>,
    order: Vec<u32>,
}

const LEAF: usize = 4;
const BINS: usize = 12;
/// Deeper than any tree of 2³² primitives that splits by the surface-area heuristic or, where that cannot
/// split, in halves.
const STACK: usize = 128;

impl BoxTree {
    /// Builds the tree by the binned surface-area heuristic (Wald 2007), with perimeters for areas.
    pub(crate) fn build(boxes: &[Aabb]) -> Self {
        let mut order: Vec<u32> = (0..u32::try_from(boxes.len()).expect("fewer than 2³² boxes")).collect();
        if boxes.is_empty() {
            return Self::default();
        }
        let root = Node { bounds: Aabb::EMPTY, first: 0, count: 0, last: 0 };
        let mut nodes = vec![root];
        let mut todo = vec![(0_usize, 0_usize, boxes.len(), 0_usize)];
        while let Some((node, start, end, depth)) = todo.pop() {
            let slice = &mut order[start..end];
            let bounds = slice.iter().fold(Aabb::EMPTY, |b, &i| b.union(boxes[i as usize]));
            let last = slice.iter().copied().max().unwrap_or(0);
            nodes[node] = Node { bounds, first: index(start), count: index(end - start), last };
            if end - start <= LEAF {
                continue;
            }
            // Beyond half the stack only halving keeps the depth bounded.
            let split = if depth < STACK / 2 { sah_split(boxes, slice) } else { None };
            let middle = start + split.unwrap_or_else(|| halve(boxes, slice));
            let children = nodes.len();
            nodes[node].first = index(children);
            nodes[node].count = 0;
            nodes.extend([root, root]);
            todo.push((children, start, middle, depth + 1));
            todo.push((children + 1, middle, end, depth + 1));
        }
        Self { nodes, order }
    }

    /// Calls `visit` with every primitive whose node passes `enter`, in a fixed order.
    pub(crate) fn visit(&self, enter: impl Fn(&Aabb) -> bool, mut visit: impl FnMut(usize)) {
        let mut stack = [0_u32; STACK];
        let mut depth = usize::from(!self.nodes.is_empty());
        while depth > 0 {
            depth -= 1;
            let node = &self.nodes[stack[depth] as usize];
            if !enter(&node.bounds) {
                continue;
            }
            if node.count > 0 {
                self.primitives(node).iter().for_each(|&i| visit(i as usize));
            } else {
                stack[depth] = node.first;
                stack[depth + 1] = node.first + 1;
                depth += 2;
            }
        }
    }

    /// The largest primitive index that `test` accepts among the boxes that contain `p`, with the result of
    /// the test. Branches that cannot contain a larger one are skipped.
    pub(crate) fn last_at<T>(
        &self,
        p: DVec2,
        mut test: impl FnMut(usize) -> Option<T>,
    ) -> Option<(usize, T)> {
        let mut best: Option<(usize, T)> = None;
        let mut stack = [0_u32; STACK];
        let mut depth = usize::from(!self.nodes.is_empty());
        while depth > 0 {
            depth -= 1;
            let node = &self.nodes[stack[depth] as usize];
            let beaten = best.as_ref().is_some_and(|(i, _)| *i >= node.last as usize);
            if beaten || !node.bounds.contains(p) {
                continue;
            }
            if node.count > 0 {
                for i in self.primitives(node).iter().map(|&i| i as usize) {
                    if best.as_ref().is_none_or(|(b, _)| i > *b)
                        && let Some(answer) = test(i)
                    {
                        best = Some((i, answer));
                    }
                }
            } else {
                let (a, b) = (node.first, node.first + 1);
                let a_last = self.nodes[a as usize].last > self.nodes[b as usize].last;
                stack[depth] = if a_last { b } else { a };
                stack[depth + 1] = if a_last { a } else { b };
                depth += 2;
            }
        }
        best
    }

    /// The smallest value of `distance_squared(i)` below `limit_squared`, if any, with its primitive.
    pub(crate) fn nearest(
        &self,
        p: DVec2,
        limit_squared: f64,
        mut distance_squared: impl FnMut(usize) -> f64,
    ) -> Option<(usize, f64)> {
        let mut best: Option<(usize, f64)> = None;
        let mut bound = limit_squared;
        if self.nodes.is_empty() {
            return None;
        }
        let mut stack = [(0_u32, 0.0_f64); STACK];
        stack[0] = (0, self.nodes[0].bounds.distance_squared(p));
        let mut depth = 1;
        while depth > 0 {
            depth -= 1;
            let (id, d) = stack[depth];
            if d >= bound {
                continue;
            }
            let node = &self.nodes[id as usize];
            if node.count > 0 {
                for &i in self.primitives(node) {
                    let d = distance_squared(i as usize);
                    if d < bound {
                        bound = d;
                        best = Some((i as usize, d));
                    }
                }
            } else {
                let children = [node.first, node.first + 1];
                let d = children.map(|c| self.nodes[c as usize].bounds.distance_squared(p));
                let far = usize::from(d[0] <= d[1]);
                stack[depth] = (children[far], d[far]);
                stack[depth + 1] = (children[1 - far], d[1 - far]);
                depth += 2;
            }
        }
        best
    }

    /// Passes `test` the primitives whose boxes the ray origin + t direction meets at 0 < t < limit, nearer
    /// boxes first. `test` returns the new limit, the parameter of the nearest hit so far.
    pub(crate) fn along(
        &self,
        origin: DVec2,
        direction: DVec2,
        mut limit: f64,
        mut test: impl FnMut(usize, f64) -> f64,
    ) {
        let slope = direction.recip();
        let enter = |id: u32| self.nodes[id as usize].bounds.entered_at(origin, slope);
        let mut stack = [(0_u32, 0.0_f64); STACK];
        let mut depth = usize::from(!self.nodes.is_empty() && enter(0).is_some());
        while depth > 0 {
            depth -= 1;
            let (id, t) = stack[depth];
            if t > limit {
                continue;
            }
            let node = &self.nodes[id as usize];
            if node.count > 0 {
                for &i in self.primitives(node) {
                    limit = test(i as usize, limit);
                }
                continue;
            }
            let mut push = |child: Option<(u32, f64)>| {
                if let Some(child) = child {
                    stack[depth] = child;
                    depth += 1;
                }
            };
            let [a, b] = [node.first, node.first + 1].map(|c| enter(c).map(|t| (c, t)));
            let a_is_nearer = a.is_some_and(|(_, a)| b.is_none_or(|(_, b)| a <= b));
            push(if a_is_nearer { b } else { a });
            push(if a_is_nearer { a } else { b });
        }
    }

    fn primitives(&self, node: &Node) -> &[u32] {
        &self.order[node.first as usize..(node.first + node.count) as usize]
    }
}

fn index(i: usize) -> u32 {
    u32::try_from(i).expect("fewer than 2³² nodes")
}

fn centre(b: &Aabb) -> DVec2 {
    0.5 * (b.min + b.max)
}

/// Partitions `slice` at the cheapest of [`BINS`] planes; `None` if a side would be empty.
#[expect(clippy::cast_possible_truncation, clippy::cast_sign_loss, reason = "clamped to the bins")]
fn sah_split(boxes: &[Aabb], slice: &mut [u32]) -> Option<usize> {
    let centres = Aabb::of(slice.iter().map(|&i| centre(&boxes[i as usize])));
    let extent = centres.max - centres.min;
    let mut best: Option<(f64, usize, usize)> = None;
    let bin_of = |axis: usize, i: u32| {
        let t = (centre(&boxes[i as usize])[axis] - centres.min[axis]) / extent[axis];
        ((t * BINS as f64) as usize).min(BINS - 1)
    };
    for axis in 0..2 {
        // Not "<= 0": a NaN or infinite extent cannot be binned either.
        if !(extent[axis] > 0.0 && extent[axis].is_finite()) {
            continue;
        }
        let mut bins = [(Aabb::EMPTY, 0_usize); BINS];
        for &i in slice.iter() {
            let bin = &mut bins[bin_of(axis, i)];
            *bin = (bin.0.union(boxes[i as usize]), bin.1 + 1);
        }
        let mut right = [(0.0, 0_usize); BINS];
        let mut acc = (Aabb::EMPTY, 0);
        for k in (1..BINS).rev() {
            acc = (acc.0.union(bins[k].0), acc.1 + bins[k].1);
            right[k] = (acc.0.half_perimeter() * acc.1 as f64, acc.1);
        }
        let mut acc = (Aabb::EMPTY, 0);
        for k in 1..BINS {
            acc = (acc.0.union(bins[k - 1].0), acc.1 + bins[k - 1].1);
            if acc.1 == 0 || right[k].1 == 0 {
                continue;
            }
            let cost = acc.0.half_perimeter() * acc.1 as f64 + right[k].0;
            if best.is_none_or(|(c, ..)| cost < c) {
                best = Some((cost, axis, k));
            }
        }
    }
    let (_, axis, k) = best?;
    let mut left = 0;
    for j in 0..slice.len() {
        if bin_of(axis, slice[j]) < k {
            slice.swap(left, j);
            left += 1;
        }
    }
    Some(left)
}

/// Partitions `slice` into equal halves along the longer axis.
fn halve(boxes: &[Aabb], slice: &mut [u32]) -> usize {
    let centres = Aabb::of(slice.iter().map(|&i| centre(&boxes[i as usize])));
    let extent = centres.max - centres.min;
    let axis = usize::from(extent.y > extent.x);
    let middle = slice.len() / 2;
    slice.select_nth_unstable_by(middle, |&a, &b| {
        let key = |i: u32| centre(&boxes[i as usize])[axis];
        key(a).total_cmp(&key(b)).then(a.cmp(&b))
    });
    middle
}

/// Largest number of parts into which a triangle's box is split.
const PARTS: usize = 16;

/// Boxes that together cover a triangle: one, or for a diagonal sliver several along it (Ernst and Greiner
/// 2007). A densely sampled outline consists of slivers, whose whole boxes would all overlap.
pub(crate) fn part_boxes(triangle: [DVec2; 3]) -> impl Iterator<Item = Aabb> {
    let whole = Aabb::of(triangle);
    let size = whole.max - whole.min;
    let area = 0.5 * orient(triangle[0], triangle[1], triangle[2]);
    // A box divided into k strips along a diagonal sliver retains 1/k of its area.
    let excess = (size.x * size.y / (4.0 * area)).min(PARTS as f64);
    let (parts, axis) = (excess.max(1.0) as usize, usize::from(size.y > size.x));
    (0..parts).map(move |k| {
        if parts == 1 {
            return whole;
        }
        let side = |k: usize| whole.min[axis] + size[axis] * (k as f64 / parts as f64);
        let (low, high) = (side(k), if k + 1 == parts { whole.max[axis] } else { side(k + 1) });
        let mut part = Aabb::EMPTY;
        for i in 0..3 {
            let (p, q) = (triangle[i], triangle[(i + 1) % 3]);
            // Extent of the edge within the strip, from its end points and its crossings.
            let clamp = |x: f64| ((x - p[axis]) / (q[axis] - p[axis])).clamp(0.0, 1.0);
            let touches = p[axis].min(q[axis]) <= high && p[axis].max(q[axis]) >= low;
            if touches && p[axis] == q[axis] {
                part = part.union(Aabb::of([p, q]));
            } else if touches {
                part = part.union(Aabb::of([low, high].map(|x| p + clamp(x) * (q - p))));
            }
        }
        // A margin of a few units in the last place: rounding must not uncover a point.
        let margin = 4.0 * f64::EPSILON * whole.min.abs().max(whole.max.abs());
        Aabb { min: part.min - margin, max: part.max + margin }
    })
}

#[cfg(test)]
mod tests;
