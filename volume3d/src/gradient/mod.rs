//! Derivatives of images: what may change, forward and reverse, one file a method.
//!
//! Inverse rendering asks which scene a picture shows. One guesses a scene, renders it, and goes down the gradient of the
//! difference between the pictures, a loss L. As L is one number and a scene has many, the gradient is taken in reverse: the adjoint image
//! ∂L/∂I says of every pixel which way is better, and [`WarpedArea::reverse`] turns it into ∂L/∂p for all parameters p at
//! once, silhouettes and shadows included. Forward, [`WarpedArea::forward`] shows dI/dθ as an image along one change.
//! [`optimize`](crate::optimize) has parameters by name, losses and steps; the [`guide`](crate::guide) begins before that.
//!
//! ```no_run
//! # use volume3d::{gradient::{Progress, WarpedArea, render}, optimize::{Loss, Parameters}, scene::Scene};
//! # fn f(scene: &Scene, target: &volume3d::Image) -> Result<(), Box<dyn std::error::Error>> {
//! let parameters = Parameters::new(scene, &["bunny.translation", "clay.reflectance"])?;
//! let image = render(scene, 64, 0, &Progress::none())?.image;
//! let (loss, adjoint) = Loss::L2.of(&image, target)?;
//! let method = WarpedArea { samples: 16, seed: 1, ..WarpedArea::default() };
//! let gradient = method.reverse(scene, &adjoint, &parameters.active(scene), &Progress::none())?;
//! let gradient = parameters.gradient(scene, &parameters.values(scene), &gradient.by_parameter);
//! # Ok(())
//! # }
//! ```
//!
//! # Images
//!
//! [`render`] gives every cell of the film random numbers of its own, so that pixels have no noise in common
//! but that of samples that both see through their filters. Weights of samples do not sum to one; what that
//! adds to the noise is taken out by a control variate, which leaves the mean as it is: an image of a scene
//! that is the same everywhere is constant, from one sample a pixel on. (Images that come with gradients are,
//! from two samples on.)
//!
//! # Which samples are shared
//!
//! A loss L(I) has the gradient Σ ∂L/∂I · dI/dθ. Both factors are estimates, and the mean of their product is the
//! product of their means only if they are independent. So at the same seed and number of samples
//!
//! - [`render`], the gradients of this module and [`FiniteDifference`] draw independent numbers;
//! - the image that comes with a gradient ([`GradientImage::image`]) is made of the gradient's own paths. It has the same mean as that of
//!   [`render`], but not the same bits, and more noise: squares of 16 cells share their random numbers, for the gradient's sake, and the
//!   noise of their pixels is much the same;
//! - forward and reverse mode of one method share all their numbers, as one is the transpose of the other.
//!
//! Hence an adjoint may be computed from [`render`] at any seed, or from the image of a gradient at **another** seed;
//! never from the image of a gradient at the seed of the reverse pass. At the optimum of a squared loss, where the true
//! gradient is 0, shared samples give 2 Σ Cov(I, dI/dθ) instead.
//!
//! Whoever wants an image that is the same bit for bit with derivatives and without takes it from
//! [`WarpedArea::forward`], along any tangent: it does not depend on what moves, and along [`Tangent::still`] it costs
//! what [`render`] does with `control_variate` more samples a pixel (more at implicit surfaces, which camera rays then meet where their field
//! has followed them).

mod accumulator;
mod allocation;
mod auxiliary;
mod border;
mod boundary;
mod contribution;
mod differential;
mod displaced;
mod driver;
mod edge_sampling;
mod error;
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
mod nearest_jump;
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
mod tangent;
#[cfg(test)]
pub(crate) mod tests;
mod unit_weights;
mod unsupported;
mod warped_area;
mod warps;

pub use allocation::Allocation;
pub use contribution::{Contribution, Source};
pub use edge_sampling::EdgeSampling;
pub use error::GradientError;
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
pub use result::{Gradient, GradientImage, Noise, Rendering, Terms};
pub use rotation::Rotation;
pub use tangent::{ActiveParameters, CameraTangent, Tangent};
pub use unsupported::{Missing, Unsupported, unsupported};
pub use warped_area::{Field, WarpedArea};

/// Streams of random numbers, by what they are for. The paths of an image, of a gradient and of finite differences are
/// independent at the same seed: the derivative of a loss is a product of an image and a gradient, whose mean is the
/// product of their means only if they have no sample in common.
const PATH: u64 = 0;
const GRADIENT_PATH: u64 = 5;
const DIFFERENCE_PATH: u64 = 6;
const AUXILIARY: u64 = 1;
const EDGE: u64 = 2;
const EDGE_AUXILIARY: u64 = 3;
const SPLIT: u64 = 4;
/// Mixed into the seed of the image that is subtracted, which must not depend on the samples.
const CONTROL_VARIATE: u64 = 0x9E37_79B9_7F4A_7C15;
