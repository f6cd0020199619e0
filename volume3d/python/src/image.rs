//! Image files.

use std::path::PathBuf;

use numpy::PyArray3;
use pyo3::exceptions::PyValueError;
use pyo3::prelude::*;
use pyo3::types::PyBytes;
use volume3d::io;

use crate::arrays::{Array, array_to_image, image_to_array};
use crate::errors;
use crate::run::run;

/// A PNG in memory. With a `range` the image is signed: blue is −range, white 0, red range, and a range of 0
/// is chosen from the image.
#[pyfunction]
#[pyo3(signature = (array, signed_range = None))]
pub(crate) fn png<'py>(
    py: Python<'py>,
    array: Array<'py>,
    signed_range: Option<f64>,
) -> PyResult<Bound<'py, PyBytes>> {
    let image = array_to_image(&array, "an image")?;
    let bytes = match signed_range {
        None => io::encode_png(&image),
        Some(range) => {
            io::encode_signed_png(&image, if range == 0.0 { io::signed_range(&image) } else { range })
        }
    };
    Ok(PyBytes::new(py, &bytes.map_err(errors::scene)?))
}

/// Reads an image as linear RGB (height, width, 3).
#[pyfunction]
pub(crate) fn read_image(py: Python<'_>, path: PathBuf) -> PyResult<Bound<'_, PyArray3<f64>>> {
    let image = run(py, None, |_| io::load_image(&path, false))?.map_err(errors::scene)?;
    image_to_array(py, &image)
}

/// Writes an image (height, width, 3) of linear RGB as .exr or .png, by its name.
#[pyfunction]
#[pyo3(signature = (path, array, comments = ""))]
pub(crate) fn write_image(py: Python<'_>, path: PathBuf, array: Array<'_>, comments: &str) -> PyResult<()> {
    let image = array_to_image(&array, "an image")?;
    let extension = path.extension().map(|e| e.to_string_lossy().to_lowercase());
    let write = match extension.as_deref() {
        Some("exr") => io::write_exr_with_comments,
        Some("png") => io::write_png_with_comments,
        _ => {
            let text = format!("{}: images are written as .exr or .png", path.display());
            return Err(PyValueError::new_err(text));
        }
    };
    run(py, None, |_| write(&path, &image, comments))?.map_err(errors::scene)
}
