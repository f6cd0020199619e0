//! From gradients to fitted scenes: parameters as one vector, losses with their adjoint images, and
//! optimisers.
//!
//! One step of a fit renders an image, obtains the adjoint ∂L/∂I from a [`Loss`], propagates it back through
//! the image with a method of [`gradient`](crate::gradient), converts the result to the derivative by the
//! fitted [`Parameters`], and lets an optimiser choose a step:
//!
//! ```text
//! x → scene → I → L, ∂L/∂I → ∂L/∂scene → ∂L/∂x → step
//! ```
//!
//! [`Fit`] takes such steps over several views, and its [`State`] can be saved to a file and resumed bit for
//! bit; `volume3d fit` is its command line. A fit loop written by hand is `examples/pose.rs`.
//!
//! | what is fitted | steps |
//! |---|---|
//! | a pose, a few lights, with many samples | [`lbfgs()`] in the coordinates of a [`Chart`] |
//! | poses, materials, textures, with noise | [`Adam`], with a [`Schedule`] |
//! | vertices of a mesh | [`Adam::uniform`] between two solves of [`LargeSteps`] |
//! | nodes of a grid of distances | [`Adam`] between two solves of [`GridSteps`], from a coarse grid to a fine one |
//!
//! A mesh keeps its topology throughout: there is no remeshing. Between two fits a mesh can be written,
//! remeshed by another program, and read again; [`Regularizer::EdgeLength`] prevents the collapse of edges,
//! and triangles may pass through one another, because intersections are handled like edges.
//!
//! An implicit surface may also be supervised by masks, [`MaskLoss`], and a network be kept near a distance,
//! [`Penalty::Eikonal`], both as in IDR. [`mask`] degrades masks, for studies.
//!
//! The samples of the image must be independent of those of the gradient, or their product is biased:
//! [`render`](crate::gradient::render) draws independent ones at any seed.

mod adam;
mod chart;
mod checkpoint;
mod fingerprint;
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
mod parts;
mod pose;
mod quantity;
mod regularizer;
mod schedule;
mod silhouettes;
mod taps;
mod task_error;
#[cfg(test)]
mod tests;

pub use adam::Adam;
pub use chart::Chart;
pub use checkpoint::{
    CheckpointError, StateError, decode_state, encode_state, read_checkpoint, write_checkpoint,
};
pub use fingerprint::Problem;
pub use fit::{Fit, FitError, Optimizer, Plan, Record, State, Times, Told};
pub use grid_steps::GridSteps;
pub use large_steps::{LargeSteps, LargeStepsError};
pub use lbfgs::{End, Lbfgs, LbfgsError, Minimum, lbfgs};
pub use loss::{Loss, LossError};
pub use mask_loss::{MaskEvaluation, MaskLoss, MaskLossError};
pub use name::{Lack, NameParts, ParameterError};
pub use objective::{Evaluation, MaskTerm, Objective, ObjectiveError, Penalty, Reverse, View};
pub use parameters::{Group, Parameters, Placed};
pub use parts::{Part, PartsError, Task};
pub use quantity::{Member, Quantity, TextureUse};
pub use regularizer::Regularizer;
pub use schedule::Schedule;
pub use silhouettes::silhouette_weights;
pub use task_error::TaskError;
