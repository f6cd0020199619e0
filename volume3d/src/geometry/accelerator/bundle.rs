//! Rays with one origin: sorted by their longest axis, and sent through the tree as packets.

use glam::DVec3;

use super::frame::Fan;
use super::packet::{PACKET, Packet, PacketTraversal};
use super::watertight::Shear;
use super::{Accelerator, Hit, Ray};

/// Half width of a packet, over the size of leaves, above which rays go alone. Measured with sixteen rays on
/// spheres of 81,920 and 327,680 triangles: packets are faster below about 4, and several times slower
/// than single rays at 6.
const WIDEST: f64 = 2.5;
/// Fewer rays than this are faster alone.
const FEWEST: usize = 3;

impl Accelerator {
    /// The first hits of rays with one origin, in the order of `directions`: each is that of
    /// [`Accelerator::closest`], bit for bit. Fast for directions in a narrow cone.
    pub fn closest_bundle(
        &self,
        origin: DVec3,
        directions: &[DVec3],
        near: f64,
        far: f64,
        from: Option<u32>,
        hits: &mut Vec<Option<Hit>>,
    ) {
        hits.clear();
        hits.resize(directions.len(), None);
        let limits = Limits { near, far, from };
        for (directions, hits) in directions.chunks(PACKET).zip(hits.chunks_mut(PACKET)) {
            self.chunk(origin, directions, &limits, hits);
        }
    }

    /// At most [`PACKET`] rays: one packet for each longest axis and its sign.
    fn chunk(&self, origin: DVec3, directions: &[DVec3], limits: &Limits, hits: &mut [Option<Hit>]) {
        let mut shears = [Shear::IDLE; PACKET];
        // Members by axis and sign, as bits.
        let mut classes = [0_u32; 6];
        for (ray, &direction) in directions.iter().enumerate() {
            if let Some(shear) = Shear::new(origin, direction) {
                shears[ray] = shear;
                classes[2 * shear.axes[2] + usize::from(shear.backward())] |= 1 << ray;
            }
        }
        for members in classes {
            if members != 0 {
                self.class(origin, directions, &shears, members, limits, hits);
            }
        }
    }

    /// Rays of one longest axis and sign.
    fn class(
        &self,
        origin: DVec3,
        directions: &[DVec3],
        shears: &[Shear; PACKET],
        members: u32,
        limits: &Limits,
        hits: &mut [Option<Hit>],
    ) {
        // Packets look ahead of the origin only.
        let ahead = limits.near >= 0.0 && !self.tree.leaves.is_empty();
        let fan = (ahead && members.count_ones() as usize >= FEWEST)
            .then(|| Fan::new(&self.frame, origin, shears, members, WIDEST * self.tree.leaf_size))
            .flatten();
        if let Some(fan) = fan {
            let mut packet = Packet::new(&fan, shears, members, limits);
            self.instructions.run(PacketTraversal {
                accelerator: self,
                fan: &fan,
                shears,
                limits,
                packet: &mut packet,
            });
            packet.write(members, hits);
        } else {
            let Limits { near, far, from } = *limits;
            for (ray, &direction) in directions.iter().enumerate().filter(|(ray, _)| members >> ray & 1 == 1)
            {
                hits[ray] = self.closest(&Ray { origin, direction, near, far, from });
            }
        }
    }
}

/// What the rays of a bundle share besides their origin.
#[derive(Clone, Copy)]
pub(super) struct Limits {
    pub(super) near: f64,
    pub(super) far: f64,
    pub(super) from: Option<u32>,
}
