//! Harmonic field: ΔV = 0 with V = v on every visible silhouette (Wu et al. 2025).

use std::f64::consts::TAU;

use glam::DVec2;

use super::arrangement::Arrangement;
use crate::random::{Stream, open01};
use crate::warp::{Field, Plane, WarpField};

/// V by walk on spheres, in the plane: from u, step to a uniform point of the largest circle without a
/// silhouette inside, until within `tolerance` of one, and take its velocity (Muller 1956). V = 0 on the
/// arrangement's frame.
///
/// The divergence follows from the first disc: ∇·V(u) = (2/R) E[V(y)·n]. Two walks start from opposite points
/// ±n, so that a velocity common to both cancels.
///
/// Unbiased except for the last step, whose length is below `tolerance`.
#[derive(Clone, Debug)]
pub struct HarmonicField<'a> {
    arrangement: &'a Arrangement<'a>,
    velocities: &'a [DVec2],
    frame: (DVec2, DVec2),
    tolerance: f64,
}

impl<'a> Arrangement<'a> {
    /// The harmonic field of a motion; `tolerance` is a length in the scene's unit, for example 10⁻⁶ pixels,
    /// and at least 16 units in the last place of the coordinates.
    ///
    /// # Panics
    /// Its evaluation panics if there is not one velocity per vertex.
    #[must_use]
    pub fn harmonic(&'a self, velocities: &'a [DVec2], tolerance: f64) -> HarmonicField<'a> {
        let low = self.nodes.iter().copied().fold(DVec2::INFINITY, DVec2::min);
        let high = self.nodes.iter().copied().fold(DVec2::NEG_INFINITY, DVec2::max);
        // A walk cannot come closer to a silhouette than the resolution of the coordinates.
        let tolerance = tolerance.max(16.0 * f64::EPSILON * low.abs().max(high.abs()).max_element());
        HarmonicField { arrangement: self, velocities, frame: (low, high), tolerance }
    }
}

impl HarmonicField<'_> {
    /// The distance to the nearest silhouette or side of the frame, and V there.
    fn nearest(&self, u: DVec2) -> (f64, DVec2) {
        let to_frame = (u - self.frame.0).min(self.frame.1 - u).min_element().max(0.0);
        let Some((i, distance)) = self.arrangement.nearest_boundary(u) else {
            return (to_frame, DVec2::ZERO);
        };
        if to_frame <= distance {
            return (to_frame, DVec2::ZERO);
        }
        let b = &self.arrangement.boundaries[i];
        let [p, q] = b.nodes.map(|n| self.arrangement.nodes[n as usize]);
        let t = ((u - p).dot(q - p) / (q - p).length_squared()).clamp(0.0, 1.0);
        (distance, self.arrangement.edge_velocity(b.owners[0], p.lerp(q, t), self.velocities))
    }

    fn walk(&self, mut u: DVec2, rng: &mut Stream) -> DVec2 {
        loop {
            let (distance, velocity) = self.nearest(u);
            if distance <= self.tolerance {
                return velocity;
            }
            u += distance * DVec2::from_angle(TAU * open01(rng));
        }
    }
}

impl WarpField<Plane> for HarmonicField<'_> {
    fn at(&self, u: DVec2, rng: &mut Stream) -> (Field<DVec2>, u64) {
        let (radius, velocity) = self.nearest(u);
        if radius <= self.tolerance {
            return (Field { value: velocity, divergence: 0.0 }, 0);
        }
        let n = DVec2::from_angle(TAU * open01(rng));
        let [plus, minus] = [n, -n].map(|n| self.walk(u + radius * n, rng));
        (Field { value: 0.5 * (plus + minus), divergence: (plus - minus).dot(n) / radius }, 0)
    }
}

impl WarpField<Plane> for super::OracleField<'_> {
    fn at(&self, u: DVec2, _: &mut Stream) -> (Field<DVec2>, u64) {
        (self.at(u), 0)
    }
}
