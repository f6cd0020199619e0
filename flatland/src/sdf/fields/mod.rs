//! All constructions of the warp field over directions, for implicit shapes (Theory 10).
//!
//! | construction | continuous | boundary consistent | needs |
//! |---|---|---|---|
//! | [`DirectField`] | no: discontinuous at silhouettes | yes | the hit |
//! | [`AuxiliaryField`] | yes | if pγ ≥ 1; not at corners | auxiliary rays |
//! | [`BangaruField`] | if ∇φ is | if γ > 1, at the rate δ if γ > 2; not at corners | the points of one ray |
//! | [`ViciniField`] | if ∇φ is | in the limit ε → 0; not at corners | the points of one ray |
//! | [`HarmonicField`](super::exact::HarmonicField) | yes | yes | all silhouettes |
//!
//! All except the last are a [`FieldForm`]: linear in ∂_θφ and ∇∂_θφ at several points, with coefficients
//! that do not depend on the motion.
//!
//! # Bias
//!
//! The two fields of tracer points are exact functions of ω, and so is their divergence: no finite difference
//! or random quotient is involved. Yet ∇φ must be continuous in the free space that rays cross. Across the
//! medial axis between two shapes, behind a reflex corner and at the cell edges of a bilinear grid it is
//! discontinuous, and with it the weights of the points; ∇·V misses these discontinuities, a bias that no
//! number of steps removes. [`SmoothUnion`](super::shapes::SmoothUnion) and a bicubic grid have none. Nor is
//! V differentiable where ∇φ = 0, at the saddle between any two shapes, unless 1/|∇φ|² is bounded there, as
//! it is here.
//!
//! None of them follows a silhouette that is a sharp corner: on the adjacent faces G is the velocity along
//! *their* normals, not the corner's velocity, and φ at a hit carries no information about a nearby corner.
//! Round it: a corner of radius r is a smooth silhouette, resolved by rays that pass it within a fraction of
//! r. The harmonic field and [`RelaxedBoundary`](crate::estimator::sdf::RelaxedBoundary), which uses only
//! points outside, support corners.

mod auxiliary;
mod bangaru;
mod direct;
mod form;
mod mean;
mod vicini;

pub use auxiliary::{AuxiliaryField, SilhouetteDistance};
pub use bangaru::{BangaruField, PointKernel};
pub use direct::DirectField;
pub use form::{FieldForm, Tap};
pub use vicini::{MeanPoint, ViciniField};

use super::space::Directions;
use super::tracer::{RayCount, View};
use crate::random::Stream;
use crate::warp::{Field, LinearField as _, WarpError, WarpField};

/// A field that is linear in ∂_θφ and ∇∂_θφ at points of rays.
pub trait TracedField<D: Directions>: Sync {
    /// The coefficients of (V, ∇·V) in the direction ω.
    fn form(&self, view: &View<'_, D::Vector>, direction: D::Vector, rng: &mut Stream) -> FieldForm<D>;

    /// Checks the parameters once, so that [`form`](Self::form) need not.
    ///
    /// # Errors
    /// A [`FieldError`] that names the parameter.
    fn check(&self) -> Result<(), FieldError>;
}

/// Invalid parameters of a field.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum FieldError {
    /// A parameter of a weight is out of its range.
    #[error("the weight's {parameter} = {value} is not {wanted}")]
    Weight {
        /// Name of the parameter.
        parameter: &'static str,
        /// Its value.
        value: f64,
        /// Its admissible range.
        wanted: &'static str,
    },
    /// The auxiliary rays' parameters are out of range.
    #[error(transparent)]
    Warp(#[from] WarpError),
    /// A direction has the wrong number of parameters.
    #[error("a direction of {found} parameters for a shape that has {expected}")]
    Direction {
        /// Number of the shape's parameters.
        expected: usize,
        /// Number given.
        found: usize,
    },
}

/// Refuses a value that is not finite, or for which `holds` is false.
fn check(parameter: &'static str, value: f64, wanted: &'static str, holds: bool) -> Result<(), FieldError> {
    let good = value.is_finite() && holds;
    if good { Ok(()) } else { Err(FieldError::Weight { parameter, value, wanted }) }
}

/// A warp field for one motion of a shape, as used by forward mode.
pub trait MotionField<D: Directions>: Sync {
    /// The direction in parameter space along which the shape moves.
    fn direction(&self) -> &[f64];

    /// (V, ∇·V) at ω, or an estimate of them, and the number of rays.
    fn sample(&self, omega: D::Vector, rng: &mut Stream) -> (Field<D::Vector>, RayCount);
}

/// A traced field for one motion, with validated parameters and direction.
#[derive(Clone, Copy)]
pub struct MovingField<'a, D: Directions, F: ?Sized> {
    view: View<'a, D::Vector>,
    field: &'a F,
    direction: &'a [f64],
}

impl<'a, D: Directions, F: TracedField<D> + ?Sized> MovingField<'a, D, F> {
    /// The field of a shape that moves along a direction in parameter space.
    ///
    /// # Errors
    /// If a parameter of the field is out of range or the direction does not fit the shape.
    pub fn new(view: View<'a, D::Vector>, field: &'a F, direction: &'a [f64]) -> Result<Self, FieldError> {
        field.check()?;
        let (expected, found) = (view.sdf.parameter_count(), direction.len());
        if expected != found {
            return Err(FieldError::Direction { expected, found });
        }
        Ok(Self { view, field, direction })
    }

    /// The coefficients of the field in the direction ω.
    pub fn form(&self, omega: D::Vector, rng: &mut Stream) -> FieldForm<D> {
        self.field.form(&self.view, omega, rng)
    }
}

impl<D: Directions, F: TracedField<D> + ?Sized> MotionField<D> for MovingField<'_, D, F>
where
    D::Vector: Sync,
{
    fn direction(&self) -> &[f64] {
        self.direction
    }

    fn sample(&self, omega: D::Vector, rng: &mut Stream) -> (Field<D::Vector>, RayCount) {
        let form = self.form(omega, rng);
        (form.field(|x| self.view.sdf.rate(*x, self.direction)), form.rays())
    }
}

impl<D: Directions, F: TracedField<D> + ?Sized> WarpField<D> for MovingField<'_, D, F>
where
    D::Vector: Sync,
{
    fn at(&self, u: D::Vector, rng: &mut Stream) -> (Field<D::Vector>, u64) {
        let (field, rays) = self.sample(u, rng);
        (field, rays.traced)
    }
}

#[cfg(test)]
mod tests;
