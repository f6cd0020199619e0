//! Evaluation of an objective in tasks, whose parts are summed in a fixed order.

use std::time::{Duration, Instant};

use flatland::random::stream;
use glam::DVec3;
use rand::Rng as _;
use serde::{Deserialize, Serialize};

use super::fingerprint::Problem;
use super::objective::{Evaluation, MaskTerm, Objective, ObjectiveError, Reverse, add};
use super::parameters::Parameters;
use super::task_error::TaskError;
use crate::Image;
use crate::gradient::{Progress, render_pixels};
use crate::scene::Scene;

/// Purpose of the random-number streams of chunks.
const CHUNK: u64 = u64::MAX - 2;

/// Position of a task among all tasks of a fit.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
struct Place {
    /// Checksum of the point, the random numbers, the views and the settings of the step.
    step: u32,
    /// Whether the task belongs to the second round.
    second: bool,
    view: usize,
    chunk: usize,
}

/// A part of the work of a step: plain data, which can be run wherever the scene and the objective are.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Task {
    place: Place,
    /// `None` if the task stays in its process.
    problem: Option<Problem>,
    /// Fingerprint of the view.
    fingerprint: u32,
    /// Parameters whose implicit surfaces the fit has replaced.
    replaced: Vec<String>,
    x: Vec<f64>,
    /// Fraction of the mean loss that the view is.
    share: f64,
    /// The seed of the view, and that of the chunk.
    seeds: [u64; 2],
    chunks: usize,
    /// Step and number of steps, by which mask losses are sharpened.
    pace: Option<(u64, u64)>,
    /// ∂L/∂I of the second round, by pixels.
    adjoint: Vec<[f64; 3]>,
}

/// Result of a [`Task`].
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Part {
    place: Place,
    size: (usize, usize),
    image: Vec<[f64; 3]>,
    loss: f64,
    mask_loss: f64,
    gradient: Vec<f64>,
    non_finite: usize,
    image_time: Duration,
    gradient_time: Duration,
}

/// Why parts cannot be summed.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
#[non_exhaustive]
pub enum PartsError {
    /// A part did not arrive.
    #[error("the part of view `{view}`, chunk {chunk} is missing")]
    Missing {
        /// The view's name.
        view: String,
        /// The chunk, counted from 0.
        chunk: usize,
    },
    /// A part arrived twice.
    #[error("the part of view `{view}`, chunk {chunk} is there twice")]
    Doubled {
        /// The view's name.
        view: String,
        /// The chunk, counted from 0.
        chunk: usize,
    },
    /// A part that was not asked for.
    #[error("part {index} is of another fit, step or round")]
    Other {
        /// Its index in the list.
        index: usize,
    },
}

/// Images of the first round compared with their targets.
#[derive(Clone, Debug)]
pub(super) struct Compared {
    losses: Vec<f64>,
    /// By views.
    adjoints: Vec<Vec<[f64; 3]>>,
    non_finite: usize,
    image_time: Duration,
}

/// The current step.
pub(super) struct Step<'a> {
    pub objective: &'a Objective,
    pub parameters: &'a Parameters,
    pub x: &'a [f64],
    pub views: Vec<usize>,
    /// `None` if tasks stay in this process; fingerprints then do not matter.
    pub problem: Option<Problem>,
    /// Fingerprints of the views, in their order.
    pub fingerprints: Vec<u32>,
    /// Parameters whose implicit surfaces the fit has replaced.
    pub replaced: Vec<String>,
    pub seed: u64,
    pub chunks: usize,
    pub pace: Option<(u64, u64)>,
}

