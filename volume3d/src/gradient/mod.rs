//! Derivatives of images: what may change, forward and reverse, one file a method.

mod auxiliary;
mod change;
mod displaced;
mod driver;
mod edge_sampling;
mod error;
mod film;
mod finite_difference;
mod forward;
mod groups;
mod motion;
mod outline;
mod primal;
mod progress;
mod result;
mod reverse;
mod rigid;
mod rotation;
mod seen;
mod strip;
#[cfg(test)]
mod tests;
mod warped_area;
mod warps;

pub use change::{CameraChange, Change, Unsupported, Wanted};
pub use edge_sampling::EdgeSampling;
pub use error::GradientError;
pub use finite_difference::FiniteDifference;
pub use primal::render;
pub use progress::{Progress, Stopped};
pub use result::{Gradient, GradientImage, Image, NonFinite, Terms};
pub use rotation::Rotation;
pub use warped_area::{Field, WarpedArea};

/// Streams of random numbers, by what they are for: a path is the same whether its gradient is taken or not.
const PATH: u64 = 0;
const AUXILIARY: u64 = 1;
const EDGE: u64 = 2;
const EDGE_AUXILIARY: u64 = 3;
const SPLIT: u64 = 4;
/// Mixed into the seed of the image that is subtracted, which must not depend on the samples.
const BASELINE: u64 = 0x9E37_79B9_7F4A_7C15;
