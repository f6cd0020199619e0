//! Streams of rays: each node or leaf is tested against all rays that meet it, one after the other.
//!
//! Rays need not have anything in common. Their tests are independent, and the data of a node are loaded once
//! for all of them. Streams answer occlusion queries only, as no order of nodes is best for all rays. The
//! filters of single rays reject or accept with certainty, and the exact test decides the rest.

use super::Accelerator;
use super::frame_rays::FrameRays;
use super::ray_filter::{BoxTest, TriangleTest};
use super::sheaf::{Goal, Sheaf};
use super::traverse::PENDING;
use super::tree::Link;
use super::watertight::{PACKET, Shear};
use crate::lanes::{Lanes, Task, WIDTH, next};

/// Rays of an occlusion query.
#[derive(Clone, Copy, Debug)]
pub struct Shadows<'a> {
    /// The rays.
    pub sheaf: &'a Sheaf,
    /// Their end, if it is one point.
    pub end: Option<&'a Goal<'a>>,
}

/// Sheaves of a stream.
pub(super) const SHEAVES: usize = 2;

/// Rays of a stream.
const RAYS: usize = SHEAVES * PACKET;

/// Number of rays below which they are traced individually.
const FEWEST: u32 = 3;

/// A pending link, and the bit mask of rays that meet its box.
#[derive(Clone, Copy)]
struct Waiting {
    link: Link,
    rays: u32,
}

impl Waiting {
    const NONE: Self = Self { link: Link::ROOT, rays: 0 };
}

impl Accelerator {
    /// Bit masks of rays that hit anything.
    pub(super) fn occluded_stream(
        &self,
        shadows: &[Shadows<'_>; SHEAVES],
        members: [u32; SHEAVES],
    ) -> [u32; SHEAVES] {
        let together = members.iter().map(|members| members.count_ones()).sum::<u32>() >= FEWEST;
        let (mut alone, mut occluded) = (members, [0; SHEAVES]);
        if together {
            (alone, occluded) = self.instructions.run(Start { accelerator: self, shadows, members });
        }
        for ((shadows, alone), occluded) in shadows.iter().zip(&mut alone).zip(&mut occluded) {
            while *alone != 0 {
                let at = next(alone) % PACKET;
                let hit = self.occluded_before(&shadows.sheaf.ray(at), shadows.sheaf.target(at));
                *occluded |= u32::from(hit) << at;
            }
        }
        occluded
    }
}

/// Rays before they start.
struct Start<'a> {
    accelerator: &'a Accelerator,
    shadows: &'a [Shadows<'a>; SHEAVES],
    members: [u32; SHEAVES],
}

impl Task for Start<'_> {
    /// Rays that must be traced individually, and those that hit anything.
    type Output = ([u32; SHEAVES], [u32; SHEAVES]);

    #[inline(always)]
    fn run<L: Lanes>(self, lanes: L) -> Self::Output {
        let Self { accelerator, shadows, members } = self;
        let mut stream = Stream { accelerator, shadows, rays: [FrameRays::NONE; SHEAVES], occluded: 0 };
        let (mut alone, mut traced) = ([0; SHEAVES], 0);
        for at in 0..SHEAVES {
            if members[at] == 0 {
                continue;
            }
            let rays = &mut stream.rays[at];
            rays.fill(&accelerator.frame, shadows[at].sheaf);
            alone[at] = members[at] & !rays.finite;
            traced |= (members[at] & rays.finite & rays.meeting) << (at * PACKET);
        }
        let pending = accelerator.tree.pending;
        if pending <= PENDING {
            stream.descend(lanes, traced, &mut [Waiting::NONE; PENDING]);
        } else {
            stream.descend(lanes, traced, &mut vec![Waiting::NONE; pending]);
        }
        let mut occluded = [0; SHEAVES];
        for (at, occluded) in occluded.iter_mut().enumerate() {
            *occluded = stream.occluded >> (at * PACKET) & ((1 << PACKET) - 1);
        }
        (alone, occluded)
    }
}

