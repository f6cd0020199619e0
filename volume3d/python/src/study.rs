//! Quality of gradients: `check`, `lint` and `tune`.

use pyo3::prelude::*;
use pyo3::types::PyDict;
use volume3d::check::{Check, Checked, Verdict};
use volume3d::gradient::{OneSided, Progress, Tangent};
use volume3d::lint::{self, Finding};
use volume3d::tune::{self, Bias, Limit, Outcome, Setting, Target, Tune};

use crate::arrays::{Array, numbers};
use crate::errors;
use crate::estimate::{Method, places, warnings};
use crate::parameters::Parameters;
use crate::run::run;
use crate::scene::Scene;

/// A change of a scene: parameters, their values, and rates.
#[derive(FromPyObject)]
pub(crate) struct Change<'py>(PyRef<'py, Parameters>, Array<'py>, Array<'py>);

impl Change<'_> {
    fn tangent(&self, scene: &Scene) -> PyResult<Tangent> {
        let Self(parameters, x, direction) = self;
        Ok(parameters.core.tangent(&scene.core, numbers(x)?, numbers(direction)?))
    }
}

/// Compares a method, with its samples in each run, with finite differences.
#[pyfunction]
#[pyo3(signature = (scene, change, method, steps, report = None))]
pub(crate) fn check<'py>(
    py: Python<'py>,
    scene: &Scene,
    change: Change<'py>,
    method: Method,
    steps: Vec<f64>,
    report: Option<Py<PyAny>>,
) -> PyResult<Bound<'py, PyDict>> {
    let (tangent, scene) = (change.tangent(scene)?, &*scene.core);
    let estimator = method.estimator()?;
    let check = Check { samples: method.samples(), steps, seed: method.seed() };
    let found =
        run(py, report.as_ref(), |progress: &Progress| check.run(scene, &tangent, &estimator, progress))?;
    let Checked { method, slopes, verdict, choice, non_finite, left_out, one_sided } =
        found.map_err(errors::gradient)?;
    let mut warnings = warnings(None, false, &left_out);
    warnings.extend(one_sided.iter().map(|(step, found)| at_bound(*step, found)));
    warnings.extend(lint::parted(scene, &tangent.positions).into_iter().map(|finding| finding.message));
    let (name, step, by, within, more) = match verdict {
        Verdict::Agrees { step, within } => ("agrees", Some(step), None, Some(within), None),
        Verdict::Differs { step, by } => ("differs", Some(step), Some(by), None, None),
        Verdict::Open { within, more } => ("open", None, None, Some(within), more),
        Verdict::Nothing => ("nothing changes", None, None, None, None),
    };
    let row = |slope: &volume3d::check::Slope| {
        let estimate = slope.estimate;
        (slope.step, estimate.mean, estimate.error, slope.bias(), method.z(estimate))
    };
    let dict = PyDict::new(py);
    dict.set_item("verdict", name)?;
    dict.set_item("step", step)?;
    dict.set_item("by", by)?;
    dict.set_item("within", within)?;
    dict.set_item("more", more)?;
    dict.set_item("total", method.mean)?;
    dict.set_item("total_stderr", method.error)?;
    dict.set_item("slopes", slopes.iter().map(row).collect::<Vec<_>>())?;
    dict.set_item("choice", choice.map(|choice| choice.to_string()))?;
    dict.set_item("non_finite", places(&non_finite))?;
    dict.set_item("warnings", warnings)?;
    Ok(dict)
}

/// A sentence on a one-sided difference.
fn at_bound(step: f64, OneSided { ahead, outside }: &OneSided) -> String {
    let (side, other) = if *ahead { ("forward", "θ − h") } else { ("backward", "θ + h") };
    format!(
        "finite differences with step {step:.1e} are {side} ones, with an error proportional to the step: at {other} {outside}"
    )
}

/// Kind, names of shapes, whether gradients are wrong, message, advice.
type Row = (&'static str, Vec<String>, bool, String, &'static str);

/// Problems of a scene for gradients, along a change or in general.
#[pyfunction]
#[pyo3(name = "lint", signature = (scene, change = None))]
pub(crate) fn find_problems(py: Python<'_>, scene: &Scene, change: Option<Change<'_>>) -> PyResult<Vec<Row>> {
    let (tangent, scene) = (change.map(|change| change.tangent(scene)).transpose()?, &*scene.core);
    let found = run(py, None, |_| match &tangent {
        Some(tangent) => lint::lint_change(scene, tangent),
        None => lint::lint(scene),
    })?;
    let row = |Finding { kind, shapes, is_wrong, message, advice }| {
        (kind.name(), shapes, is_wrong, message, advice)
    };
    Ok(found.into_iter().map(row).collect())
}

