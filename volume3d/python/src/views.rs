//! Pictures with cameras, from files of other programs.

use std::path::PathBuf;

use glam::DVec3;
use numpy::{IntoPyArray, PyArray2, PyArray3, PyArrayMethods};
use pyo3::exceptions::PyIndexError;
use pyo3::prelude::*;
use volume3d::io;
use volume3d::io::views::Views as Core;

use crate::arrays::image_to_array;
use crate::camera::Camera;
use crate::errors;
use crate::run::run;

/// Pictures with cameras, of which the pictures are not read yet.
#[pyclass(frozen, module = "volume3d._core")]
pub(crate) struct Views {
    core: Core,
}

/// Columns and rows.
type Size = (usize, usize);

/// Picture and weights (height, width, 3), and mask (height, width).
type Pictures<'py> =
    (Bound<'py, PyArray3<f64>>, Option<Bound<'py, PyArray3<f64>>>, Option<Bound<'py, PyArray2<bool>>>);

#[pymethods]
impl Views {
    /// `transforms.json`.
    #[staticmethod]
    #[pyo3(signature = (path, size = None))]
    fn from_nerf(py: Python<'_>, path: PathBuf, size: Option<Size>) -> PyResult<Self> {
        read(py, size, || Core::from_transforms(&path))
    }

    /// A folder of a COLMAP model, and that of its pictures.
    #[staticmethod]
    #[pyo3(signature = (model, images = None, size = None))]
    fn from_colmap(
        py: Python<'_>,
        model: PathBuf,
        images: Option<PathBuf>,
        size: Option<Size>,
    ) -> PyResult<Self> {
        read(py, size, || Core::from_colmap(&model, images.as_deref()))
    }

    /// A folder in the layout of DTU data.
    #[staticmethod]
    #[pyo3(signature = (folder, size = None))]
    fn from_dtu(py: Python<'_>, folder: PathBuf, size: Option<Size>) -> PyResult<Self> {
        read(py, size, || Core::from_dtu(&folder))
    }

    /// The sensors of a Mitsuba scene, with a picture each.
    #[staticmethod]
    #[pyo3(signature = (scene, variables, pictures, size = None))]
    fn from_mitsuba(
        py: Python<'_>,
        scene: PathBuf,
        variables: Vec<(String, String)>,
        pictures: Vec<PathBuf>,
        size: Option<Size>,
    ) -> PyResult<Self> {
        read(py, size, || Core::from_sensors(&scene, &variables, &pictures))
    }

    /// Name, camera and size of each view.
    #[getter]
    fn entries(&self) -> Vec<(String, Camera, Size)> {
        let view = |view: &io::views::PosedPicture| {
            (view.name.clone(), Camera { core: view.camera.clone() }, (view.width, view.height))
        };
        self.core.list.iter().map(view).collect()
    }

    /// Reads the pictures of a view, over a colour where they are transparent.
    fn load<'py>(&self, py: Python<'py>, index: usize, background: [f64; 3]) -> PyResult<Pictures<'py>> {
        let view = self.core.list.get(index).ok_or_else(|| PyIndexError::new_err("there is no such view"))?;
        let background = DVec3::from_array(background);
        let read = |_: &_| Ok((view.load(background)?, view.load_weights()?, view.load_mask()?));
        let read = run(py, None, read)?;
        let (picture, weights, mask) = read.map_err(|error: io::Error| errors::scene(error))?;
        let mask = mask.map(|mask| io::covered(&mask).into_pyarray(py).reshape([mask.height, mask.width]));
        let weights = weights.map(|weights| image_to_array(py, &weights)).transpose()?;
        Ok((image_to_array(py, &picture)?, weights, mask.transpose()?))
    }
}

fn read(
    py: Python<'_>,
    size: Option<Size>,
    read: impl FnOnce() -> Result<Core, io::Error> + Send,
) -> PyResult<Views> {
    let views = run(py, None, |_| {
        let views = read()?;
        match size {
            None => Ok(views),
            Some((width, height)) => views.resized(width, height),
        }
    })?;
    views.map(|core| Views { core }).map_err(|error: io::Error| errors::scene(error))
}

/// Id, camera and size of all sensors of a Mitsuba scene.
#[pyfunction]
pub(crate) fn sensors(
    py: Python<'_>,
    scene: PathBuf,
    variables: Vec<(String, String)>,
) -> PyResult<Vec<(Option<String>, Camera, Size)>> {
    let sensors = run(py, None, |_| io::load_sensors(&scene, &variables))?;
    let sensors = sensors.map_err(errors::scene)?.into_iter();
    Ok(sensors.map(|s| (s.id, Camera { core: s.camera }, (s.width, s.height))).collect())
}
