//! The boundary-aware mean over auxiliary rays, on an implicit shape.

use super::form::{FieldForm, Tap};
use super::{FieldError, TracedField};
use crate::random::Stream;
use crate::sdf::distance::LevelSetVelocity;
use crate::sdf::space::Directions;
use crate::sdf::tracer::{RayCount, TracePoint, View};
use crate::warp::{Vector, Warp};

/// Estimate of the angle s, in radians, from an auxiliary hit to the silhouette, as a function of the hit
/// alone. n is the unit normal. Only [`Curvature`](Self::Curvature) is that angle; the others are pure
/// numbers used in its place, so that the reach of B depends on the curvature and the distance of the hit
/// surface.
///
/// All of them vanish where the surface turns away from the eye smoothly. A silhouette that is a *corner* (a
/// polygon, a box without rounding) is approached with n·ω far from 0 on the occluder's side: none of them
/// detects it, B stays at 1, and the field misses part of its velocity like a Gaussian one. Round such
/// corners.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum SilhouetteDistance {
    /// |n·ω| ≈ (2kts)^½: the boundary function's order p is halved.
    Grazing,
    /// (n·ω)² ≈ 2kts.
    GrazingSquared,
    /// (n·ω)²/(2kt), with the distance t and the surface's curvature k = ω·Hω/|∇φ| along the ray: s itself to
    /// first order, at any scale. Infinite where the surface is not convex along the ray.
    #[default]
    Curvature,
}

impl SilhouetteDistance {
    /// The distance from the hit of a ray along ω at t, from ∇φ and Hω there.
    #[must_use]
    pub fn of<V: Vector>(self, t: f64, direction: V, gradient: V, hessian: impl FnOnce() -> V) -> f64 {
        let length = gradient.dot(gradient).sqrt();
        let cosine = (gradient.dot(direction) / length).abs();
        match self {
            Self::Grazing => cosine,
            Self::GrazingSquared => cosine * cosine,
            Self::Curvature => {
                let curvature = hessian().dot(direction) / length;
                if curvature > 0.0 { cosine * cosine / (2.0 * curvature * t) } else { f64::INFINITY }
            }
        }
    }
}

/// V = P_ω Σ Ω_i V_i over auxiliary rays, with V_i = P G(x_i)/t_i at their hits (Bangaru, Li and Durand 2020,
/// for implicit shapes).
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct AuxiliaryField {
    /// Weight and number of rays.
    pub warp: Warp,
    /// The kernel's concentration, in radians⁻².
    pub kappa: f64,
    /// The argument of B.
    pub distance: SilhouetteDistance,
}

impl<D: Directions> TracedField<D> for AuxiliaryField {
    fn form(&self, view: &View<'_, D::Vector>, direction: D::Vector, rng: &mut Stream) -> FieldForm<D> {
        let mut rays = RayCount::default();
        let stencil = self.warp.stencil::<D, _>(direction, self.kappa, rng, |omega| {
            let trace = view.trace(omega);
            rays += trace.count();
            let hit = trace.hit().copied();
            let distance = |hit: TracePoint<_>| {
                let hessian = || view.sdf.second_order(hit.position).hessian * omega;
                self.distance.of(hit.t, omega, hit.jet.gradient, hessian)
            };
            let distance = hit.map_or(f64::INFINITY, distance);
            (hit.map(|hit| (omega, hit)), distance)
        });
        let taps = stencil.terms().iter().filter_map(|term| {
            let (omega, hit) = term.hit?;
            // V_i = φ̇ times this.
            let velocity = D::project(omega, LevelSetVelocity::new(hit.jet.gradient).e()) * (1.0 / hit.t);
            Some(Tap {
                point: hit.position,
                value: velocity * term.weight,
                slope: term.divergence.dot(velocity),
                gradient: D::Vector::ZERO,
            })
        });
        FieldForm::new(direction, taps.collect(), rays)
    }

    fn check(&self) -> Result<(), FieldError> {
        Ok(self.warp.check(self.kappa)?)
    }
}
