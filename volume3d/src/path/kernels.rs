//! Widths of direction kernels.

use flatland::calculus::Number;
use glam::DVec3;

use super::bsdf::Shading;
use super::calculus::{Kernel, VisibilityDomain};
use super::lights::{LightId, Lights};
use crate::scene::{Light, Scene, Surface};

/// Concentrations of auxiliary rays.
///
/// A kernel's width is 1/√κ. The relevant scales are a pixel on the film, the lobe of a reflecting surface,
/// and the apparent size of an emitter.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Kernels {
    /// κ on the film, per square pixel.
    pub film: f64,
    /// κ of directions around a diffuse surface, and the least κ.
    pub surface: f64,
    /// κ towards an emitter of half angle α is (relative/α)².
    pub relative: f64,
}

impl Default for Kernels {
    fn default() -> Self {
        Self { film: 8.0, surface: 20.0, relative: 2.0 }
    }
}

impl Kernels {
    /// Kernel of the light reflected from a direction, in which a surface is seen.
    pub(crate) fn of_bounce<T: Number>(
        &self,
        shading: &Shading<'_, T>,
        domain: VisibilityDomain,
        surface: Option<Surface>,
    ) -> Kernel {
        let kappa = self.surface.max(shading.concentration());
        Kernel { kappa, domain, normal: shading.normal.value(), surface, of_light: false }
    }

    /// Kernel of a single emitter's light reflected at x, where the emitter's surface is seen.
    pub(crate) fn of_light<T: Number>(
        &self,
        scene: &Scene,
        lights: &Lights,
        id: LightId,
        shading: &Shading<'_, T>,
        x: DVec3,
        surface: Option<Surface>,
    ) -> Kernel {
        let (kappa, domain) = match id {
            LightId::Shape(shape) => {
                ((self.relative / lights.half_angle(shape, x)).powi(2), lights.domain(shape))
            }
            LightId::Light(index) => match &scene.lights()[index as usize] {
                Light::Directional { kappa, .. } if kappa.is_finite() => {
                    (0.5 * self.relative.powi(2) * kappa, VisibilityDomain::Distant)
                }
                _ => (0.0, VisibilityDomain::Distant),
            },
            LightId::Environment => (0.0, VisibilityDomain::Distant),
        };
        let least = self.of_bounce(shading, domain, surface);
        Kernel { kappa: least.kappa.max(kappa), of_light: true, ..least }
    }
}
