//! Fits.

use std::num::NonZeroUsize;
use std::sync::{Arc, Mutex, MutexGuard, PoisonError};

use numpy::PyArray1;
use pyo3::exceptions::PyValueError;
use pyo3::prelude::*;
use pyo3::pybacked::PyBackedBytes;
use pyo3::types::PyBytes;
use volume3d::Image;
use volume3d::gradient::{ActiveParameters, Estimator, Gradient, GradientError, Progress};
use volume3d::optimize::{
    Adam, Fit as Core, FitError as FitProblem, GridSteps, LargeSteps, Loss, Objective, Optimizer,
    Parameters as CoreParameters, Part, Penalty, Plan, Problem, Quantity, Regularizer, Schedule, Task, Told,
    View, decode_state, encode_state,
};
use volume3d::scene::{Film, Scene as CoreScene};

use crate::arrays::{Array, array_to_image, numbers, to_array};
use crate::camera::Camera;
use crate::errors::FitError;
use crate::estimate::Method;
use crate::parameters::Parameters;
use crate::run::run;
use crate::scene::Scene;

/// A fit and the scene that it changes.
#[pyclass(frozen, module = "volume3d._core")]
pub(crate) struct Fit {
    inner: Mutex<Inner>,
}

struct Inner {
    fit: Core,
    scene: CoreScene,
    estimator: Estimator,
    /// The scene with which the fit began.
    start: Arc<CoreScene>,
    /// Checksums that identify the fit's tasks, once they are needed.
    problem: Option<Problem>,
}

/// Name, camera, picture and weights of a view.
#[derive(FromPyObject)]
pub(crate) struct ViewArrays<'py>(String, Option<Py<Camera>>, Array<'py>, Option<Array<'py>>);

/// Rate, β₁, β₂, whether all numbers share one second moment, and λ of large steps.
#[derive(FromPyObject)]
pub(crate) struct AdamSettings(f64, f64, f64, bool, Option<f64>);

/// Shape, kind and weight of a regularizer.
#[derive(FromPyObject)]
pub(crate) struct Term(String, String, f64);

impl Fit {
    fn lock(&self) -> MutexGuard<'_, Inner> {
        self.inner.lock().unwrap_or_else(PoisonError::into_inner)
    }
}

#[pymethods]
impl Fit {
    #[new]
    #[expect(clippy::too_many_arguments, reason = "called by one Python function, which names them")]
    fn new(
        py: Python<'_>,
        scene: &Scene,
        parameters: &Parameters,
        x: Array<'_>,
        views: Vec<ViewArrays<'_>>,
        loss: (String, f64),
        optimizers: Vec<AdamSettings>,
        penalties: Vec<Term>,
        plan: (u64, String, f64, usize, u64),
        samples: (usize, Option<usize>, NonZeroUsize),
        method: Method,
    ) -> PyResult<Self> {
        let (start, scene) = (scene.core.clone(), (*scene.core).clone());
        let parameters = parameters.core.clone();
        let views = views.into_iter().map(|v| view(v, &scene)).collect::<PyResult<Vec<_>>>()?;
        let optimizers = optimizers.into_iter().zip(parameters.groups());
        let optimizers = optimizers.map(|(settings, group)| optimizer(&settings, group.quantity, &scene));
        let optimizers = optimizers.collect::<PyResult<Vec<_>>>()?;
        let penalties = penalties.into_iter().map(|term| penalty(&term, &scene)).collect::<PyResult<_>>()?;
        let (image_samples, pixels, chunks) = samples;
        let loss = match (loss.0.as_str(), loss.1) {
            ("l2", _) => Loss::L2,
            ("l1", _) => Loss::L1,
            ("relative", epsilon) => Loss::Relative { epsilon },
            ("multiscale", levels) => Loss::Multiscale { levels: levels as usize },
            (other, _) => {
                let text = format!("the loss must be l2, l1, relative or multiscale, not `{other}`");
                return Err(PyValueError::new_err(text));
            }
        };
        let objective =
            Objective { views, loss, penalties, masks: None, silhouettes: None, pixels, image_samples };
        let (steps, schedule, end, views_per_step, seed) = plan;
        let schedule = match schedule.as_str() {
            "constant" => Schedule::Constant {},
            "cosine" => Schedule::Cosine { end },
            "exponential" => Schedule::Exponential { end },
            other => {
                let text = format!("the schedule must be constant, cosine or exponential, not `{other}`");
                return Err(PyValueError::new_err(text));
            }
        };
        let plan = Plan { steps, schedule, views_per_step, seed };
        let fit = Core::new(parameters, numbers(&x)?.to_vec(), objective, optimizers, plan).in_chunks(chunks);
        let estimator = method.estimator()?;
        let mut inner = Inner { fit, scene, estimator, start, problem: None };
        run(py, None, |progress| inner.choose(progress))?.map_err(error)?;
        Ok(Self { inner: Mutex::new(inner) })
    }

