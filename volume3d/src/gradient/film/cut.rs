//! Films whose border cuts the filters of pixels.
//!
//! Where samples fall within the film only, a pixel at c is ∫ h(u − c) L(u) du/∫ h(u − c) du, both over the
//! film. The weight of a sample is h/∫ h, and the integrand ends at the border, which does not move: of the
//! divergence of the warped integrand, the area within has −∮ h (L − L₀) V·ν along the border left, as box
//! pixels have along their own.

use super::filter::integral;
use crate::scene::{Film, Filter};

/// As many pixels beside a border as filters reach at most, whose radius is at most 16.
const MOST: usize = 16;

/// By pixel from the border: how much of its filter is beyond, along one axis.
#[derive(Clone, Copy, Debug)]
pub(super) struct Cut([f64; MOST]);

impl Cut {
    /// Nothing where the border does not cut.
    pub(super) fn of(film: &Film) -> Option<Self> {
        let radius = film.filter.radius();
        if film.sample_border || film.filter == Filter::Box {
            return None;
        }
        Some(Self(std::array::from_fn(|k| {
            let border = k as f64 + 0.5;
            if border < radius { integral(film.filter, border, radius) } else { 0.0 }
        })))
    }

    /// One over the part of the filter of the pixel x of n that is within.
    pub(super) fn scale(&self, x: usize, n: usize) -> f64 {
        let beyond = |k: usize| self.0.get(k).copied().unwrap_or(0.0);
        (1.0 - beyond(x) - beyond(n - 1 - x)).recip()
    }
}
