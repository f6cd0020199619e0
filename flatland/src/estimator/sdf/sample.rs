//! Samples of angular pixels.

use glam::DVec2;

use crate::random::{Stream, open01};
use crate::sdf::AngularFilm;

/// A direction within a pixel's support, sampled uniformly: h and h′ divided by the density are bounded.
pub(super) struct PixelSample {
    pub(super) direction: DVec2,
    /// h/p.
    pub(super) value: f64,
    /// h′/p.
    pub(super) slope: f64,
}

impl PixelSample {
    pub(super) fn draw(film: &AngularFilm, pixel: usize, rng: &mut Stream) -> Self {
        let offset = film.radius() * (2.0 * open01(rng) - 1.0);
        let width = 2.0 * film.radius();
        Self {
            direction: DVec2::from_angle(film.centre(pixel) + offset),
            value: width * film.value(offset),
            slope: width * film.slope(offset),
        }
    }
}
