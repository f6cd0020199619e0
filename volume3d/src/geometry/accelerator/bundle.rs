//! Bundles of rays with one origin, sorted by longest axis and traced as packets.

use glam::DVec3;

use super::fan::Fan;
use super::packet::{Limits, Packet, PacketTraversal};
use super::watertight::{PACKET, Shears, longest_axis};
use super::{Accelerator, Hit, Ray};
use crate::lanes::{Lanes, Task, next};

/// Half width of a packet relative to the size of leaves above which rays are traced individually. Packets of
/// sixteen rays are faster below about 4 and several times slower than single rays at 6 (spheres of 81,920
/// and 327,680 triangles).
const WIDEST: f64 = 2.5;
/// Number of rays below which they are traced individually.
const FEWEST: usize = 3;

impl Accelerator {
    /// First hits of rays with one origin, in the order of `directions`: bit for bit those of
    /// [`Accelerator::closest`], converted to `H`. Fast for directions in a narrow cone.
    pub fn closest_bundle<H: Clone + From<Hit>>(
        &self,
        origin: DVec3,
        directions: &[DVec3],
        near: f64,
        far: f64,
        from: Option<u32>,
        hits: &mut Vec<Option<H>>,
    ) {
        hits.clear();
        hits.resize(directions.len(), None);
        if !self.tree.leaves.is_empty() && origin.is_finite() {
            let limits = Limits { near, far, from };
            self.instructions.run(Bundle { accelerator: self, origin, directions, limits, hits });
        }
    }

    /// Traces rays individually.
    fn alone<H: From<Hit>>(
        &self,
        bundle: &Bundle<'_, H>,
        directions: &[DVec3],
        mut members: u32,
        hits: &mut [Option<H>],
    ) {
        let Limits { near, far, from } = bundle.limits;
        while members != 0 {
            let ray = next(&mut members);
            let ray_alone = Ray { origin: bundle.origin, direction: directions[ray], near, far, from };
            hits[ray] = self.closest(&ray_alone).map(H::from);
        }
    }
}

/// All rays of a bundle.
struct Bundle<'a, H> {
    accelerator: &'a Accelerator,
    origin: DVec3,
    directions: &'a [DVec3],
    limits: Limits,
    hits: &'a mut [Option<H>],
}

impl<H: From<Hit>> Task for Bundle<'_, H> {
    type Output = ();

    #[inline(always)]
    fn run<L: Lanes>(mut self, lanes: L) {
        let hits = std::mem::take(&mut self.hits);
        for (directions, hits) in self.directions.chunks(PACKET).zip(hits.chunks_mut(PACKET)) {
            self.chunk(lanes, directions, hits);
        }
    }
}

impl<H: From<Hit>> Bundle<'_, H> {
    /// At most [`PACKET`] rays: one packet for each longest axis and sign.
    #[inline(always)]
    fn chunk<L: Lanes>(&self, lanes: L, directions: &[DVec3], hits: &mut [Option<H>]) {
        // Bit masks of members by axis and sign.
        let mut classes = [0_u32; 8];
        for (ray, &direction) in directions.iter().enumerate() {
            let along = longest_axis(direction);
            let backward = direction.to_array()[along] < 0.0;
            classes[2 * along + usize::from(backward)] |= 1 << ray;
        }
        for (class, &members) in classes.iter().enumerate() {
            if members != 0 {
                self.class(lanes, directions, members, class / 2, hits);
            }
        }
    }

    /// Rays of one longest axis and sign.
    #[inline(always)]
    fn class<L: Lanes>(
        &self,
        lanes: L,
        directions: &[DVec3],
        members: u32,
        along: usize,
        hits: &mut [Option<H>],
    ) {
        let accelerator = self.accelerator;
        // Packets support only rays ahead of the origin.
        let ahead = self.limits.near >= 0.0 && members.count_ones() as usize >= FEWEST;
        if ahead {
            let shears = Shears::new(self.origin, directions, members, along);
            let widest = WIDEST * accelerator.tree.leaf_size;
            if shears.are_finite()
                && let Some(fan) = Fan::new(&accelerator.frame, self.origin, &shears, widest)
            {
                let mut packet = Packet::new(&fan, &shears, &self.limits);
                let limits = &self.limits;
                PacketTraversal { accelerator, fan: &fan, shears: &shears, limits, packet: &mut packet }
                    .run(lanes);
                packet.write(hits);
                return;
            }
        }
        accelerator.alone(self, directions, members, hits);
    }
}
