//! Emitter sampling: a direction towards a luminous segment, uniform in the angle it subtends.

use glam::DVec2;

use super::{Origin, World};

/// Luminous segments as seen from a surface, whose side is given by its normal.
#[derive(Clone, Debug)]
pub(super) struct Emitters<'a> {
    world: &'a World,
    origin: Origin,
    normal: DVec2,
    /// Σ L_j Δ_j, with Δ_j the angle that segment j subtends above the horizon.
    power: f64,
}

/// A direction towards a segment.
#[derive(Clone, Copy, Debug)]
pub(super) struct EmitterSample {
    pub(super) segment: usize,
    pub(super) direction: DVec2,
}

impl<'a> Emitters<'a> {
    pub(super) fn new(world: &'a World, origin: Origin, normal: DVec2) -> Self {
        let mut this = Self { world, origin, normal, power: 0.0 };
        this.power = world.emitters().iter().map(|&j| this.weight(j)).sum();
        this
    }

    /// Density of [`sample`](Self::sample) at directions in which segment j is seen: L_j/Σ L_k Δ_k.
    pub(super) fn density(&self, segment: usize) -> f64 {
        if self.power > 0.0 { self.world.material(segment).emission / self.power } else { 0.0 }
    }

    /// Samples segment j with probability ∝ L_j Δ_j and a direction uniform in Δ_j. The segment may be
    /// occluded there. `None` if no luminous segment is above the horizon.
    pub(super) fn sample(&self, [which, xi]: [f64; 2]) -> Option<EmitterSample> {
        let mut rest = which * self.power;
        let mut picked = None;
        for &j in self.world.emitters() {
            let weight = self.weight(j);
            if weight > 0.0 {
                picked = Some(j);
                if rest < weight {
                    break;
                }
                rest -= weight;
            }
        }
        let segment = picked?;
        let [a, b] = self.above_horizon(segment)?;
        let direction = DVec2::from_angle(xi * angle(a, b)).rotate(a).normalize();
        Some(EmitterSample { segment, direction })
    }

    fn weight(&self, segment: usize) -> f64 {
        let subtended = self.above_horizon(segment).map_or(0.0, |[a, b]| angle(a, b).abs());
        self.world.material(segment).emission * subtended
    }

    /// The end points, relative to the origin, of the part of a segment above the horizon.
    fn above_horizon(&self, segment: usize) -> Option<[DVec2; 2]> {
        if self.origin.segment == Some(segment) {
            return None;
        }
        let [a, b] = self.world.segments()[segment].ends().map(|p| p - self.origin.point);
        let (ha, hb) = (a.dot(self.normal), b.dot(self.normal));
        let cut = || a + (b - a) * (ha / (ha - hb));
        match (ha > 0.0, hb > 0.0) {
            (true, true) => Some([a, b]),
            (true, false) => Some([a, cut()]),
            (false, true) => Some([cut(), b]),
            (false, false) => None,
        }
    }
}

/// Angle that a segment subtends at a point.
pub(crate) fn subtended(world: &World, segment: usize, from: DVec2) -> f64 {
    let [a, b] = world.segments()[segment].ends().map(|p| p - from);
    angle(a, b).abs()
}

/// The signed angle from a to b, to full precision also for small angles.
fn angle(a: DVec2, b: DVec2) -> f64 {
    a.perp_dot(b).atan2(a.dot(b))
}
