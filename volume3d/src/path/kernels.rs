//! How wide the kernels of directions are.

use flatland::calculus::Number;
use glam::DVec3;

use super::bsdf::Shading;
use super::calculus::{Kernel, VisibilityDomain};
use super::lights::{LightId, Lights};
use crate::scene::{Light, Scene, Surface};

/// How concentrated the auxiliary rays are around what they serve.
///
/// A kernel's width is 1/√κ. What a warp has to resolve is as wide as a pixel on the film, as the lobe of what
/// reflects, and as the emitter that is looked at.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Kernels {
    /// κ on the film, per square pixel.
    pub film: f64,
    /// κ of directions around a diffuse surface, and the least there is.
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
    /// The kernel for what is reflected from a direction, in which a surface is seen.
    pub(crate) fn of_bounce<T: Number>(
        &self,
        shading: &Shading<'_, T>,
        domain: VisibilityDomain,
        surface: Option<Surface>,
    ) -> Kernel {
        let kappa = self.surface.max(shading.concentration());
        Kernel { kappa, domain, normal: shading.normal.value(), surface, of_light: false }
    }

    /// The kernel for the light of one emitter reflected at x, where a surface of it is seen.
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
