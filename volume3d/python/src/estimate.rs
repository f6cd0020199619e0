//! Derivatives of images, in both directions.

use std::fmt::Display;

use numpy::PyArray1;
use pyo3::prelude::*;
use pyo3::types::PyDict;
use volume3d::gradient::{Contribution, Estimator, GradientError, NonFinite, Pilot, Progress, Unsupported};

use crate::arrays::{Array, array_to_image, image_to_array, numbers, to_array};
use crate::errors;
use crate::parameters::Parameters;
use crate::run::run;
use crate::scene::Scene;

/// Name of a method, samples per pixel, seed, and step of finite differences.
#[derive(FromPyObject)]
pub(crate) struct Method(String, usize, u64, Option<f64>);

impl Method {
    pub(crate) fn samples(&self) -> usize {
        self.1
    }

    pub(crate) fn seed(&self) -> u64 {
        self.2
    }

    pub(crate) fn estimator(&self) -> PyResult<Estimator> {
        let Self(name, samples, seed, step) = self;
        let estimator = Estimator::by_name(name, *samples, *seed).map_err(errors::gradient)?;
        Ok(match (estimator, step) {
            (Estimator::FiniteDifference(method), Some(step)) => {
                Estimator::finite_difference(method.samples, *step, method.seed)
            }
            (estimator, _) => estimator,
        })
    }
}

/// dI/dθ of every pixel along a direction.
#[pyfunction]
#[pyo3(signature = (scene, parameters, x, direction, method, report = None))]
pub(crate) fn forward<'py>(
    py: Python<'py>,
    scene: &Scene,
    parameters: &Parameters,
    x: Array<'py>,
    direction: Array<'py>,
    method: Method,
    report: Option<Py<PyAny>>,
) -> PyResult<Bound<'py, PyDict>> {
    let (estimator, x, direction) = (method.estimator()?, numbers(&x)?, numbers(&direction)?);
    let scene = &*scene.core;
    let found = run(py, report.as_ref(), |progress: &Progress| {
        let tangent = parameters.core.tangent(scene, x, direction);
        let choose = |pilot: &Pilot| pilot.for_change(scene, &tangent, progress);
        let (estimator, choice) = estimator.chosen(choose).map_err(errors::gradient)?;
        let result = estimator.forward(scene, &tangent, progress).map_err(errors::gradient)?;
        Ok::<_, PyErr>((result, choice.map(|choice| choice.to_string())))
    })?;
    let (result, choice) = found?;
    let warnings = warnings(
        result.outlier().map(|sample| (sample, result.largest_share())),
        result.is_zero(),
        &result.left_out,
    );
    let dict = PyDict::new(py);
    dict.set_item("gradient", image_to_array(py, &result.gradient)?)?;
    dict.set_item("stderr", image_to_array(py, &result.standard_error)?)?;
    dict.set_item("image", image_to_array(py, &result.image)?)?;
    dict.set_item("image_stderr", image_to_array(py, &result.image_error)?)?;
    dict.set_item("total", result.regions.total.to_array())?;
    dict.set_item("total_stderr", result.regions.total_error.to_array())?;
    dict.set_item("non_finite", places(&result.non_finite))?;
    dict.set_item("choice", choice)?;
    dict.set_item("warnings", warnings)?;
    Ok(dict)
}

/// The gradient of Σ adjoint · image by all numbers, non-finite samples, what a pilot chose, and warnings.
#[pyfunction]
#[pyo3(signature = (scene, parameters, x, adjoint, method, report = None))]
pub(crate) fn reverse<'py>(
    py: Python<'py>,
    scene: &Scene,
    parameters: &Parameters,
    x: Array<'py>,
    adjoint: Array<'py>,
    method: Method,
    report: Option<Py<PyAny>>,
) -> PyResult<Reversed<'py>> {
    let (estimator, adjoint) = (method.estimator()?, array_to_image(&adjoint, "the adjoint")?);
    let scene = &*scene.core;
    let found = run(py, report.as_ref(), |progress: &Progress| {
        let active = parameters.core.active(scene);
        let choose = |pilot: &Pilot| pilot.for_active(scene, Some(&adjoint), &active, progress);
        let (estimator, choice) = estimator.chosen(choose)?;
        let result = estimator.reverse(scene, &adjoint, &active, progress)?;
        Ok::<_, GradientError>((result, choice.map(|choice| choice.to_string())))
    })?;
    let (result, choice) = found.map_err(errors::gradient)?;
    let gradient = parameters.core.gradient(scene, numbers(&x)?, &result.by_parameter);
    let warnings =
        warnings(result.outlier().map(|sample| (sample, result.largest_share())), false, &result.left_out);
    Ok((to_array(py, gradient), places(&result.non_finite), choice, warnings))
}

/// Gradient, non-finite samples, choice of a pilot, warnings.
type Reversed<'py> = (Bound<'py, PyArray1<f64>>, Vec<Place>, Option<String>, Vec<String>);

/// Column, row and index of a sample.
pub(crate) type Place = (isize, isize, usize);

pub(crate) fn places(samples: &[NonFinite]) -> Vec<Place> {
    samples.iter().map(|s| (s.column, s.row, s.sample)).collect()
}

/// Sentences on what may be wrong with a result.
pub(crate) fn warnings(
    outlier: Option<(Contribution, f64)>,
    is_zero: bool,
    left_out: &[Unsupported],
) -> Vec<String> {
    let mut all = vec![];
    if let Some((Contribution { column, row, sample, .. }, share)) = outlier {
        all.push(format!(
            "sample {sample} at column {column}, row {row} contributes {:.1} % of the sum of |gradient|: the \
             distribution has heavy tails, and errors are larger than stated; use more samples or another method",
            100.0 * share
        ));
    }
    if is_zero {
        all.push(
            "no sample saw the image change: the derivative is 0, or what changes is too small or too rare for \
             this many samples"
                .to_owned(),
        );
    }
    let omitted = |what: &dyn Display| format!("the derivative is incomplete: {what}");
    all.extend(left_out.iter().map(|what| omitted(what)));
    all
}
