//! A fit: steps down the gradient of an objective, which can be left off and gone on with.

#[cfg(test)]
mod implicit_tests;
mod mean;
mod surface;
#[cfg(test)]
mod tests;

use std::borrow::Cow;
use std::ops::Range;
use std::time::{Duration, Instant};

use flatland::random::stream;
use rand::Rng as _;
use serde::{Deserialize, Serialize};

use super::adam::Adam;
use super::grid_steps::GridSteps;
use super::large_steps::LargeSteps;
use super::objective::{Evaluation, MaskTerm, Objective, ObjectiveError, Reverse};
use super::parameters::Parameters;
use super::schedule::Schedule;
use crate::Image;
use crate::gradient::Progress;
use crate::scene::{ImplicitSurface, Scene, SceneError};
use crate::sdf::{BakeError, Grid, RedistanceError};

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
    /// and biases the gradient: how many were cut is in [`Record::clamped`]. `None` cuts none.
    pub clamp: Option<f64>,
}

impl From<Adam> for Optimizer {
    fn from(adam: Adam) -> Self {
        Self { adam, large_steps: None, grid: None, clamp: None }
    }
}

impl Optimizer {
    /// A step down a gradient; of the nodes of a grid, if it is one.
    fn step(&self, adam: &mut Adam, gradient: &[f64], grid: Option<&Grid>) -> Vec<f64> {
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
    fn clamped<'g>(&self, gradient: &'g [f64]) -> (Cow<'g, [f64]>, usize) {
        let Some(clamp) = self.clamp else { return (gradient.into(), 0) };
        let cut = gradient.iter().filter(|g| g.abs() > clamp).count();
        (gradient.iter().map(|g| g.clamp(-clamp, clamp)).collect(), cut)
    }

    /// What rates are multiplied by after so many steps: as grids become finer, in units of their cells they stay.
    fn fineness(&self, steps: u64) -> f64 {
        self.grid.as_ref().map_or(1.0, |grid| 0.5_f64.powi(grid.refinements(steps) as i32))
    }
}

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
    /// How steady it has been, see [`Adam::signal`].
    pub signals: Vec<f64>,
    /// Samples that were not finite, and are left out.
    pub non_finite: usize,
    /// Derivatives that were [cut](Optimizer::clamp).
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

/// Why a fit does not go on. Its state is that before the step.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum FitError {
    /// The objective has no value or no derivative.
    #[error(transparent)]
    Objective(#[from] ObjectiveError),
    /// A step led to values that are none.
    #[error("{0}; try a smaller rate, or bounds")]
    Scene(#[from] SceneError),
    /// A derivative is not a number.
    #[error("the gradient by `{parameter}` is not finite")]
    NotFinite {
        /// The name of the parameter.
        parameter: String,
    },
    /// What is for the nodes of a grid is asked of something else.
    #[error(
        "`{parameter}` is not the nodes of a grid of distances, which alone have smooth steps of that kind, and can be made distances again; \
         finer become they, and networks on grids"
    )]
    NoGrid {
        /// The name of the parameter.
        parameter: String,
    },
    /// What is for a network is asked of the nodes of a grid.
    #[error("`{parameter}` is the nodes of a grid, not a network, which alone is traced itself in the end")]
    NoNetwork {
        /// The name of the parameter.
        parameter: String,
    },
    /// The nodes of a grid have no surface any more.
    #[error("`{parameter}`: {error}; try a smaller rate")]
    Grid {
        /// The name of the parameter.
        parameter: String,
        /// What is wrong.
        error: RedistanceError,
    },
    /// A network has no surface on a finer grid.
    #[error("`{parameter}`: {error}; try more cells at first, or a smaller rate")]
    Bake {
        /// The name of the parameter.
        parameter: String,
        /// What is wrong.
        error: BakeError,
    },
    /// The loss has become far larger than it was.
    #[error(
        "the fit diverges: the loss is {loss:.3e}, and was {first:.3e} at first; try smaller rates, or more samples"
    )]
    Diverges {
        /// Now.
        loss: f64,
        /// In the first step.
        first: f64,
    },
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
    /// 20 steps, as the code of Vicini et al. (2022) does. No step depends on it. Where a [grid](GridSteps::refine) becomes finer it begins
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

    /// The same, gone on with from another state, with the optimisers as they were then. Grids of the scene become as fine as they were.
    ///
    /// # Errors
    /// Nothing but the reason why it is none of this fit's.
    pub fn resumed(self, state: State, scene: &mut Scene) -> Result<Self, &'static str> {
        if state.records.len() as u64 > self.plan.steps {
            return Err("it is of a longer fit");
        }
        // Nothing is made finer for a state that does not fit in the end.
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
        Ok(Self { state, parameters, ..self })
    }

    /// How many numbers a group of parameters is in a state: grids have become finer by then.
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