impl Task {
    /// Runs the task with the objective of the fit and a scene like the one that the fit began with, which is
    /// set to the values of the parameters and to the view. `problem` is that of scene, parameters and method
    /// as they were before any task; that `reverse` is its method, with the seed of each call, is up to the
    /// caller.
    ///
    /// # Errors
    /// A [`TaskError`]:
    ///
    /// - if the task is of another scene, method or objective, or of other parameters,
    /// - if the fit has refined the surface of a parameter,
    /// - if the adjoint has another size than the film, or
    /// - if the objective cannot be evaluated.
    pub fn run(
        self,
        problem: Problem,
        scene: &mut Scene,
        (objective, parameters): (&Objective, &Parameters),
        reverse: Reverse<'_>,
        progress: &Progress,
    ) -> Result<Part, TaskError> {
        let (index, count) = (self.place.view, objective.views.len());
        let view = objective.views.get(index).ok_or(TaskError::View { index, count })?;
        if let Some(parameter) = self.replaced.first().cloned() {
            return Err(TaskError::Replaced { parameter });
        }
        let (expected, found) = (parameters.len(), self.x.len());
        if found != expected {
            return Err(TaskError::Numbers { expected, found });
        }
        match self.problem {
            Some(own) if own.scene != problem.scene => return Err(TaskError::Scene),
            Some(own) if own.parameters != problem.parameters => return Err(TaskError::Parameters),
            Some(own) if own.method != problem.method => return Err(TaskError::Method),
            _ => {}
        }
        if objective.fingerprint(index) != self.fingerprint {
            return Err(TaskError::Objective { view: view.name.clone() });
        }
        let film = &view.film;
        let (width, height) = film.crop.map_or((film.width, film.height), |crop| (crop.width, crop.height));
        let (expected, found) = (width * height, self.adjoint.len());
        if self.place.second && found != expected {
            return Err(TaskError::Adjoint { view: view.name.clone(), expected, found });
        }
        let error = |source| ObjectiveError::View { view: view.name.clone(), source };
        parameters.apply(&self.x, scene).map_err(error)?;
        Ok(self.run_at(scene, objective, parameters, reverse, progress)?)
    }

    /// Drops the last pixel of the adjoint.
    #[cfg(test)]
    pub(super) fn truncate_adjoint(&mut self) {
        self.adjoint.pop();
    }

    /// `run` in a scene that is at x.
    pub(super) fn run_at(
        self,
        scene: &mut Scene,
        objective: &Objective,
        parameters: &Parameters,
        reverse: Reverse<'_>,
        progress: &Progress,
    ) -> Result<Part, ObjectiveError> {
        let (place, v) = (self.place, self.place.view);
        objective.look(scene, v)?;
        let [of_view, seed] = self.seeds;
        let mut part = Part {
            place,
            size: scene.size(),
            image: vec![],
            loss: 0.0,
            mask_loss: 0.0,
            gradient: vec![],
            non_finite: 0,
            image_time: Duration::ZERO,
            gradient_time: Duration::ZERO,
        };
        let active = parameters.active(scene);
        let adjoint = if place.second {
            image(part.size, &self.adjoint)
        } else {
            let start = Instant::now();
            let chosen = objective.chosen(v, of_view)?;
            let wanted = |pixel: usize| chosen.as_ref().is_none_or(|chosen| chosen[pixel]);
            let rendering = render_pixels(scene, objective.image_samples, seed, wanted, progress)?;
            part.image_time = start.elapsed();
            part.non_finite = rendering.non_finite.len();
            if self.chunks > 1 {
                part.image = rendering.image.pixels.iter().map(DVec3::to_array).collect();
                return Ok(part);
            }
            let (loss, adjoint) =
                compare(objective, scene, parameters, (v, of_view, self.share), &rendering.image)?;
            part.loss = loss;
            adjoint
        };
        let start = Instant::now();
        let gradient = reverse(scene, &adjoint, &active, seed, progress)?;
        part.gradient_time = start.elapsed();
        part.non_finite += gradient.non_finite.len();
        let mut tangent = gradient.by_parameter;
        let sharpened = |term: MaskTerm| match self.pace {
            Some((t, steps)) => MaskTerm { loss: term.loss.sharpened(t, steps), ..term },
            None => term,
        };
        let view = &objective.views[v];
        if place.chunk == 0
            && let (Some(MaskTerm { implicit, loss }), Some(mask)) =
                (objective.masks.map(sharpened), &view.mask)
        {
            let error = |source| ObjectiveError::Mask { view: view.name.clone(), source };
            let found = loss.of(scene, implicit, mask).map_err(error)?;
            part.mask_loss = self.share * found.loss;
            tangent.implicits[implicit].add_scaled(self.share, &found.gradient);
        }
        part.gradient = parameters.gradient(scene, &self.x, &tangent);
        Ok(part)
    }
}

