//! Random choices that all random scenes and worlds are drawn with.

use std::f64::consts::TAU;

use flatland::random::{Stream, open01, stream};
use glam::{DMat3, DVec2, DVec3};
use rand::Rng;

/// A source of random choices, the same on every machine and in every thread.
pub(crate) struct Dice(Stream);

impl Dice {
    pub(crate) fn new(seed: u64, purpose: u64) -> Self {
        Self(stream(seed, &[purpose]))
    }

    pub(crate) fn between(&mut self, low: f64, high: f64) -> f64 {
        low + (high - low) * open01(&mut self.0)
    }

    /// A number between two positive bounds, uniform in the logarithm.
    pub(crate) fn scale(&mut self, low: f64, high: f64) -> f64 {
        self.between(low.ln(), high.ln()).exp()
    }

    pub(crate) fn chance(&mut self, probability: f64) -> bool {
        open01(&mut self.0) < probability
    }

    /// An integer from `low` to `high`, both included.
    pub(crate) fn count(&mut self, low: usize, high: usize) -> usize {
        low + (self.0.next_u64() % (high - low + 1) as u64) as usize
    }

    pub(crate) fn pick<T: Copy>(&mut self, from: &[T]) -> T {
        from[self.count(0, from.len() - 1)]
    }

    pub(crate) fn sign(&mut self) -> f64 {
        if self.chance(0.5) { 1.0 } else { -1.0 }
    }

    pub(crate) fn colour(&mut self) -> DVec3 {
        DVec3::from(std::array::from_fn(|_| self.between(0.0, 1.0)))
    }

    /// A plane vector of length 0.3 to 1 times `length`.
    pub(crate) fn vector2(&mut self, length: f64) -> DVec2 {
        DVec2::from_angle(self.between(0.0, TAU)) * self.between(0.3, 1.0) * length
    }

    /// A vector in space of length 0.3 to 1 times `length`.
    pub(crate) fn vector3(&mut self, length: f64) -> DVec3 {
        self.direction() * self.between(0.3, 1.0) * length
    }

    /// A direction, uniform on the unit sphere (Archimedes).
    pub(crate) fn direction(&mut self) -> DVec3 {
        let z = self.between(-1.0, 1.0);
        let xy = DVec2::from_angle(self.between(0.0, TAU)) * (1.0 - z * z).sqrt();
        xy.extend(z)
    }

    /// A rotation.
    pub(crate) fn frame(&mut self) -> DMat3 {
        let z = self.direction();
        let (x, y) = z.any_orthonormal_pair();
        let turn = DVec2::from_angle(self.between(0.0, TAU));
        DMat3::from_cols(turn.x * x + turn.y * y, turn.x * y - turn.y * x, z)
    }

    /// The corners of a convex polygon around 0 in the plane, counterclockwise, at 0.5 to 1 times
    /// `radius`.
    pub(crate) fn convex_ring(&mut self, radius: f64, corners: usize) -> Vec<DVec2> {
        loop {
            let turn = self.between(0.0, TAU);
            let ring: Vec<_> = (0..corners)
                .map(|k| {
                    let angle = turn + TAU * (k as f64 + self.between(-0.25, 0.25)) / corners as f64;
                    radius * self.between(0.5, 1.0) * DVec2::from_angle(angle)
                })
                .collect();
            // Every corner turns by at least 0.2 in sine.
            let edge = |k: usize| (ring[(k + 1) % corners] - ring[k % corners]).normalize();
            if (0..corners).all(|k| edge(k).perp_dot(edge(k + 1)) > 0.2) {
                return ring;
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn choices_depend_on_seed_and_purpose_alone() {
        let draw = |seed, purpose| {
            let mut dice = Dice::new(seed, purpose);
            (dice.count(0, 1 << 40), dice.frame(), dice.convex_ring(2.0, 5))
        };
        assert_eq!(draw(1, 2), draw(1, 2));
        assert!(draw(1, 2).0 != draw(2, 2).0 && draw(1, 2).0 != draw(1, 3).0);
    }
}
