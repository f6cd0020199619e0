//! How a group of parameters is moved.

use std::borrow::Cow;

use super::super::adam::Adam;
use super::super::grid_steps::GridSteps;
use super::super::large_steps::LargeSteps;
use crate::sdf::Grid;

/// How one group of parameters is moved.
#[derive(Clone, Debug)]
pub struct Optimizer {
    /// The sizes of steps; its `rate` is that of the first step.
    pub adam: Adam,
    /// For vertex positions, what keeps steps smooth: then Adam should be [`uniform`](Adam::uniform).
    pub large_steps: Option<LargeSteps>,
    /// For the nodes of a grid of distances, what keeps steps smooth, and them distances. For a network on a grid, when that becomes
    /// finer.
    pub grid: Option<GridSteps>,
    /// Derivatives beyond ± this are cut down to it before all else, as the code of Vicini et al. (2022) does. It tames few large ones,
    /// and biases the gradient: how many were cut is in [`Record::clamped`](super::Record::clamped). `None` cuts none.
    pub clamp: Option<f64>,
}

impl From<Adam> for Optimizer {
    fn from(adam: Adam) -> Self {
        Self { adam, large_steps: None, grid: None, clamp: None }
    }
}

impl Optimizer {
    /// A step down a gradient; of the nodes of a grid, if it is one.
    pub(super) fn step(&self, adam: &mut Adam, gradient: &[f64], grid: Option<&Grid>) -> Vec<f64> {
        match (&self.large_steps, &self.grid, grid) {
            (Some(large), ..) => large.solve(&adam.step(&large.solve(gradient))),
            (None, Some(steps), Some(grid)) if steps.smoothing > 0.0 => {
                let size = grid.size();
                steps.solve(size, &adam.step(&steps.solve(size, gradient)))
            }
            _ => adam.step(gradient),
        }
    }

    /// A gradient with its derivatives within bounds, and how many were not.
    pub(super) fn clamped<'g>(&self, gradient: &'g [f64]) -> (Cow<'g, [f64]>, usize) {
        let Some(clamp) = self.clamp else { return (gradient.into(), 0) };
        let cut = gradient.iter().filter(|g| g.abs() > clamp).count();
        (gradient.iter().map(|g| g.clamp(-clamp, clamp)).collect(), cut)
    }

    /// What rates are multiplied by after so many steps: as grids become finer, in units of their cells they stay.
    pub(super) fn fineness(&self, steps: u64) -> f64 {
        self.grid.as_ref().map_or(1.0, |grid| 0.5_f64.powi(grid.refinements(steps) as i32))
    }
}
