//! Sheaves: up to sixteen rays that leave surfaces and end at one point or have one direction, such as shadow
//! rays towards a point of a light, or parallel rays from a flat surface.
//!
//! They are traced together. Each has the hit that it has alone, bit for bit.

use glam::DVec3;

use super::Ray;
use super::watertight::PACKET;

/// Index for rays that leave no triangle.
const NONE: u32 = u32::MAX;

/// Rays in structure-of-arrays form.
#[derive(Clone, Copy, Debug)]
pub struct Sheaf {
    /// Origins, by coordinate.
    pub origins: [[f64; PACKET]; 3],
    /// Unit directions, by coordinate.
    pub directions: [[f64; PACKET]; 3],
    /// Lower bound on hit distances; if negative, rays are traced individually.
    pub near: f64,
    /// Upper bound on hit distances; may be infinite.
    pub far: [f64; PACKET],
    /// Triangles that contain the origins, which are never hit by their rays.
    pub from: [u32; PACKET],
    /// Triangles in which rays end, which occlusion queries ignore.
    pub target: [u32; PACKET],
    /// Bit mask of occupied places.
    pub members: u32,
}

impl Sheaf {
    /// Largest number of rays.
    pub const MOST: usize = PACKET;

    /// Index for no triangle.
    pub const NONE: u32 = NONE;

    /// No rays.
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

    /// Rays among `members` whose direction is longest along an axis, with a sign.
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

    /// Rays among `members` with a given direction.
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

/// Common end of the rays of a sheaf.
#[derive(Clone, Copy, Debug)]
pub struct Goal<'a> {
    /// The point.
    pub point: DVec3,
    /// Its distances from their origins; rays that continue beyond it are traced individually.
    pub distances: &'a [f64; PACKET],
}
