//! Division of sheaves into narrow fans. Remaining rays are traced as a stream or individually.

use super::fan::Fan;
use super::sheaf::{Goal, Sheaf};
use super::stream::{SHEAVES, Shadows};
use super::sweep::{Found, Sweep};
use super::watertight::{PACKET, Shears, longest_axis};
use super::{Accelerator, Hit};
use crate::lanes::{Lanes, Task, next};

/// Half width of a fan, relative to the size of a typical leaf, above which it is divided.
const WIDEST: f64 = 2.0;

/// Multiple of that width above which dividing a fan is not worthwhile.
const HOPELESS: f64 = 3.0;

/// Number of leaves above which rays are traced as a stream: with 640 leaves fans are faster than single rays
/// by a third, with 10,000 slower by a tenth.
const MOST_LEAVES: usize = 4096;

/// Number of rays below which they are traced individually.
const FEWEST: u32 = 3;

impl Accelerator {
    /// Bit masks of rays that hit anything. Fast if many of them end at one point or have one direction.
    #[must_use]
    pub fn occluded_sheaves(&self, shadows: &[Shadows<'_>; SHEAVES]) -> [u32; SHEAVES] {
        let (mut occluded, mut rest) = ([0; SHEAVES], [0; SHEAVES]);
        for (at, &Shadows { sheaf, end }) in shadows.iter().enumerate() {
            Parts { occluded: occluded[at], rest: rest[at] } = self.gather::<true>(sheaf, end, &mut []);
        }
        let others = self.occluded_stream(shadows, rest);
        [0, 1].map(|at| occluded[at] | others[at])
    }

    /// First hits of rays, if any. Fast if many of them have one direction.
    pub fn closest_sheaf(&self, sheaf: &Sheaf, hits: &mut [Option<Hit>; PACKET]) {
        *hits = [None; PACKET];
        let mut rest = self.gather::<false>(sheaf, None, hits).rest;
        while rest != 0 {
            let at = next(&mut rest) % PACKET;
            hits[at] = self.closest(&sheaf.ray(at));
        }
    }

    #[inline(always)]
    fn gather<const ANY: bool>(
        &self,
        sheaf: &Sheaf,
        end: Option<&Goal<'_>>,
        hits: &mut [Option<Hit>],
    ) -> Parts {
        if self.tree.leaves.is_empty() || sheaf.members == 0 {
            return Parts { occluded: 0, rest: 0 };
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
    type Output = Parts;

    #[inline(always)]
    fn run<L: Lanes>(mut self, lanes: L) -> Parts {
        let mut rest = self.sheaf.members;
        let mut all = Parts { occluded: 0, rest: 0 };
        if self.accelerator.tree.leaves.len() > MOST_LEAVES {
            return Parts { rest, ..all };
        }
        while rest != 0 {
            let direction = self.sheaf.direction(rest.trailing_zeros() as usize % PACKET);
            let along = longest_axis(direction);
            let sign = 1.0_f64.copysign(direction.to_array()[along]);
            let some = match self.end {
                Some(_) => self.sheaf.along(rest, along, sign),
                None => self.sheaf.alike(rest, direction),
            };
            // NaN directions are not even equal to themselves, and hit nothing.
            let some = if some == 0 { rest & rest.wrapping_neg() } else { some };
            rest &= !some;
            let parts = self.parts(lanes, some, along);
            all.occluded |= parts.occluded;
            all.rest |= parts.rest;
        }
        all
    }
}

/// Result for some rays.
struct Parts {
    /// Bit mask of rays that hit anything, if that is the query.
    occluded: u32,
    /// Rays not decided by a fan.
    rest: u32,
}

impl<const ANY: bool> Gather<'_, ANY> {
    /// Traces rays of one longest axis: as one fan, or as halves or quarters.
    #[inline(always)]
    fn parts<L: Lanes>(&mut self, lanes: L, members: u32, along: usize) -> Parts {
        let Self { accelerator, sheaf, end, .. } = *self;
        let (mut occluded, mut rest, mut width) = (0, members, PACKET as u32);
        if members.count_ones() < FEWEST {
            return Parts { occluded, rest };
        }
        let shears = Shears::of_lanes(&sheaf.directions, members, along);
        // Backwards, objects beyond the end are not visible; and fans start at the origins of their rays.
        let ends = |at: usize| end.is_none_or(|end| sheaf.far[at] <= end.distances[at]);
        let within = sheaf.near >= 0.0 && (0..PACKET).all(|at| members >> at & 1 == 0 || ends(at));
        let together = within && shears.are_finite();
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
                let found = Found::new(&accelerator.frame, sheaf, end, &fan, (&shears, some));
                let found = Sweep::<ANY> { accelerator, sheaf, fan: &fan, found }.run(lanes);
                rest &= !some;
                if ANY {
                    occluded |= found.occluded;
                } else {
                    found.write(self.hits);
                }
            }
            width /= 2;
        }
        Parts { occluded, rest }
    }

    /// The fan of some rays if it is narrow, or else the factor by which it is too wide.
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
