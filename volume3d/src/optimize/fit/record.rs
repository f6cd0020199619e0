//! Log and timings of the steps of a fit.

use std::time::Duration;

use serde::{Deserialize, Serialize};

/// The log entry of one step.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Record {
    /// The mean loss over the step's views, before the step.
    pub loss: f64,
    /// The sum of the penalties.
    pub penalty: f64,
    /// The factor of the rates.
    pub factor: f64,
    /// The norm of the gradient by each group of parameters.
    pub norms: Vec<f64>,
    /// The signal-to-noise measure of each group, see [`Adam::signal`](super::super::adam::Adam::signal).
    pub signals: Vec<f64>,
    /// Samples left out because they were not finite.
    pub non_finite: usize,
    /// Number of [clamped](super::Optimizer::clamp) derivatives.
    pub clamped: usize,
}

/// Time spent in each part of the steps.
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
