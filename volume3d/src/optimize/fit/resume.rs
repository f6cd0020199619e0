//! Resuming from a checkpoint.

use super::super::adam::Adam;
use super::super::grid_steps::GridSteps;
use super::{Fit, State, surface};
use crate::scene::Scene;

impl Fit {
    /// Resumes from a state, including the moments of the optimisers. Grids of the scene are refined as they
    /// were.
    ///
    /// # Errors
    /// A message that says why the state does not belong to this fit.
    pub fn resumed(self, state: State, scene: &mut Scene) -> Result<Self, &'static str> {
        if state.records.len() as u64 > self.plan.steps {
            return Err(
                "it has taken more steps than the configuration asks for; `steps` may be raised, but not below those taken",
            );
        }
        // All sizes are checked before any grid is refined.
        let counts: Vec<usize> = (0..self.optimizers.len()).map(|i| self.numbers(i, &state, scene)).collect();
        let other = "it is of other parameters";
        let same = |(adam, count): (&Adam, &usize)| adam.len().is_none_or(|len| len == *count);
        let fits = state.adams.len() == counts.len() && state.adams.iter().zip(&counts).all(same);
        if state.x.len() != counts.iter().sum::<usize>() || !fits {
            return Err(other);
        }
        let of_mean = if self.averaged.is_some() { state.x.len() } else { 0 };
        if state.mean.len() != of_mean {
            return Err("it is of a fit with another mean of its parameters");
        }
        let (mut parameters, mut x) = (self.parameters, self.state.x);
        for (i, optimizer) in self.optimizers.iter().enumerate() {
            let Some(steps) = &optimizer.grid else { continue };
            for _ in 0..steps.refinements(state.records.len() as u64) {
                let none = "it has no grid";
                let finer = surface::finer(&parameters.groups()[i], scene).ok_or(none)?;
                (parameters, x) = surface::replace(parameters, &x, i, finer, scene).map_err(|_| none)?;
            }
        }
        if state.x.len() != x.len() {
            return Err(other);
        }
        for (i, optimizer) in self.optimizers.iter().enumerate() {
            let finishes = |steps: &GridSteps| steps.is_finishing(state.records.len() as u64);
            if !optimizer.grid.as_ref().is_some_and(finishes) {
                continue;
            }
            let none = "its network has no surface";
            parameters.apply(&state.x, scene).map_err(|_| none)?;
            if let Some(network) = surface::itself(&parameters.groups()[i], scene) {
                (parameters, _) =
                    surface::replace(parameters, &state.x, i, network, scene).map_err(|_| none)?;
            }
        }
        Ok(Self { state, parameters, compared: None, ..self })
    }

    /// The size of a group of parameters in a state, whose grids may have been refined.
    fn numbers(&self, group: usize, state: &State, scene: &Scene) -> usize {
        let (steps, own) = (&self.optimizers[group].grid, &self.parameters.groups()[group]);
        match (steps, surface::grid(own, scene)) {
            (Some(steps), Some(grid)) => {
                let times = steps.refinements(state.records.len() as u64) as u32;
                let finer = |n: usize| (n - 1).saturating_mul(2usize.saturating_pow(times)).saturating_add(1);
                grid.size().map(finer).into_iter().fold(1, usize::saturating_mul)
            }
            _ => own.range.len(),
        }
    }
}
