//! Optimiser of one group of parameters.

use std::borrow::Cow;

use super::super::adam::Adam;
use super::super::grid_steps::GridSteps;
use super::super::large_steps::LargeSteps;
use crate::sdf::Grid;

/// Optimiser settings of one group of parameters.
#[derive(Clone, Debug)]
pub struct Optimizer {
    /// Adam; its `rate` is that of the first step.
    pub adam: Adam,
    /// Laplacian preconditioner for vertex positions: Adam should then be [`uniform`](Adam::uniform).
    pub large_steps: Option<LargeSteps>,
    /// Smoothing and redistancing for the nodes of an SDF grid; for a network on a grid, the refinement
    /// schedule.
    pub grid: Option<GridSteps>,
    /// Clamp of the derivatives to ± this value, before all else, as the code of Vicini et al. (2022) does.
    /// It limits outliers and biases the gradient; [`Record::clamped`](super::Record::clamped) counts the
    /// clamped derivatives. `None` clamps none.
    pub clamp: Option<f64>,
}

impl From<Adam> for Optimizer {
    fn from(adam: Adam) -> Self {
        Self { adam, large_steps: None, grid: None, clamp: None }
    }
}

impl Optimizer {
    /// A step down a gradient; `grid` is given if the group is the nodes of a grid.
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

    /// The clamped gradient, and the number of derivatives that were clamped.
    pub(super) fn clamped<'g>(&self, gradient: &'g [f64]) -> (Cow<'g, [f64]>, usize) {
        let Some(clamp) = self.clamp else { return (gradient.into(), 0) };
        let cut = gradient.iter().filter(|g| g.abs() > clamp).count();
        (gradient.iter().map(|g| g.clamp(-clamp, clamp)).collect(), cut)
    }

    /// Factor of the rates after `steps` steps: it keeps them constant in units of the cells as grids are
    /// refined.
    pub(super) fn fineness(&self, steps: u64) -> f64 {
        self.grid.as_ref().map_or(1.0, |grid| 0.5_f64.powi(grid.refinements(steps) as i32))
    }
}
