//! Exceptions.

use pyo3::exceptions::PyException;
use pyo3::prelude::*;
use pyo3::{PyErr, create_exception};

create_exception!(volume3d, Error, PyException, "Base class of all exceptions of this package.");
create_exception!(volume3d, SceneError, Error, "A scene, a mesh or a file is invalid.");
create_exception!(volume3d, ParameterError, Error, "A parameter does not exist, or its value is invalid.");
create_exception!(volume3d, GradientError, Error, "An image or a derivative cannot be computed.");
create_exception!(volume3d, FitError, Error, "A fit cannot begin, go on or resume.");
create_exception!(volume3d, InternalError, Error, "A fault of this package: please report it.");

pub(crate) fn add_to(module: &Bound<'_, PyModule>) -> PyResult<()> {
    let py = module.py();
    module.add("Error", py.get_type::<Error>())?;
    module.add("SceneError", py.get_type::<SceneError>())?;
    module.add("ParameterError", py.get_type::<ParameterError>())?;
    module.add("GradientError", py.get_type::<GradientError>())?;
    module.add("FitError", py.get_type::<FitError>())?;
    module.add("InternalError", py.get_type::<InternalError>())
}

/// An exception with the text of an error of the library.
pub(crate) fn scene(error: impl std::fmt::Display) -> PyErr {
    SceneError::new_err(error.to_string())
}

/// An exception with the text of an error of the library.
pub(crate) fn parameter(error: impl std::fmt::Display) -> PyErr {
    ParameterError::new_err(error.to_string())
}

/// An exception with the text of an error of the library.
pub(crate) fn gradient(error: impl std::fmt::Display) -> PyErr {
    GradientError::new_err(error.to_string())
}