    /// Takes one step; false once all steps are taken.
    fn step(&self, py: Python<'_>) -> PyResult<bool> {
        run(py, None, |progress| {
            let Inner { fit, scene, estimator, .. } = &mut *self.lock();
            if fit.is_done() {
                return Ok(false);
            }
            fit.step(scene, &reverse(estimator), progress).map(|()| true)
        })?
        .map_err(error)
    }

    /// The tasks of the current round of a step, for [`Worker::run`]; none once all steps are taken.
    fn ask<'py>(&self, py: Python<'py>) -> PyResult<Vec<Bound<'py, PyBytes>>> {
        let encode = |task| postcard::to_stdvec(&task).map_err(|error| error.to_string());
        let tasks = run(py, None, |_| {
            let mut inner = self.lock();
            let problem = inner.problem();
            inner.fit.ask(problem).into_iter().map(encode).collect::<Result<Vec<Vec<u8>>, _>>()
        })?;
        Ok(tasks.map_err(error)?.iter().map(|task| PyBytes::new(py, task)).collect())
    }

    /// Receives the parts of all tasks of a round, in any order; true once the step is taken.
    fn tell(&self, py: Python<'_>, parts: Vec<PyBackedBytes>) -> PyResult<bool> {
        run(py, None, |_| {
            let decode = |part: &PyBackedBytes| postcard::from_bytes(part);
            let parts = parts.iter().map(decode).collect::<Result<Vec<Part>, _>>();
            let parts = parts.map_err(|error| format!("a part of a step is damaged: {error}"))?;
            let Inner { fit, scene, .. } = &mut *self.lock();
            fit.tell(scene, parts).map(|told| told == Told::Step).map_err(|error| error.to_string())
        })?
        .map_err(error)
    }

    /// A worker for the tasks of this fit.
    fn worker(&self, py: Python<'_>) -> PyResult<Worker> {
        run(py, None, |_| {
            let mut inner = self.lock();
            let problem = inner.problem();
            let Inner { fit, scene, estimator, .. } = &*inner;
            let (objective, parameters) = (fit.objective().clone(), fit.parameters().clone());
            Worker { objective, parameters, scene: scene.clone(), estimator: estimator.clone(), problem }
        })
    }

    /// Steps taken so far.
    #[getter]
    fn steps_taken(&self) -> u64 {
        self.lock().fit.steps_taken()
    }

    /// Loss and penalty of each step.
    #[getter]
    fn losses(&self) -> Vec<(f64, f64)> {
        self.lock().fit.state().records.iter().map(|record| (record.loss, record.penalty)).collect()
    }

    /// The method of all steps, in words.
    #[getter]
    fn method(&self) -> String {
        match &self.lock().estimator {
            Estimator::WarpedArea(_) => "warped area",
            Estimator::EdgeSampling(_) => "edge sampling",
            Estimator::Rotation(_) => "rotation",
            Estimator::FiniteDifference(_) => "finite differences",
            Estimator::Auto(_) => "auto",
        }
        .to_owned()
    }

    /// The fitted values.
    fn values<'py>(&self, py: Python<'py>) -> Bound<'py, PyArray1<f64>> {
        to_array(py, self.lock().fit.result().to_vec())
    }

    /// The state as bytes.
    fn state<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyBytes>> {
        let bytes = encode_state(self.lock().fit.state(), 0).map_err(error)?;
        Ok(PyBytes::new(py, &bytes))
    }

    /// Goes on from a state.
    fn resume(&self, py: Python<'_>, state: &[u8]) -> PyResult<()> {
        let state = decode_state(state, 0).map_err(error)?;
        run(py, None, |_| {
            let mut inner = self.lock();
            let mut scene = inner.scene.clone();
            let fit = inner.fit.clone().resumed(state, &mut scene).map_err(str::to_owned)?;
            fit.apply(&mut scene).map_err(|error| error.to_string())?;
            (inner.fit, inner.scene) = (fit, scene);
            Ok::<_, String>(())
        })?
        .map_err(error)
    }
}

