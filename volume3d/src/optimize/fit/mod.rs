//! Gradient-descent fits of an objective, which can be interrupted and resumed.

mod ask;
#[cfg(test)]
mod ask_tests;
mod choose;
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
use std::sync::OnceLock;
use std::time::Instant;

use flatland::random::stream;
use rand::Rng as _;
use serde::{Deserialize, Serialize};

pub use self::ask::Told;
pub use self::error::FitError;
pub use self::optimizer::Optimizer;
pub use self::record::{Record, Times};
use super::adam::Adam;
use super::fingerprint::Problem;
use super::large_steps::LargeSteps;
use super::objective::{Evaluation, Objective, ObjectiveError, Reverse};
use super::parameters::Parameters;
use super::parts::Compared;
use super::schedule::Schedule;
use crate::Image;
use crate::gradient::Progress;
use crate::scene::{ImplicitSurface, Scene, SceneError};
use crate::sdf::Grid;

/// Length and view schedule of a fit.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Plan {
    /// Total number of steps.
    pub steps: u64,
    /// Learning-rate schedule.
    pub schedule: Schedule,
    /// Views per step. Every view is used once in each round, in a new random order; the last step of a round
    /// may have fewer.
    pub views_per_step: usize,
    /// The seed of all random numbers.
    pub seed: u64,
}

/// The complete state of a fit, from which it resumes bit for bit.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct State {
    /// The values of the parameters.
    pub x: Vec<f64>,
    /// The optimiser of each group of parameters.
    adams: Vec<Adam>,
    /// The record of each step so far.
    pub records: Vec<Record>,
    /// The [mean](Fit::averaged) of x, if one is kept; otherwise empty.
    mean: Vec<f64>,
}

/// A running fit of parameters of a scene.
#[derive(Clone, Debug)]
pub struct Fit {
    objective: Objective,
    parameters: Parameters,
    plan: Plan,
    optimizers: Vec<Optimizer>,
    /// Decay β of the mean of the parameters.
    averaged: Option<f64>,
    state: State,
    times: Times,
    /// Number of independent estimates of each view in a step.
    chunks: usize,
    /// Result of the first round of the current step, if its second round is due.
    compared: Option<Compared>,
    /// Checksums that identify the tasks of [`ask`](Fit::ask).
    problem: Option<Problem>,
    /// Fingerprint of each view, once needed.
    fingerprints: Vec<OnceLock<u32>>,
}

/// Divergence threshold: the fit ends when the loss is this many times that of the first step.
const DIVERGES: f64 = 1e3;

/// Purposes of random-number streams.
const STEP: u64 = 0;
const ORDER: u64 = 1;
const CHECK: u64 = 2;

