//! A stream of rays through the hierarchy: a node or a leaf is tried with all rays that meet it, one after the other.
//!
//! Rays need nothing in common. Their tests do not wait for one another, and what a node needs is at hand for
//! all of them. Only whether anything is hit is asked: no order of nodes is best for all rays. What is refused and what is
//! certain is decided by the filters of single rays, and the rest by the exact test.

use super::Accelerator;
use super::frame_rays::FrameRays;
use super::sheaf::{Goal, Sheaf};
use super::traverse::{BoxTest, PENDING, TriangleTest};
use super::tree::{Link, Node};
use super::watertight::{PACKET, Shear};
use crate::lanes::{Lanes, Task, WIDTH, next};

/// Rays of which only whether they hit anything is asked.
#[derive(Clone, Copy, Debug)]
pub struct Shadows<'a> {
    /// The rays.
    pub sheaf: &'a Sheaf,
    /// Where they end, if that is one point.
    pub end: Option<&'a Goal<'a>>,
}

impl Shadows<'_> {
    /// A triangle that is never hit.
    #[inline(always)]
    fn target(&self) -> Option<u32> {
        self.end.and_then(|end| end.target)
    }
}

/// Sheaves of a stream.
pub(super) const SHEAVES: usize = 2;

/// Rows of rays of a stream.
const ROWS: usize = SHEAVES * PACKET / WIDTH;

/// With fewer rays than this, each goes alone.
const FEWEST: u32 = 3;

/// A link to be followed, and the rays that meet its box, as bits.
#[derive(Clone, Copy)]
struct Waiting {
    link: Link,
    rays: u32,
}

impl Waiting {
    const NONE: Self = Self { link: Link::ROOT, rays: 0 };
}

impl Accelerator {
    /// Which of some rays hit anything, as bits.
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
                let hit = self.occluded_before(&shadows.sheaf.ray(at), shadows.target());
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
    /// Rays that must go alone, and those that hit anything.
    type Output = ([u32; SHEAVES], [u32; SHEAVES]);

    #[inline(always)]
    fn run<L: Lanes>(self, lanes: L) -> Self::Output {
        let Self { accelerator, shadows, members } = self;
        let mut rays = [FrameRays::NONE; SHEAVES];
        let (mut alone, mut traced) = ([0; SHEAVES], 0);
        for at in 0..SHEAVES {
            if members[at] != 0 {
                rays[at].fill(&accelerator.frame, shadows[at].sheaf);
                alone[at] = members[at] & !rays[at].finite;
                traced |= (members[at] & rays[at].finite & rays[at].meeting) << (at * PACKET);
            }
        }
        let mut stream = Stream { accelerator, shadows, rays, occluded: 0 };
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

/// Rays on their way.
struct Stream<'a> {
    accelerator: &'a Accelerator,
    shadows: &'a [Shadows<'a>; SHEAVES],
    rays: [FrameRays; SHEAVES],
    /// The rays that hit something, as bits.
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
            let mut entered = [0; ROWS];
            let mut any = 0;
            for (row, entered) in entered.iter_mut().enumerate() {
                let mut rays = rays >> (row * WIDTH) & ((1 << WIDTH) - 1);
                while rays != 0 {
                    let lane = next(&mut rays) % WIDTH;
                    let children = self.entered(lanes, node, row * WIDTH + lane);
                    any |= children;
                    *entered |= u64::from(children) << (WIDTH * lane);
                }
            }
            for entered in &mut entered {
                *entered = transposed(*entered);
            }
            while any != 0 {
                let child = next(&mut any) % WIDTH;
                let mut rays = 0;
                for (row, entering) in entered.iter().enumerate() {
                    rays |= u32::from((entering >> (WIDTH * child)) as u8) << (row * WIDTH);
                }
                let link = node.children[child];
                tree.prefetch(lanes, link);
                waiting[height] = Waiting { link, rays };
                height += 1;
            }
        }
    }

    /// The children of a node that a ray enters, as bits.
    #[inline(always)]
    fn entered<L: Lanes>(&self, lanes: L, node: &Node, place: usize) -> u32 {
        let (sheaf, at) = (place / PACKET % SHEAVES, place % PACKET);
        let ray = self.rays[sheaf].ray(at, self.shadows[sheaf].sheaf.direction(at));
        BoxTest::new(lanes, &ray).entered(node, ray.far).0
    }

    /// Takes note of the rays that hit a triangle of a leaf.
    #[inline(always)]
    fn meet<L: Lanes>(&mut self, lanes: L, link: Link, mut rays: u32) {
        let tree = &self.accelerator.tree;
        let leaf = &tree.leaves[link.index()];
        let triangles = tree.triangles(link);
        while rays != 0 {
            let bit = next(&mut rays);
            let (shadows, at) = (&self.shadows[bit / PACKET % SHEAVES], bit % PACKET);
            let ray = self.rays[bit / PACKET % SHEAVES].ray(at, shadows.sheaf.direction(at));
            let test = TriangleTest::new(lanes, &ray);
            let filtered = test.filtered(leaf, ray.far);
            let mut candidates = filtered.candidates & link.mask();
            if candidates == 0 {
                continue;
            }
            let certain = test.certain(&filtered);
            while candidates != 0 {
                let lane = next(&mut candidates);
                let triangle = triangles[lane];
                let counts = shadows.sheaf.from[at] != triangle && shadows.target() != Some(triangle);
                if counts && (certain >> lane & 1 == 1 || self.crosses(shadows.sheaf, at, link, lane)) {
                    self.occluded |= 1 << bit;
                    break;
                }
            }
        }
    }

    /// The exact test of a ray with a triangle of a leaf.
    #[inline(always)]
    fn crosses(&self, sheaf: &Sheaf, at: usize, leaf: Link, lane: usize) -> bool {
        let Some(shear) = Shear::new(sheaf.origin(at), sheaf.direction(at)) else { return false };
        let crossing = shear.intersect(self.accelerator.tree.corners(leaf, lane));
        crossing.is_some_and(|crossing| sheaf.near < crossing.distance && crossing.distance < sheaf.far[at])
    }
}

/// Bit j of byte i becomes bit i of byte j.
#[inline(always)]
const fn transposed(bits: u64) -> u64 {
    let bits = exchanged(bits, 0x00AA_00AA_00AA_00AA, 7);
    let bits = exchanged(bits, 0x0000_CCCC_0000_CCCC, 14);
    exchanged(bits, 0x0000_0000_F0F0_F0F0, 28)
}

/// Exchanges the bits of a mask with those so many places above them.
#[inline(always)]
const fn exchanged(bits: u64, mask: u64, shift: u32) -> u64 {
    let differing = (bits ^ bits >> shift) & mask;
    bits ^ differing ^ differing << shift
}

#[cfg(test)]
mod tests {
    use super::transposed;

    #[test]
    fn every_bit_finds_its_place() {
        for (i, j) in (0..8).flat_map(|i| (0..8).map(move |j| (i, j))) {
            assert_eq!(transposed(1 << (8 * i + j)), 1 << (8 * j + i));
        }
    }
}
