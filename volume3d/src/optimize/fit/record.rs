//! What steps found, and what they took.

use std::time::Duration;

use serde::{Deserialize, Serialize};

/// What one step found.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Record {
    /// The mean loss over the step's views, before the step.
    pub loss: f64,
    /// The sum of the penalties.
    pub penalty: f64,
    /// What the rates were multiplied by.
    pub factor: f64,
    /// The length of the gradient by each group of parameters.
    pub norms: Vec<f64>,
    /// How steady it has been, see [`Adam::signal`](super::super::adam::Adam::signal).
    pub signals: Vec<f64>,
    /// Samples that were not finite, and are left out.
    pub non_finite: usize,
    /// Derivatives that were [cut](super::Optimizer::clamp).
    pub clamped: usize,
}

/// Where the time of the steps went.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Times {
    /// Bringing the scene up to date.
    pub update: Duration,
    /// Rendering images.
    pub image: Duration,
    /// Estimating gradients.
    pub gradient: Duration,
    /// Regularisers, preconditioning and the optimiser.
    pub optimizer: Duration,
}