impl Step<'_> {
    fn share(&self) -> f64 {
        1.0 / self.views.len() as f64
    }

    fn of_view(&self, view: usize) -> u64 {
        stream(self.seed, &[view as u64]).next_u64()
    }

    /// Checksum of what tells one step from another.
    fn checksum(&self) -> u32 {
        let mut hash = crc32fast::Hasher::new();
        let settings = (&self.views, self.problem, &self.fingerprints, self.seed, self.chunks, self.pace);
        hash.update(format!("{settings:?}").as_bytes());
        self.parameters.groups().iter().for_each(|group| hash.update(group.name.as_bytes()));
        self.x.iter().for_each(|x| hash.update(&x.to_le_bytes()));
        hash.finalize()
    }

    /// The tasks of the first round, or of the second if the first is `compared`, in the order of their sum.
    pub(super) fn tasks(&self, compared: Option<&Compared>) -> Vec<Task> {
        let step = self.checksum();
        let places = self.views.iter().enumerate();
        let places = places.flat_map(|(i, &view)| (0..self.chunks).map(move |chunk| (i, view, chunk)));
        let task = |(i, view, chunk): (usize, usize, usize)| {
            let of_view = self.of_view(view);
            let of_chunk = stream(of_view, &[CHUNK, chunk as u64]).next_u64();
            Task {
                place: Place { step, second: compared.is_some(), view, chunk },
                problem: self.problem,
                fingerprint: self.fingerprints[i],
                replaced: self.replaced.clone(),
                x: self.x.to_vec(),
                share: self.share(),
                seeds: [of_view, if self.chunks == 1 { of_view } else { of_chunk }],
                chunks: self.chunks,
                pace: self.pace,
                adjoint: compared.map_or(vec![], |compared| compared.adjoints[i].clone()),
            }
        };
        places.map(task).collect()
    }

    /// Refuses parts where none are due.
    pub(super) fn none(&self, parts: &[Part]) -> Result<(), PartsError> {
        if parts.is_empty() { Ok(()) } else { Err(PartsError::Other { index: 0 }) }
    }

    /// The parts in the order of their tasks.
    pub(super) fn ordered(&self, parts: Vec<Part>, second: bool) -> Result<Vec<Part>, PartsError> {
        let step = self.checksum();
        let mut places: Vec<Option<Part>> = vec![None; self.views.len() * self.chunks];
        let name = |view: usize| self.objective.views[view].name.clone();
        for (index, part) in parts.into_iter().enumerate() {
            let Place { view, chunk, .. } = part.place;
            let other = PartsError::Other { index };
            let i = self.views.iter().position(|v| *v == view).ok_or(other.clone())?;
            if part.place != (Place { step, second, view, chunk }) || chunk >= self.chunks {
                return Err(other);
            }
            let image = self.chunks > 1 && !second;
            let numbers = if image { 0 } else { self.x.len() };
            let (width, height) = self.objective.views[view].target.size();
            let pixels = if image { width * height } else { 0 };
            if part.gradient.len() != numbers
                || part.image.len() != pixels
                || (image && part.size != (width, height))
            {
                return Err(other);
            }
            let place = &mut places[i * self.chunks + chunk];
            if place.replace(part).is_some() {
                return Err(PartsError::Doubled { view: name(view), chunk });
            }
        }
        let missing = |i: usize| PartsError::Missing {
            view: name(self.views[i / self.chunks]),
            chunk: i % self.chunks,
        };
        places.into_iter().enumerate().map(|(i, part)| part.ok_or_else(|| missing(i))).collect()
    }

    /// The losses and adjoints of the mean images of the chunks, with the scene at x.
    pub(super) fn compare(&self, scene: &mut Scene, parts: &[Part]) -> Result<Compared, ObjectiveError> {
        let (mut losses, mut adjoints) = (vec![], vec![]);
        let each = 1.0 / self.chunks as f64;
        for (&v, parts) in self.views.iter().zip(parts.chunks(self.chunks)) {
            self.objective.look(scene, v)?;
            let mut mean = Image::constant(parts[0].size.0, parts[0].size.1, DVec3::ZERO);
            for part in parts {
                let sums = mean.pixels.iter_mut().zip(&part.image);
                sums.for_each(|(sum, pixel)| *sum += each * DVec3::from_array(*pixel));
            }
            let at = (v, self.of_view(v), self.share());
            let (loss, adjoint) = compare(self.objective, scene, self.parameters, at, &mean)?;
            losses.push(loss);
            adjoints.push(adjoint.pixels.iter().map(|a| (each * *a).to_array()).collect());
        }
        let non_finite = parts.iter().map(|part| part.non_finite).sum();
        let image_time = parts.iter().map(|part| part.image_time).sum();
        Ok(Compared { losses, adjoints, non_finite, image_time })
    }

    /// The sum of the parts and the penalties, with the scene at x.
    pub(super) fn total(
        &self,
        scene: &Scene,
        parts: &[Part],
        compared: Option<&Compared>,
    ) -> Result<Evaluation, ObjectiveError> {
        if self.views.is_empty() {
            return Err(ObjectiveError::NoViews);
        }
        let mut found = Evaluation {
            loss: compared.map_or(0.0, |compared| compared.losses.iter().sum()),
            penalty: 0.0,
            gradient: vec![0.0; self.x.len()],
            non_finite: compared.map_or(0, |compared| compared.non_finite),
            image_time: compared.map_or(Duration::ZERO, |compared| compared.image_time),
            gradient_time: Duration::ZERO,
        };
        for part in parts {
            found.loss += part.loss;
            found.loss += part.mask_loss;
            found.non_finite += part.non_finite;
            found.image_time += part.image_time;
            found.gradient_time += part.gradient_time;
            add(&mut found.gradient, &part.gradient);
        }
        self.objective.add_penalties(scene, (self.parameters, self.x), self.seed, &mut found)?;
        Ok(found)
    }
}

