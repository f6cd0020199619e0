//! A fit: steps down the gradient of an objective, which can be left off and gone on with.

mod error;
#[cfg(test)]
mod implicit_tests;
mod mean;
mod optimizer;
mod record;
mod resume;
mod surface;
#[cfg(test)]
mod tests;

use std::ops::Range;
use std::time::Instant;

use flatland::random::stream;
use rand::Rng as _;
use serde::{Deserialize, Serialize};

pub use self::error::FitError;
pub use self::optimizer::Optimizer;
pub use self::record::{Record, Times};
use super::adam::Adam;
use super::large_steps::LargeSteps;
use super::objective::{Evaluation, MaskTerm, Objective, ObjectiveError, Reverse};
use super::parameters::Parameters;
use super::schedule::Schedule;
use crate::Image;
use crate::gradient::Progress;
use crate::scene::{ImplicitSurface, Scene, SceneError};
use crate::sdf::Grid;

/// How long a fit goes on, and what it looks at.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Plan {
    /// Steps in all.
    pub steps: u64,
    /// How rates change.
    pub schedule: Schedule,
    /// Views that a step looks at. Every view has its turn in each round, in an order of its own; the last step of a round may have
    /// fewer.
    pub views_per_step: usize,
    /// The seed of everything random.
    pub seed: u64,
}

/// Where a fit is: all that is needed to go on, to the same bits.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct State {
    /// The values of the parameters.
    pub x: Vec<f64>,
    /// One for each group of parameters.
    adams: Vec<Adam>,
    /// What was found in each step so far.
    pub records: Vec<Record>,
    /// The [mean](Fit::averaged) of x, where one is kept; nothing otherwise.
    mean: Vec<f64>,
}

/// Parameters of a scene on their way to a minimum.
#[derive(Clone, Debug)]
pub struct Fit {
    objective: Objective,
    parameters: Parameters,
    plan: Plan,
    optimizers: Vec<Optimizer>,
    /// β of the mean of parameters.
    averaged: Option<f64>,
    state: State,
    times: Times,
}

/// A loss so many times that of the first step ends a fit.
const DIVERGES: f64 = 1e3;

/// Purposes of random numbers.
const STEP: u64 = 0;
const ORDER: u64 = 1;
const CHECK: u64 = 2;

impl Fit {
    /// A fit that begins at x, with one optimiser for each group of parameters.
    ///
    /// # Panics
    /// If there is not one optimiser for each group, or one number for each parameter, or large steps are of another mesh.
    #[must_use]
    pub fn new(
        parameters: Parameters,
        x: Vec<f64>,
        objective: Objective,
        optimizers: Vec<Optimizer>,
        plan: Plan,
    ) -> Self {
        assert_eq!(optimizers.len(), parameters.groups().len(), "one optimiser for each group of parameters");
        assert_eq!(x.len(), parameters.len(), "one number for each parameter");
        for (group, optimizer) in parameters.groups().iter().zip(&optimizers) {
            let vertices = optimizer.large_steps.as_ref().map(LargeSteps::vertices);
            let fits = vertices.is_none_or(|vertices| 3 * vertices == group.range.len());
            assert!(fits, "the large steps of `{}` are of its mesh", group.name);
        }
        let adams = optimizers.iter().map(|o| o.adam.clone()).collect();
        let state = State { x, adams, records: vec![], mean: vec![] };
        Self { objective, parameters, plan, optimizers, averaged: None, state, times: Times::default() }
    }

    /// The same with a mean of the parameters, x̄ ← β x̄ + (1 − β) x after each step, which is then its [`result`](Self::result); the plain mean
    /// of all steps while these are fewer than 1/(1 − β), so that the start does not count. For rates that do not fall to 0: 0.95 averages over about
    /// 20 steps, as the code of Vicini et al. (2022) does. No step depends on it. Where a [grid](super::GridSteps::refine) becomes finer it begins
    /// anew.
    ///
    /// # Panics
    /// If β is not from 0 to below 1, or steps were taken.
    #[must_use]
    pub fn averaged(mut self, decay: f64) -> Self {
        assert!((0.0..1.0).contains(&decay), "β is from 0 to below 1");
        assert!(self.state.records.is_empty(), "a mean is of all steps");
        self.averaged = Some(decay);
        self.state.mean.clone_from(&self.state.x);
        self
    }

