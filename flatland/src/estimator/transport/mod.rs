//! The methods that differentiate an image of a flat world, behind one trait.
//!
//! | method | unbiased | needs |
//! |---|---|---|
//! | [`WarpedArea`] of auxiliary rays | with debiasing; else consistent in their number | nothing |
//! | [`WarpedArea`] of the mean over discontinuities | yes | a list of all vertices |
//! | [`WarpedArea`] of the softened mean, with its residual | yes | a list of all vertices |
//! | [`EdgeSampling`] | yes | a list of all vertices |
//! | [`FiniteDifference`] | no: O(step²) | two worlds |
//!
//! [`WarpedArea`] accepts any construction of the field; with
//! [`Construction::Followed`](crate::transport::fields::Construction) it is the rotation method of Loubet et
//! al. (2019), with `Still` the interior term alone.
//!
//! All methods differentiate the path tracer's own estimate: sample s of pixel p follows the same path as the
//! image's sample s of pixel p. Auxiliary rays use a separate stream, so that the primal has the same bits
//! with and without a gradient.

mod driver;
mod edge_sampling;
mod fault;
mod film_jumps;
mod finite_difference;
mod jumps;
mod kernels;
mod record;
mod residual;
mod streams;
mod sweep;
#[cfg(test)]
mod tests;
mod warped_area;

pub use driver::{Errors, Gradient, GradientImage};
pub use edge_sampling::EdgeSampling;
pub use fault::Fault;
pub use finite_difference::FiniteDifference;
pub use jumps::EdgeChoice;
pub use kernels::Kernels;
pub use warped_area::WarpedArea;

use super::error::EstimatorError;
use crate::transport::{Camera, Tangent, World};

/// A method that differentiates an image of a flat world.
pub trait Method: Sync {
    /// Short name for tables and legends.
    fn name(&self) -> &'static str;

    /// dI/dθ of every pixel, for one tangent.
    ///
    /// # Errors
    /// A [`EstimatorError`] that names the parameter.
    fn forward(
        &self,
        world: &World,
        camera: &Camera,
        change: &Tangent,
    ) -> Result<GradientImage, EstimatorError>;

    /// dL/dp of every parameter, for the loss whose adjoint image is ∂L/∂I.
    ///
    /// # Errors
    /// A [`EstimatorError`] that names the parameter.
    fn reverse(&self, world: &World, camera: &Camera, adjoint: &[f64]) -> Result<Gradient, EstimatorError>;
}