impl Fit {
    /// A fit that begins at x, with one optimiser for each group of parameters.
    ///
    /// # Panics
    /// - If there is not one optimiser for each group, or one number for each parameter.
    /// - If large steps were made for another mesh.
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
        let times = Times::default();
        let fingerprints = vec![OnceLock::new(); objective.views.len()];
        Self {
            objective,
            parameters,
            plan,
            optimizers,
            averaged: None,
            state,
            times,
            chunks: 1,
            compared: None,
            problem: None,
            fingerprints,
        }
    }

    /// Keeps a mean of the parameters, x̄ ← β x̄ + (1 − β) x after each step, which is then the
    /// [`result`](Self::result); it is the plain mean of all steps, without the start, while there are fewer
    /// than 1/(1 − β). Meant for rates that do not fall to 0: 0.95 averages over about 20 steps, as the code
    /// of Vicini et al. (2022) does. It does not influence the steps. Where a
    /// [grid](super::GridSteps::refine) is refined it begins anew.
    ///
    /// # Panics
    /// If β is not in [0, 1), or steps were taken.
    #[must_use]
    pub fn averaged(mut self, decay: f64) -> Self {
        assert!((0.0..1.0).contains(&decay), "β is from 0 to below 1");
        assert!(self.state.records.is_empty(), "a mean is of all steps");
        self.averaged = Some(decay);
        self.state.mean.clone_from(&self.state.x);
        self
    }

    /// The same fit from another start.
    ///
    /// # Panics
    /// If steps were taken, or there is not one number for each parameter.
    #[must_use]
    pub fn starting_at(mut self, x: Vec<f64>) -> Self {
        assert!(self.state.records.is_empty(), "a fit that has begun has its start");
        assert_eq!(x.len(), self.parameters.len(), "one number for each parameter");
        if self.averaged.is_some() {
            self.state.mean.clone_from(&x);
        }
        (self.state.x, self.compared) = (x, None);
        self
    }

    /// The same fit with another number of steps in all, over which its schedule is spread.
    #[must_use]
    pub fn of_steps(mut self, steps: u64) -> Self {
        (self.plan.steps, self.compared) = (steps, None);
        self
    }

    /// The optimiser of each group of parameters, with the rates of the first step.
    #[must_use]
    pub fn optimizers(&self) -> &[Optimizer] {
        &self.optimizers
    }

    /// The current state.
    #[must_use]
    pub fn state(&self) -> &State {
        &self.state
    }

    /// The fitted parameters.
    #[must_use]
    pub fn parameters(&self) -> &Parameters {
        &self.parameters
    }

    /// The minimised objective.
    #[must_use]
    pub fn objective(&self) -> &Objective {
        &self.objective
    }

    /// The number of steps taken.
    #[must_use]
    pub fn steps_taken(&self) -> u64 {
        self.state.records.len() as u64
    }

    /// Whether all steps are taken.
    #[must_use]
    pub fn is_done(&self) -> bool {
        self.steps_taken() >= self.plan.steps
    }

    /// Time spent in each part of the steps of this run.
    #[must_use]
    pub fn times(&self) -> Times {
        self.times
    }

    /// The result so far: the [mean](Self::averaged) of the parameters if there is one, otherwise their
    /// current values.
    #[must_use]
    pub fn result(&self) -> &[f64] {
        if self.averaged.is_some() { &self.state.mean } else { &self.state.x }
    }

    /// Sets the scene to the [result](Self::result) so far.
    ///
    /// # Errors
    /// A [`SceneError`] if the values do not fit this scene.
    pub fn apply_result(&self, scene: &mut Scene) -> Result<(), SceneError> {
        self.parameters.apply(self.result(), scene)
    }

    /// Sets the scene to the current values of the parameters.
    ///
    /// # Errors
    /// A [`SceneError`] if the values do not fit this scene.
    pub fn apply(&self, scene: &mut Scene) -> Result<(), SceneError> {
        self.parameters.apply(&self.state.x, scene)
    }

    /// Groups of parameters that change no pixel of a view, by view, because they are not visible there. The
    /// test spends a few samples a pixel, with weights that do not depend on the target. Objects visible in
    /// few pixels may be missed.
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
        // Random weights of one sign, so that no gradient pattern is orthogonal to them.
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

    /// Takes the step down a gradient and updates the scene.
    fn descend(&mut self, scene: &mut Scene, found: Evaluation) -> Result<(), FitError> {
        let t = self.steps_taken();
        let start = Instant::now();
        self.check(&found, &self.views(t))?;
        let x = &self.state.x;
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
        let optimizer = start.elapsed();
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
                // Resized groups have no history.
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

    /// The grid whose nodes a group of parameters is, if the group has grid steps.
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
        // The first views may have been almost empty, or the fit may have begun at its minimum: it has not
        // diverged while the loss is at most a thousand times that of black images.
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

    /// The number of steps of a round, in which every view is used once.
    #[must_use]
    pub fn round(&self) -> usize {
        let count = self.objective.views.len();
        count.div_ceil(self.plan.views_per_step.clamp(1, count.max(1)))
    }

    /// The views of step t, in increasing order. Every view is used once in a round; if the views of a round
    /// do not suffice for its last step, that step has fewer.
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
        // Fisher–Yates shuffle; the bias of the remainder is below 10⁻¹⁶ for any number of views that fit
        // into memory.
        (1..order.len()).rev().for_each(|i| order.swap(i, (random.next_u64() % (i as u64 + 1)) as usize));
        Some(order[(place % count) as usize])
    }
}
