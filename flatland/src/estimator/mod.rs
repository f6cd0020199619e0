//! The methods that differentiate an image, behind one trait.
//!
//! | method | unbiased | needs |
//! |---|---|---|
//! | [`Exact`] | exact | the arrangement of all edges |
//! | [`WarpedArea`] of auxiliary points | with debiasing; else consistent in their number | nothing |
//! | [`WarpedArea`] of the mean over discontinuities | yes | a list of all edges |
//! | softened [`WarpedArea`], with its residual | yes, if no visible edges coincide | a list of all edges |
//! | [`EdgeSampling`] | yes, if no visible edges coincide | a list of all edges |
//! | [`Rotation`] | no | nothing |
//! | [`FiniteDifference`] | no: O(step²) | two scenes |
//!
//! Forward mode differentiates every pixel with respect to one parameter, a [`Motion`]. Reverse mode
//! differentiates one loss, given as its adjoint image ∂L/∂I, with respect to every vertex. All sampled
//! methods draw sample s of pixel p from a stream of its own, so that results depend only on the seed, and
//! forward and reverse mode use the same random numbers: they are a linear map and its transpose.
//!
//! These methods take scenes of polygons. Methods for two-dimensional worlds with light scattering are in
//! [`transport`], methods for implicit shapes in [`sdf`]: all share one driver, one [`Estimate`] and one
//! [`EstimatorError`].

mod area_integral;
mod boundary_integral;
pub mod chain;
mod driver;
mod edge_points;
mod edge_sampling;
mod error;
mod estimate;
mod exact;
mod finite_difference;
mod plane;
mod rotation;
pub mod sdf;
pub mod transport;
mod warped_area;

pub use area_integral::{AreaIntegral, Form};
pub use boundary_integral::BoundaryIntegral;
pub use edge_sampling::EdgeSampling;
pub use error::EstimatorError;
pub use estimate::Estimate;
pub use exact::Exact;
pub use finite_difference::FiniteDifference;
pub use plane::{GradientImage, VertexGradient};
pub use rotation::Rotation;
pub use warped_area::{Construction, WarpedArea};

use crate::plane::{Film, Image, Motion, Scene};

/// A method that differentiates the image of a scene of polygons.
pub trait Method: Sync {
    /// Short name for tables and legends.
    fn name(&self) -> &'static str;

    /// dI/dθ of every pixel, for one motion.
    ///
    /// # Errors
    /// An [`EstimatorError`] that names the parameter, or the place where no derivative exists.
    fn forward(&self, scene: &Scene, motion: &Motion, film: &Film) -> Result<GradientImage, EstimatorError>;

    /// dL/dp of every vertex, for the loss whose adjoint image is ∂L/∂I.
    ///
    /// # Errors
    /// An [`EstimatorError`] that names the parameter, or the place where no derivative exists.
    fn reverse(&self, scene: &Scene, film: &Film, adjoint: &Image) -> Result<VertexGradient, EstimatorError>;
}
