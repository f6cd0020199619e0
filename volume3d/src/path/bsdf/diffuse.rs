//! Directions over a hemisphere, for whatever reflects diffusely.

use std::f64::consts::{FRAC_1_PI, TAU};

use glam::DVec3;

/// The part of diffuse samples that is uniform over the hemisphere. The derivative of a cosine does not vanish
/// at the horizon, where the density of cosine samples does; without this part, gradients of a surface that
/// turns have infinite variance.
const DEFENSIVE: f64 = 0.1;

/// The density of [`sample`] at a cosine above 0.
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
