//! Choice of a method for all steps of a fit.

use super::super::objective::ObjectiveError;
use super::Fit;
use crate::gradient::{Choice, Pilot, Progress, Survey};
use crate::scene::Scene;

/// Greatest number of views surveyed, evenly among all.
const SURVEYED: usize = 8;

impl Fit {
    /// The number of views that [`choose`](Self::choose) surveys.
    #[must_use]
    pub fn surveyed(&self) -> usize {
        self.objective.views.len().min(SURVEYED)
    }

    /// The method that a pilot chooses for all steps, from up to 8 views before the first step; a resumed fit
    /// from the same start has the same method. `surveyed` is called after each view.
    ///
    /// # Errors
    /// An [`ObjectiveError`].
    pub fn choose(
        &self,
        pilot: &Pilot,
        scene: &mut Scene,
        progress: &Progress,
        mut surveyed: impl FnMut(),
    ) -> Result<Choice, ObjectiveError> {
        let active = self.parameters.active(scene);
        let (views, count) = (self.objective.views.len(), self.surveyed());
        let mut surveys = vec![];
        for k in 0..count {
            self.objective.look(scene, k * views / count)?;
            surveys.push(pilot.survey(scene, None, &active, progress)?);
            surveyed();
        }
        Ok(pilot.choice(&Survey::of_all(surveys)))
    }
}
