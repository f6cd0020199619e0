//! Derivatives of images, in forward and reverse mode; one file per method.
//!
//! Inverse rendering finds the scene that a picture shows: guess a scene, render it, and descend the gradient
//! of a loss L, a measure of the difference between the pictures. As L is one number and a scene has many
//! parameters, the gradient is computed in reverse: from the adjoint image ∂L/∂I, [`Estimator::reverse`]
//! computes ∂L/∂p for all parameters p at once, silhouettes and shadows included. In forward mode,
//! [`Estimator::forward`] computes dI/dθ along one tangent as an image. [`optimize`](crate::optimize) has
//! named parameters, losses and optimisers; the [`guide`](crate::guide) is the introduction.
//!
//! ```no_run
//! # use volume3d::{gradient::{Estimator, Progress, render}, optimize::{Loss, Parameters}, scene::Scene};
//! # fn f(scene: &Scene, target: &volume3d::Image) -> Result<(), Box<dyn std::error::Error>> {
//! let parameters = Parameters::new(scene, &["bunny.translation", "clay.reflectance"])?;
//! let image = render(scene, 64, 0, &Progress::none())?.image;
//! let (loss, adjoint) = Loss::L2.of(&image, target)?;
//! let active = parameters.active(scene);
//! let gradient = Estimator::auto(16, 1).reverse(scene, &adjoint, &active, &Progress::none())?;
//! let gradient = parameters.gradient(scene, &parameters.values(scene), &gradient.by_parameter);
//! # Ok(())
//! # }
//! ```
//!
//! # Images
//!
//! [`render`] gives every cell of the film its own random numbers: pixels share only the noise of samples
//! within both of their filters. The filter weights of a pixel's samples do not sum to one; a control variate
//! removes the resulting noise without changing the mean. The image of a constant scene is therefore
//! constant, from one sample per pixel on (from two samples on for images returned with gradients).
//!
//! # Which samples are shared
//!
//! A loss L(I) has the gradient Σ ∂L/∂I · dI/dθ. Both factors are estimates, and the mean of their product is
//! the product of their means only if they are independent. At the same seed and number of samples,
//!
//! - [`render`], the gradients of this module and [`FiniteDifference`] draw independent random numbers;
//! - the image returned with a gradient ([`GradientImage::image`]) is made of the gradient's own paths. It
//!   has the mean of [`render`]'s image but different bits and more noise: for the gradient's sake, squares
//!   of 16 × 16 cells share their random numbers, and the noise of their pixels is strongly correlated;
//! - forward and reverse mode of one method share all random numbers, as one is the transpose of the other.
//!
//! An adjoint may therefore be computed from [`render`] at any seed, or from the image of a gradient at
//! **another** seed, but never from the image of a gradient at the seed of the reverse pass. At the optimum
//! of a squared loss, where the true gradient is 0, shared samples give 2 Σ Cov(I, dI/dθ) instead.
//!
//! For an image with the same bits with and without derivatives, use [`WarpedArea::forward`] along any
//! tangent: its image does not depend on what moves. Along [`Tangent::still`] it costs as much as [`render`]
//! with `control_variate` additional samples per pixel (more with implicit surfaces, where camera rays are
//! traced after their field has followed them).

mod accumulator;
mod allocation;
mod auxiliary;
mod border;
mod by_name;
mod camera_rays;
mod contribution;
mod curve;
mod differential;
mod displaced;
mod driver;
mod edge_sampling;
mod error;
mod estimator;
mod film;
mod film_accumulator;
mod filter;
mod finite_difference;
mod followed;
mod forward;
mod groups;
mod hard_shadows;
mod implicit;
mod implicit_field;
mod jump_mean;
mod motion;
mod nearest_discontinuity;
mod non_finite;
mod parts;
mod pilot;
mod pixel_borders;
mod primal;
mod progress;
mod regions;
mod result;
mod reverse;
mod rigid;
mod rigid_motion;
mod rotation;
mod rows;
mod steps;
mod tangent;
#[cfg(test)]
pub(crate) mod tests;
mod unit_weights;
mod unsupported;
mod warped_area;
mod warps;

pub use allocation::Allocation;
pub use by_name::UnknownMethod;
pub use contribution::{Contribution, Source};
pub use edge_sampling::EdgeSampling;
pub use error::GradientError;
pub use estimator::Estimator;
pub(crate) use film::FilmPlane;
pub use finite_difference::FiniteDifference;
pub use implicit::ImplicitTangent;
pub use implicit_field::ImplicitField;
pub use non_finite::NonFinite;
pub use pilot::{Candidate, Choice, Method, Pilot, Reason, Survey};
pub use pixel_borders::OnPixelBorders;
pub use primal::render;
pub(crate) use primal::render_pixels;
pub use progress::{Progress, Stopped};
pub use regions::Regions;
pub use result::{Gradient, GradientImage, Noise, OneSided, Rendering, Terms};
pub use rotation::Rotation;
pub use tangent::{ActiveParameters, CameraTangent, Tangent};
pub use unsupported::{Missing, Unsupported, unsupported};
pub use warped_area::{Field, WarpedArea};

/// Random streams by purpose. Paths of an image, of a gradient and of finite differences are independent at
/// the same seed: the derivative of a loss is a product of image and gradient, whose mean is the product of
/// their means only if they share no sample.
const PATH: u64 = 0;
const GRADIENT_PATH: u64 = 5;
const DIFFERENCE_PATH: u64 = 6;
const AUXILIARY: u64 = 1;
const EDGE: u64 = 2;
const EDGE_AUXILIARY: u64 = 3;
const SPLIT: u64 = 4;
/// Mixed into the seed of the control-variate image, which must not depend on the samples.
const CONTROL_VARIATE: u64 = 0x9E37_79B9_7F4A_7C15;