/// A study of all settings that name and step determine.
#[pyclass(frozen, module = "volume3d._core")]
pub(crate) struct Tuning {
    core: tune::Tuning,
}

/// Name of a method and step of finite differences.
type Named = (&'static str, Option<f64>);

fn named(setting: Setting) -> Named {
    let step = if let Setting::FiniteDifference(step) = setting { Some(step) } else { None };
    (setting.method().unwrap_or_default(), step)
}

#[pymethods]
impl Tuning {
    /// Studies a change within a time or a number of samples per pixel.
    #[new]
    #[pyo3(signature = (scene, change, seconds, samples, seed, report = None))]
    fn new(
        py: Python<'_>,
        scene: &Scene,
        change: Change<'_>,
        seconds: f64,
        samples: Option<usize>,
        seed: u64,
        report: Option<Py<PyAny>>,
    ) -> PyResult<Self> {
        let (tangent, scene) = (change.tangent(scene)?, &*scene.core);
        let tune = Tune { limit: samples.map_or(Limit::Seconds(seconds), Limit::Samples), seed };
        let found = run(py, report.as_ref(), |progress: &Progress| {
            let mut settings = Setting::all(scene, &tangent);
            settings.retain(|setting| setting.method().is_some());
            tune.run(scene, &tangent, &settings, progress)
        })?;
        Ok(Self { core: found.map_err(errors::gradient)? })
    }

    /// Rows of all settings.
    #[getter]
    fn settings<'py>(&self, py: Python<'py>) -> PyResult<Vec<Bound<'py, PyDict>>> {
        let row = |tuned: &tune::Tuned| {
            let dict = PyDict::new(py);
            let (method, step) = named(tuned.setting);
            dict.set_item("method", method)?;
            dict.set_item("step", step)?;
            dict.set_item("unbiased", tuned.unbiased)?;
            dict.set_item("heavy_tails", tuned.is_heavy())?;
            dict.set_item(
                "note",
                match &tuned.outcome {
                    Outcome::Measured(_) => String::new(),
                    Outcome::Refused(reason) => reason.to_string(),
                    Outcome::TooSlow => "one sample per pixel exceeds the budget".to_owned(),
                },
            )?;
            if let (Some(rung), Some(law)) = (tuned.rungs().last(), tuned.law()) {
                let (bias, is_resolved) = match law.bias {
                    Bias::Proved { below } | Bias::Unresolved { below } => (below, false),
                    Bias::Resolved(bias) => (bias, true),
                };
                dict.set_item("spp", rung.samples)?;
                dict.set_item("seconds", rung.seconds)?;
                dict.set_item("slope", rung.statistics.slope.value)?;
                dict.set_item("slope_stderr", rung.statistics.slope.error)?;
                dict.set_item("bias", bias)?;
                dict.set_item("bias_is_resolved", is_resolved)?;
                dict.set_item("noise", rung.statistics.relative_variance.value.max(0.0).sqrt())?;
            }
            Ok(dict)
        };
        self.core.settings.iter().map(row).collect()
    }

    /// The setting that serves as the reference, its samples per pixel, and whether it is unbiased.
    #[getter]
    fn reference(&self) -> (String, usize, bool) {
        let reference = &self.core.reference;
        (reference.setting.to_string(), reference.samples, reference.unbiased)
    }

    /// Noise under other pixel filters, divided by that under the scene's.
    #[getter]
    fn filters(&self) -> Vec<(&'static str, f64)> {
        self.core.filters.iter().map(|filter| (filter.name, filter.ratio)).collect()
    }

    /// Duration of the study.
    #[getter]
    fn seconds(&self) -> f64 {
        self.core.seconds
    }

    /// Method and step, samples per pixel, seconds, error with its standard error, and whether single samples
    /// carry much of the result.
    fn best(&self, seconds: Option<f64>, error: Option<f64>) -> Option<(Named, usize, f64, [f64; 2], bool)> {
        let target = seconds.map(Target::Seconds).or(error.map(Target::Error))?;
        let (tuned, found) = self.core.best(target)?;
        let error = [found.error.value, found.error.error];
        Some((named(tuned.setting), found.samples, found.seconds, error, tuned.is_heavy()))
    }
}