    /// Where it is.
    #[must_use]
    pub fn state(&self) -> &State {
        &self.state
    }

    /// What is fitted.
    #[must_use]
    pub fn parameters(&self) -> &Parameters {
        &self.parameters
    }

    /// What is minimised.
    #[must_use]
    pub fn objective(&self) -> &Objective {
        &self.objective
    }

    /// Steps that were taken.
    #[must_use]
    pub fn steps_taken(&self) -> u64 {
        self.state.records.len() as u64
    }

    /// Whether there is no step left.
    #[must_use]
    pub fn is_done(&self) -> bool {
        self.steps_taken() >= self.plan.steps
    }

    /// Where the time of the steps of this run went.
    #[must_use]
    pub fn times(&self) -> Times {
        self.times
    }

    /// What has been found so far: the [mean](Self::averaged) of the parameters if there is one, and otherwise where they are.
    #[must_use]
    pub fn result(&self) -> &[f64] {
        if self.averaged.is_some() { &self.state.mean } else { &self.state.x }
    }

    /// Gives the scene what has been [found](Self::result).
    ///
    /// # Errors
    /// A [`SceneError`] if it is none of this scene's.
    pub fn apply_result(&self, scene: &mut Scene) -> Result<(), SceneError> {
        self.parameters.apply(self.result(), scene)
    }

    /// Gives the scene the values so far.
    ///
    /// # Errors
    /// A [`SceneError`] if they are none of this scene's.
    pub fn apply(&self, scene: &mut Scene) -> Result<(), SceneError> {
        self.parameters.apply(&self.state.x, scene)
    }

    /// Which groups of parameters change no pixel of a view, by view: nobody sees them there. A few samples a pixel are
    /// spent, with weights that do not depend on the target. What is seen in few pixels may be missed.
    ///
    /// # Errors
    /// An [`ObjectiveError`].
    pub fn unseen(
        &self,
        scene: &mut Scene,
        view: usize,
        reverse: Reverse<'_>,
        progress: &Progress,
    ) -> Result<Vec<usize>, ObjectiveError> {
        self.objective.look(scene, view)?;
        let target = &self.objective.views[view].target;
        // Weights of one sign but no pattern that a gradient could be orthogonal to.
        let mut random = stream(self.plan.seed, &[CHECK, view as u64, 1]);
        let mut weight = || 0.5 + flatland::random::open01(&mut random);
        let pixels = target.pixels.iter().map(|_| glam::DVec3::from_array(std::array::from_fn(|_| weight())));
        let adjoint = target.with_pixels(pixels.collect());
        let active = self.parameters.active(scene);
        let seed = self.seed(&[CHECK, view as u64]);
        let gradient = reverse(scene, &adjoint, &active, seed, progress)?;
        let gradient = self.parameters.gradient(scene, &self.state.x, &gradient.by_parameter);
        let groups = self.parameters.groups().iter().enumerate();
        Ok(groups
            .filter(|(_, g)| gradient[g.range.clone()].iter().all(|d| *d == 0.0))
            .map(|(i, _)| i)
            .collect())
    }

