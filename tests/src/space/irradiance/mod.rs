//! Direct light: irradiance from flat polygons past flat polygons, and its derivative, exactly.
//!
//! The part of each emitter visible from a point x is cut out by planes through x: above the horizon, and
//! outside the cones over everything in front of it. The part of an occluder in front of an emitter is the
//! part on x's side of the emitter's plane; it occludes exactly its cone, even where the two intersect. The
//! remainder is convex pieces, and over each of them Lambert's formula integrates the cosine in closed form.
//! The construction runs in dual numbers, whose real parts decide the cuts: corners move with the polygons
//! they are made of, and there is no boundary term to add.
//!
//! The part of a uniform environment that a surface occludes is as large as the visible part of the surface,
//! so that
//!
//! ```text
//! E = Σ_i F_i L_i + (π − Σ_i F_i) L_environment,   F_i = ∫ max(0, n·ω) dω over the visible part of i
//! ```

mod clip;
mod lambert;
mod receiver;
mod surface;

use std::f64::consts::PI;

use anyhow::{Context as _, Result, ensure};
use glam::DVec3;
use num_dual::Dual64;

pub use receiver::{Ground, Ray, Receiver};
pub use surface::{Sides, Surface};

use crate::dual::Vector3;
pub(in crate::space) use clip::{Corners, keep, without_cone};
use lambert::cosine_integral;
pub(in crate::space) use surface::area_vector;

/// Distance from the receiver to a surface's plane, relative to their coordinates, up to which the surface
/// counts as seen edge-on: rounding.
const EDGE_ON: f64 = 1e-13;

/// Opaque surfaces in a uniform environment. They may intersect, but no two may overlap in one plane: neither
/// would be in front.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct World {
    /// Emitters and occluders, in any order. Emitters occlude, too. The receiver's own surface is not among
    /// them: its horizon replaces it.
    pub surfaces: Vec<Surface>,
    /// The environment's radiance, linear RGB.
    pub environment: DVec3,
}

impl World {
    /// Rejects numbers that are not finite and surfaces that are not flat and convex.
    pub fn check(&self) -> Result<()> {
        ensure!(self.environment.is_finite(), "the environment is not finite");
        let mut surfaces = self.surfaces.iter().enumerate();
        surfaces.try_for_each(|(i, surface)| surface.check().with_context(|| format!("surface {i}")))
    }

    /// The world at θ, at rest.
    pub fn displaced(&self, theta: f64) -> Self {
        let surfaces = self.surfaces.iter().map(|s| s.displaced(theta)).collect();
        Self { surfaces, ..self.clone() }
    }
}

/// A form factor times π, its derivative and its scale.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Factor {
    /// F = ∫ max(0, n·ω) dω over the visible part of a surface: π times the form factor.
    pub value: f64,
    /// dF/dθ.
    pub derivative: f64,
    /// The sum of the absolute values of the terms that `derivative` sums: the scale that rounding
    /// is measured against.
    pub absolute: f64,
    /// Whether the visible side emits.
    pub is_lit: bool,
}

/// Irradiance, or radiosity.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Irradiance {
    /// E = ∫ L max(0, n·ω) dω.
    pub value: DVec3,
    /// dE/dθ.
    pub derivative: DVec3,
    /// The sum of the absolute values of the terms that `derivative` sums, each by its largest
    /// channel.
    pub absolute: f64,
}

impl Irradiance {
    /// The radiance that a diffuse receiver sends in all directions, albedo/π · E.
    pub fn outgoing(&self, albedo: DVec3) -> Self {
        let factor = albedo / PI;
        Self {
            value: factor * self.value,
            derivative: factor * self.derivative,
            absolute: factor.abs().max_element() * self.absolute,
        }
    }
}

/// E and dE/dθ at a receiver.
///
/// The derivative exists where no two edges are aligned as seen from the receiver and no surface is seen
/// edge-on; only the second condition is checked. For an emitter whose size is 10⁻ᵏ of its distance, the last
/// k of 16 digits are lost.
///
/// # Errors
/// If the world or the receiver is refused, the receiver is in the plane of a surface that rises above the
/// horizon, or the answer is not finite.
pub fn irradiance(world: &World, receiver: &Receiver) -> Result<Irradiance> {
    world.check()?;
    unchecked(world, receiver)
}

