//! The methods that differentiate an image of a flat world, behind one trait.
//!
//! | method | unbiased | needs |
//! |---|---|---|
//! | [`WarpedArea`] of auxiliary rays | with debiasing; else consistent in their number | nothing |
//! | [`WarpedArea`] of the mean over jumps | yes | a list of all vertices |
//! | [`WarpedArea`] of the softened mean, with its residual | yes | a list of all vertices |
//! | [`EdgeSampling`] | yes | a list of all vertices |
//! | [`FiniteDifference`] | no: O(step²) | two worlds |
//!
//! [`WarpedArea`] takes any construction of the field; with
//! [`Construction::Followed`](crate::transport::fields::Construction) it is the rotation method of
//! Loubet et al. (2019), with `Still` the interior term alone.
//!
//! All methods differentiate the path tracer's own estimate: sample s of pixel p follows the path that
//! the image's sample s of pixel p follows, and auxiliary rays draw from a stream of their own, so that
//! the primal is the same, bit for bit, whether or not a gradient is taken.

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
    /// A short name for tables and legends.
    fn name(&self) -> &'static str;

    /// dI/dθ of every pixel, for one change.
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
