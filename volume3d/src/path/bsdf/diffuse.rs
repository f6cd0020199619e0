//! Directions over a hemisphere for diffuse lobes.

use std::f64::consts::{FRAC_1_PI, TAU};

use glam::DVec3;

/// Fraction of diffuse samples that is uniform over the hemisphere. The derivative of a cosine does not
/// vanish at the horizon, where the density of cosine-weighted samples does; without this fraction, gradients
/// of a rotating surface have infinite variance.
const DEFENSIVE: f64 = 0.1;

/// Density of [`sample`] at a cosine above 0.
#[inline(always)]
pub(in crate::path) fn density(cosine: f64) -> f64 {
    (1.0 - DEFENSIVE) * cosine * FRAC_1_PI + DEFENSIVE / TAU
}

/// A direction about z.
#[inline]
pub(in crate::path) fn sample([a, b, c]: [f64; 3]) -> DVec3 {
    let z = if c < DEFENSIVE { a } else { a.sqrt() };
    let (sin, cos) = (TAU * b).sin_cos();
    let r = (1.0 - z * z).max(0.0).sqrt();
    DVec3::new(r * cos, r * sin, z)
}