/// [`irradiance`] of a world that was checked before.
pub(super) fn unchecked(world: &World, receiver: &Receiver) -> Result<Irradiance> {
    let factors = unchecked_factors(world, receiver)?;
    let mut sum = Irradiance { value: PI * world.environment, ..Irradiance::default() };
    for (index, (surface, factor)) in world.surfaces.iter().zip(factors).enumerate() {
        let own = if factor.is_lit { surface.radiance } else { DVec3::ZERO };
        let radiance = own - world.environment;
        sum.value += factor.value * radiance;
        sum.derivative += factor.derivative * radiance;
        sum.absolute += factor.absolute * radiance.abs().max_element();
        ensure!(sum.value.is_finite() && sum.derivative.is_finite(), "surface {index}: overflow");
    }
    Ok(sum)
}

/// The factor of every surface.
pub fn factors(world: &World, receiver: &Receiver) -> Result<Vec<Factor>> {
    world.check()?;
    unchecked_factors(world, receiver)
}

fn unchecked_factors(world: &World, receiver: &Receiver) -> Result<Vec<Factor>> {
    receiver.check()?;
    let normal = Vector3::new(receiver.normal, receiver.normal_rate).unit();
    let views: Vec<_> = world
        .surfaces
        .iter()
        .enumerate()
        .map(|(i, surface)| View::new(i, surface, receiver, normal))
        .collect::<Result<_, _>>()?;
    let checked = |surface: usize| {
        let factor = factor(&views, surface, normal);
        ensure!(factor.value.is_finite() && factor.derivative.is_finite(), "surface {surface}: overflow");
        Ok(factor)
    };
    (0..views.len()).map(checked).collect()
}

/// A surface as seen by the receiver: corners from x, counterclockwise around their cone.
struct View {
    corners: Corners,
    /// The corners' part above the horizon, empty if there is none.
    risen: Corners,
    /// Twice the area times the normal that points away from x.
    outward: Vector3,
    is_lit: bool,
}

impl View {
    fn new(index: usize, surface: &Surface, receiver: &Receiver, normal: Vector3) -> Result<Self> {
        let mut corners = surface.seen_from(Vector3::new(receiver.point, receiver.velocity));
        let mut outward = area_vector(&corners);
        let height = outward.dot(corners[0]).re;
        if height < 0.0 {
            corners.reverse();
            outward = area_vector(&corners);
        }
        let risen = keep(&corners, |d| normal.dot(d));
        let coordinates = surface.vertices.iter().chain([&receiver.point]);
        let magnitude = coordinates.map(|p| p.length()).fold(0.0, f64::max);
        let is_edge_on = height.abs() <= EDGE_ON * outward.value().length() * magnitude;
        // Its visible factor has a kink there.
        ensure!(risen.is_empty() || !is_edge_on, "the receiver is in the plane of surface {index}");
        // The front is visible where its normal points to x.
        let is_lit = surface.sides == Sides::Both || height < 0.0;
        Ok(Self { corners, risen, outward, is_lit })
    }

    /// The part of another surface that is on x's side of this one's plane.
    fn in_front(&self, other: &Self) -> Corners {
        let anchor = self.corners[0];
        keep(&other.risen, |d| self.outward.dot(anchor - d))
    }
}

fn factor(views: &[View], i: usize, normal: Vector3) -> Factor {
    let mut pieces = vec![views[i].risen.clone()];
    for other in (0..views.len()).filter(|&j| j != i) {
        let cone = views[i].in_front(&views[other]);
        if !cone.is_empty() {
            pieces = pieces.into_iter().flat_map(|piece| without_cone(piece, &cone)).collect();
        }
    }
    let mut sum = Dual64::from(0.0);
    let mut absolute = 0.0;
    for (part, scale) in pieces.iter().map(|piece| cosine_integral(piece, normal)) {
        sum += part;
        absolute += scale;
    }
    Factor { value: sum.re, derivative: sum.eps, absolute, is_lit: views[i].is_lit }
}

#[cfg(test)]
mod tests;
