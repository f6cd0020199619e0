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
//! [`Fit`] takes such steps over several views, and its [`State`] can be kept in a file and gone on with to the same bits; `volume3d
//! fit` is its command line. What is written by hand instead is `examples/pose.rs`.
//!
//! | what is fitted | steps |
//! |---|---|
//! | a pose, a few lights, with many samples | [`lbfgs()`] in the coordinates of a [`Chart`] |
//! | poses, materials, textures, with noise | [`Adam`], with a [`Schedule`] |
//! | vertices of a mesh | [`Adam::uniform`] between two solves of [`LargeSteps`] |
//! | nodes of a grid of distances | [`Adam`] between two solves of [`GridSteps`], from a coarse grid to a fine one |
//!
//! A mesh keeps its topology throughout: there is no remeshing. Between two fits a mesh can be written, remeshed by
//! another program, and read again; edges that collapse are kept alive by [`Regularizer::EdgeLength`], and triangles that pass through one
//! another are seen as such, as crossings are followed like edges.
//!
//! An implicit surface may besides be told by masks where it is seen, [`MaskLoss`], and a network be kept near a distance, [`Penalty::Eikonal`], both as in IDR.
//! [`mask`] spoils masks, for studies.
//!
//! The image must come from other samples than the gradient, or their product is biased: [`render`](crate::gradient::render) draws its own at
//! any seed.

mod adam;
mod chart;
mod checkpoint;
mod fit;
mod grid_steps;
mod large_steps;
mod lbfgs;
mod loss;
pub mod mask;
mod mask_loss;
mod name;
mod objective;
mod parameters;
mod pose;
mod quantity;
mod regularizer;
mod schedule;
mod silhouettes;
mod taps;
#[cfg(test)]
mod tests;

pub use adam::Adam;
pub use chart::Chart;
pub use checkpoint::{CheckpointError, read_checkpoint, write_checkpoint};
pub use fit::{Fit, FitError, Optimizer, Plan, Record, State, Times};
pub use grid_steps::GridSteps;
pub use large_steps::{LargeSteps, LargeStepsError};
pub use lbfgs::{End, Lbfgs, LbfgsError, Minimum, lbfgs};
pub use loss::{Loss, LossError};
pub use mask_loss::{MaskEvaluation, MaskLoss, MaskLossError};
pub use name::{Lack, NameParts, ParameterError};
pub use objective::{Evaluation, MaskTerm, Objective, ObjectiveError, Penalty, Reverse, View};
pub use parameters::{Group, Parameters};
pub use quantity::{Member, Quantity, TextureUse};
pub use regularizer::Regularizer;
pub use schedule::Schedule;
pub use silhouettes::silhouette_weights;
