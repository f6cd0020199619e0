//! Sheaves, divided into narrow fans that go through the tree at once.

use super::fan::Fan;
use super::sheaf::{Goal, Sheaf};
use super::sweep::{Found, Sweep};
use super::watertight::{PACKET, Shears, longest_axis};
use super::{Accelerator, Hit};
use crate::lanes::{Lanes, Task, next};

/// Half width of a fan, over the size of a typical leaf, above which it is divided.
const WIDEST: f64 = 2.0;

/// Fans that are so many times as wide as that are not worth dividing.
const HOPELESS: f64 = 3.0;

/// With more leaves than this, rays go alone. Measured with rows of sixteen pixels of 128: with 640 leaves fans are faster by a
/// third, with 10,000 slower by a tenth.
const MOST_LEAVES: usize = 4096;

/// Fewer rays than this are faster alone.
const FEWEST: u32 = 3;

impl Accelerator {
    /// Which rays hit anything that all end at one point, or short of it, as bits.
    #[must_use]
    pub fn occluded_towards(&self, sheaf: &Sheaf, end: &Goal<'_>) -> u32 {
        self.gather::<true>(sheaf, Some(end), &mut [])
    }

    /// Which rays hit anything, as bits. Fast where many of them have one direction.
    #[must_use]
    pub fn occluded_sheaf(&self, sheaf: &Sheaf) -> u32 {
        self.gather::<true>(sheaf, None, &mut [])
    }

    /// The first hits of rays, where there are any. Fast where many of them have one direction.
    pub fn closest_sheaf(&self, sheaf: &Sheaf, hits: &mut [Option<Hit>; PACKET]) {
        *hits = [None; PACKET];
        self.gather::<false>(sheaf, None, hits);
    }

    #[inline(always)]
    fn gather<const ANY: bool>(
        &self,
        sheaf: &Sheaf,
        end: Option<&Goal<'_>>,
        hits: &mut [Option<Hit>],
    ) -> u32 {
        if self.tree.leaves.is_empty() || sheaf.members == 0 {
            return 0;
        }
        self.instructions.run(Gather::<ANY> { accelerator: self, sheaf, end, hits })
    }
}

/// All rays of a sheaf.
struct Gather<'a, const ANY: bool> {
    accelerator: &'a Accelerator,
    sheaf: &'a Sheaf,
    end: Option<&'a Goal<'a>>,
    hits: &'a mut [Option<Hit>],
}

impl<const ANY: bool> Task for Gather<'_, ANY> {
    type Output = u32;

    #[inline(always)]
    fn run<L: Lanes>(mut self, lanes: L) -> u32 {
        let mut rest = self.sheaf.members;
        let mut occluded = 0;
        while rest != 0 {
            let direction = self.sheaf.direction(rest.trailing_zeros() as usize % PACKET);
            let along = longest_axis(direction);
            let sign = 1.0_f64.copysign(direction.to_array()[along]);
            let some = match self.end {
                Some(_) => self.sheaf.along(rest, along, sign),
                None => self.sheaf.alike(rest, direction),
            };
            // Not even itself: what is not a number is met by nothing.
            let some = if some == 0 { rest & rest.wrapping_neg() } else { some };
            rest &= !some;
            occluded |= self.parts(lanes, some, along);
        }
        occluded
    }
}

impl<const ANY: bool> Gather<'_, ANY> {
    /// Rays of a fan: all of them, or those of halves, or of quarters, or one by one.
    #[inline(always)]
    fn parts<L: Lanes>(&mut self, lanes: L, members: u32, along: usize) -> u32 {
        let Self { accelerator, sheaf, end, .. } = *self;
        let (mut occluded, mut rest, mut width) = (0, members, PACKET as u32);
        let few = accelerator.tree.leaves.len() <= MOST_LEAVES && members.count_ones() >= FEWEST;
        let shears = Shears::of_lanes(&sheaf.directions, members, along);
        // Backwards, what is beyond the end is not seen; and fans begin where their rays do.
        let ends = |at: usize| end.is_none_or(|end| sheaf.far[at] <= end.distances[at]);
        let within = sheaf.near >= 0.0 && (0..PACKET).all(|at| members >> at & 1 == 0 || ends(at));
        let together = few && within && shears.are_finite();
        while together && rest != 0 && width >= FEWEST {
            for part in 0..PACKET as u32 / width {
                let some = rest & (((1 << width) - 1) << (part * width));
                if some.count_ones() < FEWEST {
                    continue;
                }
                let fan = match self.fan(&shears, some) {
                    Ok(fan) => fan,
                    Err(excess) if excess > HOPELESS => {
                        width = 0;
                        break;
                    }
                    Err(_) => continue,
                };
                rest &= !some;
                let found = Found::new(&accelerator.frame, sheaf, end, &fan, (&shears, some));
                let found = Sweep::<ANY> { accelerator, sheaf, end, fan: &fan, found }.run(lanes);
                if ANY {
                    occluded |= found.occluded;
                } else {
                    found.write(self.hits);
                }
            }
            width /= 2;
        }
        while rest != 0 {
            let at = next(&mut rest) % PACKET;
            let ray = sheaf.ray(at);
            if ANY {
                let alone = accelerator.occluded_before(&ray, end.and_then(|end| end.target));
                occluded |= u32::from(alone) << at;
            } else {
                self.hits[at] = accelerator.closest(&ray);
            }
        }
        occluded
    }

    /// The fan of some rays if it is narrow, or else how many times as wide as that it is.
    #[inline(always)]
    fn fan(&self, shears: &Shears, members: u32) -> Result<Fan, f64> {
        let Self { accelerator, sheaf, end, .. } = self;
        let frame = &accelerator.frame;
        let widest = WIDEST * accelerator.tree.typical_leaf;
        match end {
            // Backwards, with the same slopes.
            Some(end) => Fan::backwards(frame, (end.point, end.distances), (shears, members), widest),
            None => Fan::parallel(frame, &sheaf.origins, (shears, members), widest),
        }
    }
}