impl Objective {
    /// Estimates the objective over some of the views, and its derivative by x, with the scene already at x.
    ///
    /// Image and gradient of each view use separate random numbers, derived from `seed`.
    ///
    /// # Errors
    /// An [`ObjectiveError`].
    ///
    /// # Panics
    /// If there is no such view, or x has another length.
    pub fn evaluate(
        &self,
        scene: &mut Scene,
        (parameters, x): (&Parameters, &[f64]),
        views: &[usize],
        seed: u64,
        reverse: Reverse<'_>,
        progress: &Progress,
    ) -> Result<Evaluation, ObjectiveError> {
        if views.is_empty() {
            return Err(ObjectiveError::NoViews);
        }
        let step = Step {
            objective: self,
            parameters,
            x,
            views: views.to_vec(),
            problem: None,
            fingerprints: vec![0; views.len()],
            replaced: vec![],
            seed,
            chunks: 1,
            pace: None,
        };
        let run = |task: Task| task.run_at(scene, self, parameters, reverse, progress);
        let parts = step.tasks(None).into_iter().map(run).collect::<Result<Vec<_>, _>>()?;
        step.total(scene, &parts, None)
    }
}

/// Loss of an image of a view and its adjoint image, both times `share`.
fn compare(
    objective: &Objective,
    scene: &Scene,
    parameters: &Parameters,
    (view, seed, share): (usize, u64, f64),
    image: &Image,
) -> Result<(f64, Image), ObjectiveError> {
    let chosen = objective.chosen(view, seed)?;
    let image = objective.only(view, &chosen, image);
    let active = parameters.active(scene);
    let (mut loss, mut adjoint) = objective.compare_seen(scene, &active, &objective.views[view], &image)?;
    if let Some(chosen) = &chosen {
        let each = chosen.len() as f64 / chosen.iter().filter(|chosen| **chosen).count() as f64;
        loss *= each;
        adjoint.pixels.iter_mut().for_each(|p| *p *= each);
    }
    adjoint.pixels.iter_mut().for_each(|p| *p *= share);
    Ok((share * loss, adjoint))
}

fn image((width, height): (usize, usize), pixels: &[[f64; 3]]) -> Image {
    Image { width, height, pixels: pixels.iter().copied().map(DVec3::from_array).collect() }
}
