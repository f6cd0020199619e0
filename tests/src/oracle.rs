//! An independent reference for the pixels of a plane scene and their derivatives.
//!
//! The image is turned by an angle at which no edge is vertical. A pixel I(θ) = ∫ h f du is then ∫ C(x, θ)
//! dx, where the column C(x, θ) = ∫ h f dy is continuous in x. The limits of the outer integral are fixed, so
//! dI/dθ = ∫ ∂C/∂θ dx: events (vertices, crossings) move, but contribute nothing because the column is
//! continuous. Between two events a column crosses the same edges in the same order, and there Gauss–Legendre
//! quadrature is exact: C and ∂C/∂θ are evaluated together in dual numbers [`num_dual::Dual64`] whose ends,
//! nodes and lengths move with the edges. Dense or coincident events need no special treatment, as every
//! order of equal events describes the same columns.
//!
//! Vertical order is decided in double-double arithmetic, so that edges 10⁻¹³ apart are still distinguished;
//! nothing is shared with `flatland::plane::exact` (no triangulation, no noding, no boundary integral). Only
//! the scene's data and the values of its shades come from flatland.

mod column;
mod frame;
mod sweep;

use flatland::plane::{Film, Scene};
use glam::{DVec2, DVec3};
use rayon::prelude::*;

use column::Integrand;
use frame::Frame;
use sweep::Sweep;

/// A pixel and its derivative.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct PixelOracle {
    /// I = ∫ h f du.
    pub value: DVec3,
    /// dI/dθ.
    pub derivative: DVec3,
    /// The sum of the absolute values of the terms that `derivative` sums, each by its largest
    /// channel: the scale that rounding is measured against.
    pub absolute: f64,
}

/// The oracle of one scene: edges turned and crossings found once, for all pixels.
#[derive(Debug)]
pub struct Oracle<'a> {
    sweep: Sweep,
    integrand: Integrand<'a>,
}

impl<'a> Oracle<'a> {
    /// Prepares `scene`, whose vertices move with `velocities`, in time O(E²).
    ///
    /// Shades must be polynomial: a ramp's creases are not events, so a ramp is integrated inaccurately.
    /// Material shades are taken to be fixed to the material in its present position; for a displaced scene,
    /// give the undisplaced one by [`material`](Self::material).
    pub fn new(scene: &'a Scene, velocities: &'a [DVec2], film: &Film) -> Self {
        assert_eq!(velocities.len(), scene.vertices().len(), "one velocity per vertex");
        Self::turned(scene, velocities, film, Frame::new(scene))
    }

    /// The oracle in a given frame; the result does not depend on the angle.
    fn turned(scene: &'a Scene, velocities: &'a [DVec2], film: &Film, frame: Frame) -> Self {
        let integrand = Integrand { scene, velocities, material: scene.vertices(), film: *film };
        Self { sweep: Sweep::new(scene, velocities, frame), integrand }
    }

    /// The oracle for a scene displaced from `undisplaced`, where its material shades were fixed.
    pub fn material(self, undisplaced: &'a Scene) -> Self {
        let material = undisplaced.vertices();
        assert_eq!(material.len(), self.integrand.material.len(), "one scene displaced");
        Self { integrand: Integrand { material, ..self.integrand }, ..self }
    }

    /// Pixel (x, y).
    pub fn pixel(&self, x: usize, y: usize) -> PixelOracle {
        column::integrate(&self.sweep, &self.integrand, x, y)
    }

    /// All pixels, row by row.
    pub fn image(&self) -> Vec<PixelOracle> {
        let width = self.integrand.film.width();
        let count = width * self.integrand.film.height();
        (0..count).into_par_iter().map(|i| self.pixel(i % width, i / width)).collect()
    }
}

/// Pixel (x, y) of a scene whose vertices move with `velocities`; see [`Oracle::new`].
pub fn pixel(scene: &Scene, velocities: &[DVec2], film: &Film, x: usize, y: usize) -> PixelOracle {
    Oracle::new(scene, velocities, film).pixel(x, y)
}

/// All pixels of a scene whose vertices move with `velocities`, row by row; see [`Oracle::new`].
pub fn image(scene: &Scene, velocities: &[DVec2], film: &Film) -> Vec<PixelOracle> {
    Oracle::new(scene, velocities, film).image()
}

#[cfg(test)]
mod tests;