    /// Takes one step, and brings the scene to where it leads. Does nothing once all are taken.
    ///
    /// # Errors
    /// A [`FitError`]; the state is then that before the step.
    pub fn step(
        &mut self,
        scene: &mut Scene,
        reverse: Reverse<'_>,
        progress: &Progress,
    ) -> Result<(), FitError> {
        if self.is_done() {
            return Ok(());
        }
        let t = self.steps_taken();
        let start = Instant::now();
        let views = self.views(t);
        let seed = self.seed(&[STEP, t]);
        let x = &self.state.x;
        let sharpened = |term: MaskTerm| MaskTerm { loss: term.loss.sharpened(t, self.plan.steps), ..term };
        let masks = self.objective.masks.map(sharpened);
        let at = (&self.parameters, &x[..]);
        let found = self.objective.evaluate_with(masks, scene, at, &views, seed, reverse, progress)?;
        self.check(&found, &views)?;
        let factor = self.plan.schedule.factor(t, self.plan.steps);
        let (mut next, mut adams, mut step) = (x.clone(), self.state.adams.clone(), vec![0.0; x.len()]);
        let (mut norms, mut signals, mut clamped) = (vec![], vec![], 0);
        for (i, range) in self.ranges().enumerate() {
            let gradient = &found.gradient[range.clone()];
            norms.push(gradient.iter().map(|g| g * g).sum::<f64>().sqrt());
            let adam = &mut adams[i];
            let optimizer = &self.optimizers[i];
            let grid = self.grid(i, scene)?;
            let fineness = grid.map_or(1.0, |_| optimizer.fineness(t));
            adam.rate = factor * fineness * optimizer.adam.rate;
            let (gradient, cut) = optimizer.clamped(gradient);
            clamped += cut;
            step[range].copy_from_slice(&optimizer.step(adam, &gradient, grid));
            signals.push(adam.signal());
        }
        self.parameters.retract(&mut next, &step);
        let mut finer = vec![];
        for (i, optimizer) in self.optimizers.iter().enumerate() {
            let (Some(steps), Some(grid)) = (&optimizer.grid, self.grid(i, scene)?) else { continue };
            let range = self.parameters.groups()[i].range.clone();
            let failed =
                |error| FitError::Grid { parameter: self.parameters.groups()[i].name.clone(), error };
            let grid = steps.stepped(grid, &next[range.clone()]).map_err(failed)?;
            next[range].copy_from_slice(grid.nodes());
            if steps.refinements(t + 1) > steps.refinements(t) {
                finer.push((i, ImplicitSurface::new(steps.refined(&grid).map_err(failed)?)));
            }
        }
        let Evaluation { loss, penalty, non_finite, image_time, gradient_time, .. } = found;
        let record = Record { loss, penalty, factor, norms, signals, non_finite, clamped };
        let optimizer = start.elapsed().saturating_sub(image_time + gradient_time);
        let start = Instant::now();
        self.parameters.apply(&next, scene)?;
        for (i, optimizer) in self.optimizers.iter().enumerate() {
            let Some(steps) = &optimizer.grid else { continue };
            let due = steps.refinements(t + 1) > steps.refinements(t);
            let finishes = steps.is_finishing(t + 1) && !steps.is_finishing(t);
            let group = &self.parameters.groups()[i];
            if finishes && let Some(network) = surface::itself(group, scene) {
                finer.push((i, network));
            } else if due && let Some(network) = surface::finer_network(group, scene) {
                let failed = |error| FitError::Bake { parameter: group.name.clone(), error };
                finer.push((i, network.map_err(failed)?));
            }
        }
        let mut parameters = self.parameters.clone();
        for (i, surface) in finer {
            let numbers = next.len();
            (parameters, next) = surface::replace(parameters, &next, i, surface, scene)?;
            if next.len() != numbers {
                // Other numbers have no history.
                adams[i] = self.optimizers[i].adam.clone();
            }
        }
        if let Some(decay) = self.averaged {
            let mean = mean::resized(&self.parameters, &self.state.mean, &parameters, &next);
            self.state.mean = mean::after(&parameters, &mean, &next, decay, t + 1);
        }
        self.times.update += start.elapsed();
        self.times.image += image_time;
        self.times.gradient += gradient_time;
        self.times.optimizer += optimizer;
        (self.state.x, self.state.adams, self.parameters) = (next, adams, parameters);
        self.state.records.push(record);
        Ok(())
    }

