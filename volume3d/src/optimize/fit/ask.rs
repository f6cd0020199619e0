//! Steps of a fit in tasks that can be run anywhere.

use std::num::NonZeroUsize;

use super::super::fingerprint::Problem;
use super::super::grid_steps::GridSteps;
use super::super::objective::Reverse;
use super::super::parts::{Part, Step, Task};
use super::{Fit, FitError, STEP};
use crate::gradient::Progress;
use crate::scene::Scene;

/// Result of the parts of a round.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Told {
    /// The images are complete; [`Fit::ask`] now gives the tasks of their derivatives.
    Images,
    /// The step is taken.
    Step,
}

impl Fit {
    /// Estimates each view of a step by the mean of `chunks` independent estimates, each with all samples of
    /// [`image_samples`](super::super::Objective::image_samples) and of the reverse method; 1 by default.
    /// More chunks are more tasks. Results depend on their number, but not on where they are run.
    #[must_use]
    pub fn in_chunks(mut self, chunks: NonZeroUsize) -> Self {
        (self.chunks, self.compared) = (chunks.get(), None);
        self
    }

    /// The tasks of the current round of a step, one for each view and chunk; none once all steps are taken.
    ///
    /// With one chunk a step has one round. With more it has two: the images, and then the derivatives, whose
    /// adjoint is that of the mean image. A round that is asked for again, or after a
    /// [resumption](Self::resumed), gives the same bits. Only workers of the same `problem` run the tasks; it
    /// is that of the scene before the first step, of these parameters, and of the method of all steps.
    #[must_use]
    pub fn ask(&mut self, problem: Problem) -> Vec<Task> {
        self.problem = Some(problem);
        self.tasks()
    }

    fn tasks(&self) -> Vec<Task> {
        if self.is_done() { vec![] } else { self.current().tasks(self.compared.as_ref()) }
    }

    /// Receives the parts of all tasks of [`ask`](Self::ask), in any order. The scene must be at the current
    /// values of the parameters, see [`apply`](Self::apply), and is at the next ones after a step. Sums are
    /// taken in the order of views and chunks. Once all steps are taken, no parts are expected.
    ///
    /// # Errors
    /// A [`FitError`]; the state is then that before the call.
    pub fn tell(&mut self, scene: &mut Scene, parts: Vec<Part>) -> Result<Told, FitError> {
        let step = self.current();
        if self.is_done() {
            step.none(&parts)?;
            return Ok(Told::Step);
        }
        let parts = step.ordered(parts, self.compared.is_some())?;
        if self.chunks > 1 && self.compared.is_none() {
            self.compared = Some(step.compare(scene, &parts)?);
            return Ok(Told::Images);
        }
        let found = step.total(scene, &parts, self.compared.as_ref())?;
        self.descend(scene, found)?;
        self.compared = None;
        Ok(Told::Step)
    }

    /// Takes one step and updates the scene. Does nothing once all steps are taken.
    ///
    /// # Errors
    /// A [`FitError`]; the state is then that before the step.
    pub fn step(
        &mut self,
        scene: &mut Scene,
        reverse: Reverse<'_>,
        progress: &Progress,
    ) -> Result<(), FitError> {
        while !self.is_done() {
            let run = |task: Task| task.run_at(scene, &self.objective, &self.parameters, reverse, progress);
            let parts = self.tasks().into_iter().map(run).collect::<Result<_, _>>()?;
            if self.tell(scene, parts)? == Told::Step {
                break;
            }
        }
        Ok(())
    }

    fn current(&self) -> Step<'_> {
        let t = self.steps_taken();
        let views = self.views(t);
        let fingerprint = |&v: &usize| *self.fingerprints[v].get_or_init(|| self.objective.fingerprint(v));
        let changes = |steps: &GridSteps| steps.refinements(t) > 0 || steps.is_finishing(t);
        let groups = self.parameters.groups().iter().zip(&self.optimizers);
        let replaced = groups.filter(|(_, optimizer)| optimizer.grid.as_ref().is_some_and(changes));
        Step {
            objective: &self.objective,
            parameters: &self.parameters,
            x: &self.state.x,
            problem: self.problem,
            fingerprints: views.iter().map(fingerprint).collect(),
            views,
            replaced: replaced.map(|(group, _)| group.name.clone()).collect(),
            seed: self.seed(&[STEP, t]),
            chunks: self.chunks,
            pace: Some((t, self.plan.steps)),
        }
    }
}