/// Rays under way.
struct Stream<'a> {
    accelerator: &'a Accelerator,
    shadows: &'a [Shadows<'a>; SHEAVES],
    rays: [FrameRays; SHEAVES],
    /// Bit mask of rays that hit something.
    occluded: u32,
}

impl Stream<'_> {
    #[inline(always)]
    fn descend<L: Lanes>(&mut self, lanes: L, members: u32, waiting: &mut [Waiting]) {
        let tree = &self.accelerator.tree;
        waiting[0] = Waiting { link: Link::ROOT, rays: members };
        let mut height = 1;
        while height > 0 {
            height -= 1;
            let Waiting { link, rays } = waiting[height];
            let rays = rays & !self.occluded;
            if rays == 0 {
                continue;
            }
            if link.is_leaf() {
                self.meet(lanes, link, rays);
                continue;
            }
            let node = &tree.nodes[link.index()];
            // By ray, the children that it enters.
            let mut entered = [0; RAYS];
            let (mut any, mut left) = (0, rays);
            while left != 0 {
                let place = next(&mut left) % RAYS;
                let (rays, at) = (&self.rays[place / PACKET], place % PACKET);
                let (children, _) = BoxTest::beside(lanes, rays, at).entered(node, rays.far[at]);
                any |= children;
                entered[place] = children as u8;
            }
            let by_child = lanes.by_bit(&entered);
            while any != 0 {
                let child = next(&mut any) % WIDTH;
                let link = node.children[child];
                tree.prefetch(lanes, link);
                waiting[height] = Waiting { link, rays: by_child[child] };
                height += 1;
            }
        }
    }

    /// Records the rays that hit a triangle of a leaf.
    #[inline(always)]
    fn meet<L: Lanes>(&mut self, lanes: L, link: Link, mut rays: u32) {
        let tree = &self.accelerator.tree;
        let leaf = &tree.leaves[link.index()];
        let triangles = tree.triangles(link);
        while rays != 0 {
            let bit = next(&mut rays);
            let (shadows, at) = (&self.shadows[bit / PACKET % SHEAVES], bit % PACKET);
            let rays = &self.rays[bit / PACKET % SHEAVES];
            let test = TriangleTest::beside(lanes, rays, at);
            let filtered = test.filtered(leaf, rays.far[at]);
            // Most candidates are the triangle that a ray leaves: it is removed before any branch depends on
            // them.
            let left_out = [shadows.sheaf.from[at], shadows.sheaf.target[at]];
            let candidates = filtered.candidates & link.mask() & but(lanes, triangles, left_out);
            if candidates != 0 {
                let certain = test.certain(&filtered) & candidates;
                let hit = certain != 0 || self.crosses(shadows.sheaf, at, link, candidates);
                self.occluded |= u32::from(hit) << bit;
            }
        }
    }

    /// Exact test of a ray against some triangles of a leaf: whether it hits one of them.
    #[inline(always)]
    fn crosses(&self, sheaf: &Sheaf, at: usize, leaf: Link, mut lanes: u32) -> bool {
        let Some(shear) = Shear::new(sheaf.origin(at), sheaf.direction(at)) else { return false };
        while lanes != 0 {
            let corners = self.accelerator.tree.corners(leaf, next(&mut lanes));
            let within = |x: f64| sheaf.near < x && x < sheaf.far[at];
            if shear.intersect(corners).is_some_and(|crossing| within(crossing.distance)) {
                return true;
            }
        }
        false
    }
}

/// Bit mask of all triangles but two. Branchless: the lanes are compared in SIMD.
#[inline(always)]
fn but<L: Lanes>(lanes: L, triangles: &[u32; WIDTH], [a, b]: [u32; 2]) -> u32 {
    let mut others = [0.0; WIDTH];
    for (other, &triangle) in others.iter_mut().zip(triangles) {
        *other = if (triangle == a) | (triangle == b) { 0.0 } else { 1.0 };
    }
    lanes.less_equal(lanes.splat(1.0), lanes.load(&others))
}