    /// The grid whose nodes a group of parameters is, if they have steps of their own.
    fn grid<'s>(&self, group: usize, scene: &'s Scene) -> Result<Option<&'s Grid>, FitError> {
        let Some(steps) = &self.optimizers[group].grid else { return Ok(None) };
        let group = &self.parameters.groups()[group];
        let grid = surface::grid(group, scene);
        if grid.is_some() && steps.finish.is_some() {
            return Err(FitError::NoNetwork { parameter: group.name.clone() });
        }
        let of_network = surface::network(group, scene).is_some() || surface::is_itself(group, scene);
        if grid.is_some() || (of_network && steps.is_for_networks()) {
            Ok(grid)
        } else {
            Err(FitError::NoGrid { parameter: group.name.clone() })
        }
    }

    fn check(&self, found: &Evaluation, views: &[usize]) -> Result<(), FitError> {
        let Evaluation { loss, penalty, .. } = *found;
        if !(loss + penalty).is_finite() {
            return Err(FitError::Loss { loss, penalty });
        }
        for group in self.parameters.groups() {
            if found.gradient[group.range.clone()].iter().any(|g| !g.is_finite()) {
                return Err(FitError::NotFinite { parameter: group.name.clone() });
            }
        }
        let Some(first) = self.state.records.first().map(|r| r.loss + r.penalty) else { return Ok(()) };
        // The first views may have shown next to nothing, or the fit may have begun where it is to end: it has not diverged while
        // it is no worse than a thousand black pictures.
        let black = views.iter().map(|&v| {
            let (width, height) = self.objective.views[v].target.size();
            let nothing = Image::constant(width, height, glam::DVec3::ZERO);
            Ok(self.objective.compare(v, &nothing)?.0)
        });
        let black = black.collect::<Result<Vec<f64>, ObjectiveError>>()?;
        let loss = found.loss + found.penalty;
        if loss > DIVERGES * black.into_iter().fold(first, f64::max) {
            return Err(FitError::Diverges { loss, first });
        }
        Ok(())
    }

    fn ranges(&self) -> impl Iterator<Item = Range<usize>> {
        self.parameters.groups().iter().map(|group| group.range.clone())
    }

    fn seed(&self, words: &[u64]) -> u64 {
        stream(self.plan.seed, words).next_u64()
    }

    /// How many steps it takes until every view has had its turn.
    #[must_use]
    pub fn round(&self) -> usize {
        let count = self.objective.views.len();
        count.div_ceil(self.plan.views_per_step.clamp(1, count.max(1)))
    }

    /// The views of step t, in increasing order. In a round of steps every view has one turn; where the views of a round do not
    /// suffice for its last step, that step looks at fewer.
    fn views(&self, t: u64) -> Vec<usize> {
        let count = self.objective.views.len();
        let each = self.plan.views_per_step.clamp(1, count.max(1)) as u64;
        let (round, within) = (t / self.round().max(1) as u64, t % self.round().max(1) as u64);
        let places = (each * within)..(each * (within + 1)).min(count as u64);
        let mut views: Vec<usize> = places.filter_map(|i| self.view_at(round * count as u64 + i)).collect();
        views.sort_unstable();
        views
    }

    fn view_at(&self, place: u64) -> Option<usize> {
        let count = self.objective.views.len() as u64;
        let round = place.checked_div(count)?;
        let mut random = stream(self.plan.seed, &[ORDER, round]);
        let mut order: Vec<usize> = (0..count as usize).collect();
        // Fisher and Yates; the remainder's bias is below 10⁻¹⁶ for any number of views that fit into memory.
        (1..order.len()).rev().for_each(|i| order.swap(i, (random.next_u64() % (i as u64 + 1)) as usize));
        Some(order[(place % count) as usize])
    }
}
