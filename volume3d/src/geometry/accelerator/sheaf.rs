//! Up to sixteen rays that leave surfaces, and that end at one point or have one direction: shadow rays towards a point of
//! a light, or rays that leave a flat surface alike.
//!
//! They go through the hierarchy at once. What each of them meets is what it meets alone, bit for bit.

use glam::DVec3;

use super::Ray;
use super::watertight::PACKET;

/// The triangle that is left by rays which leave none.
const NONE: u32 = u32::MAX;

/// Rays side by side.
#[derive(Clone, Copy, Debug)]
pub struct Sheaf {
    /// By coordinate.
    pub origins: [[f64; PACKET]; 3],
    /// By coordinate, of unit length.
    pub directions: [[f64; PACKET]; 3],
    /// Hits are farther than this; if it is negative, rays are traced alone.
    pub near: f64,
    /// Hits are nearer than this; may be infinite.
    pub far: [f64; PACKET],
    /// The triangles that origins lie on, which are never hit by their rays.
    pub from: [u32; PACKET],
    /// The triangles in which rays end, which are never hit by them when only whether anything is hit is
    /// asked.
    pub target: [u32; PACKET],
    /// The places that have a ray, as bits.
    pub members: u32,
}

impl Sheaf {
    /// How many rays there are at most.
    pub const MOST: usize = PACKET;

    /// In place of a triangle, that there is none.
    pub const NONE: u32 = NONE;

    /// Without any ray.
    pub const EMPTY: Self = Self {
        origins: [[0.0; PACKET]; 3],
        directions: [[0.0; PACKET]; 3],
        near: 0.0,
        far: [0.0; PACKET],
        from: [NONE; PACKET],
        target: [NONE; PACKET],
        members: 0,
    };

    #[inline(always)]
    pub(super) fn origin(&self, at: usize) -> DVec3 {
        DVec3::new(self.origins[0][at], self.origins[1][at], self.origins[2][at])
    }

    #[inline(always)]
    pub(super) fn direction(&self, at: usize) -> DVec3 {
        DVec3::new(self.directions[0][at], self.directions[1][at], self.directions[2][at])
    }

    /// The triangle in which a ray ends.
    #[inline(always)]
    pub(super) fn target(&self, at: usize) -> Option<u32> {
        Some(self.target[at]).filter(|&target| target != NONE)
    }

    pub(super) fn ray(&self, at: usize) -> Ray {
        let from = Some(self.from[at]).filter(|&from| from != NONE);
        Ray {
            origin: self.origin(at),
            direction: self.direction(at),
            near: self.near,
            far: self.far[at],
            from,
        }
    }

    /// Those of some rays whose direction is longest along an axis, with a sign.
    #[inline(always)]
    pub(super) fn along(&self, members: u32, along: usize, sign: f64) -> u32 {
        let [x, y, z] = &self.directions;
        let mut rays = 0;
        for at in 0..PACKET {
            let own = self.directions[along][at] * sign;
            let longest = (own >= x[at].abs()) & (own >= y[at].abs()) & (own >= z[at].abs());
            rays |= u32::from(longest) << at;
        }
        rays & members
    }

    /// Those of some rays that have a direction.
    #[inline(always)]
    pub(super) fn alike(&self, members: u32, direction: DVec3) -> u32 {
        let [x, y, z] = &self.directions;
        let mut rays = 0;
        for at in 0..PACKET {
            let alike = (x[at] == direction.x) & (y[at] == direction.y) & (z[at] == direction.z);
            rays |= u32::from(alike) << at;
        }
        rays & members
    }
}

/// Where rays of a sheaf end.
#[derive(Clone, Copy, Debug)]
pub struct Goal<'a> {
    /// The point.
    pub point: DVec3,
    /// How far it is from their origins; rays that go on beyond it are traced alone.
    pub distances: &'a [f64; PACKET],
}