/// Runs tasks of a fit, several at once.
#[pyclass(frozen, module = "volume3d._core")]
pub(crate) struct Worker {
    objective: Objective,
    parameters: CoreParameters,
    scene: CoreScene,
    estimator: Estimator,
    problem: Problem,
}

#[pymethods]
impl Worker {
    /// The part of a task.
    fn run<'py>(&self, py: Python<'py>, task: PyBackedBytes) -> PyResult<Bound<'py, PyBytes>> {
        let part = run(py, None, |progress| {
            let task: Task =
                postcard::from_bytes(&task).map_err(|error| format!("the task is damaged: {error}"))?;
            let (mut scene, reverse) = (self.scene.clone(), reverse(&self.estimator));
            let with = (&self.objective, &self.parameters);
            let part = task.run(self.problem, &mut scene, with, &reverse, progress);
            postcard::to_stdvec(&part.map_err(|error| error.to_string())?).map_err(|error| error.to_string())
        })?;
        Ok(PyBytes::new(py, &part.map_err(error)?))
    }
}

/// The derivative of a step, with the seed of the step.
fn reverse(
    estimator: &Estimator,
) -> impl Fn(&CoreScene, &Image, &ActiveParameters, u64, &Progress) -> Result<Gradient, GradientError> {
    |scene, adjoint, active, seed, progress| {
        estimator.with_seed(seed).reverse(scene, adjoint, active, progress)
    }
}

impl Inner {
    /// Lets a pilot choose the method of all steps, if there is one.
    fn choose(&mut self, progress: &Progress) -> Result<(), FitProblem> {
        let Self { fit, scene, estimator, .. } = self;
        if let Estimator::Auto(pilot) = estimator {
            *estimator = fit.choose(pilot, scene, progress, || {})?.method.into();
        }
        Ok(())
    }

    fn problem(&mut self) -> Problem {
        let Self { fit, start, estimator, problem, .. } = self;
        *problem.get_or_insert_with(|| Problem::new(start, fit.parameters(), estimator))
    }
}

fn error(error: impl std::fmt::Display) -> PyErr {
    FitError::new_err(error.to_string())
}

fn view(view: ViewArrays<'_>, scene: &CoreScene) -> PyResult<View> {
    let ViewArrays(name, camera, target, weights) = view;
    let target = array_to_image(&target, &format!("the picture of view `{name}`"))?;
    let weights =
        weights.map(|w| array_to_image(&w, &format!("the weights of view `{name}`"))).transpose()?;
    let Image { width, height, .. } = target;
    let film = Film { width, height, crop: None, ..scene.description().film };
    let camera = camera.map(|camera| camera.get().core.clone());
    Ok(View { name, camera, film, target, weights, mask: None })
}

fn optimizer(settings: &AdamSettings, quantity: Quantity, scene: &CoreScene) -> PyResult<Optimizer> {
    let &AdamSettings(rate, beta1, beta2, uniform, lambda) = settings;
    let mut adam = Adam::new(rate);
    (adam.beta1, adam.beta2, adam.uniform) = (beta1, beta2, uniform);
    let Some(lambda) = lambda else { return Ok(adam.into()) };
    match quantity {
        Quantity::VertexPositions { shape } => {
            adam.uniform = true;
            let mesh = &scene.description().shapes[shape].mesh;
            let large_steps = Some(LargeSteps::new(mesh, lambda).map_err(error)?);
            Ok(Optimizer { large_steps, ..adam.into() })
        }
        Quantity::Sdf { .. } if lambda.is_finite() && lambda >= 0.0 => {
            let grid = Some(GridSteps { smoothing: lambda, redistance: true, ..GridSteps::default() });
            Ok(Optimizer { grid, ..adam.into() })
        }
        Quantity::Sdf { .. } => Err(error(format!("λ of large steps must be at least 0, not {lambda}"))),
        _ => Err(error("large steps are for vertex positions and SDF grids")),
    }
}

fn penalty(term: &Term, scene: &CoreScene) -> PyResult<Penalty> {
    let Term(shape, kind, weight) = term;
    let shape = scene.find_shape(shape).map_err(error)?;
    let regularizer = match kind.as_str() {
        "laplacian" => Regularizer::Laplacian,
        "edge-length" => Regularizer::EdgeLength,
        "normal-consistency" => Regularizer::NormalConsistency,
        other => {
            let text =
                format!("a penalty must be laplacian, edge-length or normal-consistency, not `{other}`");
            return Err(PyValueError::new_err(text));
        }
    };
    Ok(Penalty::Mesh { shape, regularizer, weight: *weight })
}
