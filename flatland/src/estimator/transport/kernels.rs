//! Widths of auxiliary kernels.

use crate::transport::Material;

/// Concentrations κ of auxiliary kernels by place. A kernel wider than the gap between two discontinuities
/// resolves them slowly; a much narrower one makes V steep.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Kernels {
    /// κ on the film, in 1/pixel²: 44 is a width of 0.15 pixels.
    pub film: f64,
    /// Least κ at a surface: 20 is a width of κ^−½ = 0.22 radians.
    pub surface: f64,
    /// Least number of kernel widths in a lobe's width or an emitter's subtended angle, up to 10⁶. Between
    /// 0.3 and 6 the variance hardly changes.
    pub relative: f64,
}

impl Default for Kernels {
    fn default() -> Self {
        Self { film: 44.0, surface: 20.0, relative: 2.0 }
    }
}

impl Kernels {
    /// κ at a surface, for the light of an emitter that subtends an angle or for scattered light.
    pub(super) fn surface(&self, material: &Material, subtended: Option<f64>) -> f64 {
        let lobe = material.gloss.filter(|g| g.strength > 0.0).map_or(f64::INFINITY, |g| g.width);
        let width = lobe.min(subtended.unwrap_or(f64::INFINITY));
        // Directions are no finer than rounding.
        (self.relative / width.max(f64::EPSILON)).powi(2).max(self.surface)
    }
}
