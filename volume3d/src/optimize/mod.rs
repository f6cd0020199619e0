//! From gradients to fitted scenes: parameters as one vector, losses with their adjoint images, and optimisers.
//!
//! One step of a fit renders an image, asks a [`Loss`] for the adjoint ∂L/∂I, propagates it back through the image with a method of
//! [`gradient`](crate::gradient), turns the result into the derivative by the [`Parameters`] that are fitted, and lets an
//! optimiser choose a step:
//!
//! ```text
//! x → scene → I → L, ∂L/∂I → ∂L/∂scene → ∂L/∂x → step
//! ```
//!
//! | what is fitted | steps |
//! |---|---|
//! | a pose, a few lights, with many samples | [`lbfgs()`] in the coordinates of a [`Chart`] |
//! | poses, materials, textures, with noise | [`Adam`] |
//! | vertices of a mesh | [`Adam::uniform`] between two solves of [`LargeSteps`] |
//!
//! The image must come from other samples than the gradient, or their product is biased: [`render`](crate::gradient::render) draws its own at
//! any seed.

mod adam;
mod chart;
mod large_steps;
mod lbfgs;
mod loss;
mod parameters;
mod pose;
mod quantity;
mod regularizer;
#[cfg(test)]
mod tests;

pub use adam::Adam;
pub use chart::Chart;
pub use large_steps::{LargeSteps, LargeStepsError};
pub use lbfgs::{End, Lbfgs, LbfgsError, Minimum, lbfgs};
pub use loss::{Loss, LossError};
pub use parameters::{Group, Parameters};
pub use quantity::{ParameterError, Quantity};
pub use regularizer::Regularizer;
