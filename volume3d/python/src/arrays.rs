//! Arrays of NumPy and of the library.

use glam::DVec3;
use numpy::{IntoPyArray, PyArray1, PyArray3, PyArrayMethods, PyReadonlyArrayDyn, PyUntypedArrayMethods};
use pyo3::exceptions::PyValueError;
use pyo3::prelude::*;
use volume3d::Image;

/// A contiguous array of `float64`; the Python side has made it so.
pub(crate) type Array<'py> = PyReadonlyArrayDyn<'py, f64>;

/// An array (height, width, 3).
pub(crate) fn image_to_array<'py>(py: Python<'py>, image: &Image) -> PyResult<Bound<'py, PyArray3<f64>>> {
    let flat: Vec<f64> = image.pixels.iter().flat_map(DVec3::to_array).collect();
    flat.into_pyarray(py).reshape([image.height, image.width, 3])
}

/// An image from an array (height, width, 3).
pub(crate) fn array_to_image(array: &Array<'_>, what: &str) -> PyResult<Image> {
    let &[height, width, 3] = array.shape() else {
        let shape = array.shape();
        let text = format!("{what} must have the shape (height, width, 3), not {shape:?}");
        return Err(PyValueError::new_err(text));
    };
    Ok(Image { width, height, pixels: vectors(array)? })
}

/// Triples from an array whose last dimension is 3.
pub(crate) fn vectors(array: &Array<'_>) -> PyResult<Vec<DVec3>> {
    Ok(numbers(array)?.chunks_exact(3).map(DVec3::from_slice).collect())
}

/// All numbers of an array, in C order.
pub(crate) fn numbers<'a>(array: &'a Array<'_>) -> PyResult<&'a [f64]> {
    array.as_slice().map_err(|_| PyValueError::new_err("arrays must be contiguous, in C order"))
}

/// An array of one dimension.
pub(crate) fn to_array(py: Python<'_>, numbers: Vec<f64>) -> Bound<'_, PyArray1<f64>> {
    numbers.into_pyarray(py)
}

/// A vector of three numbers.
pub(crate) fn triple(vector: DVec3) -> [f64; 3] {
    vector.to_array()
}
