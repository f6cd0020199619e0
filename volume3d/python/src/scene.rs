//! Scenes.

use std::cell::RefCell;
use std::collections::BTreeMap;
use std::io::ErrorKind;
use std::path::{Path, PathBuf};
use std::sync::Arc;

use glam::DVec3;
use numpy::{IntoPyArray, PyArray2, PyArray3, PyArrayMethods};
use pyo3::exceptions::PyKeyError;
use pyo3::prelude::*;
use pyo3::pybacked::PyBackedBytes;
use volume3d::gradient::{self, Rendering};
use volume3d::io::{self, Note, ReadOptions};
use volume3d::optimize::Parameters;
use volume3d::scene::{Film, Scene as Core};

use crate::arrays::{image_to_array, to_array};
use crate::camera::Camera;
use crate::errors;
use crate::run::run;

/// A scene that never changes.
#[pyclass(frozen, module = "volume3d._core")]
#[derive(Clone)]
pub(crate) struct Scene {
    pub(crate) core: Arc<Core>,
}

/// Image, standard error, and non-finite samples as (column, row, sample).
type Rendered<'py> = (Bound<'py, PyArray3<f64>>, Bound<'py, PyArray3<f64>>, Vec<(isize, isize, usize)>);

/// Positions (n, 3) and triangles (m, 3) of a mesh.
type MeshArrays<'py> = (Bound<'py, PyArray2<f64>>, Bound<'py, PyArray2<u32>>);

#[pymethods]
impl Scene {
    /// Reads a scene file. Returns the scene, notes on interpretations, and all files that were read, itself
    /// first.
    #[staticmethod]
    #[pyo3(signature = (path, variables, size = None, lenient = false))]
    fn load_file(
        py: Python<'_>,
        path: PathBuf,
        variables: Vec<(String, String)>,
        size: Option<(usize, usize)>,
        lenient: bool,
    ) -> PyResult<Read> {
        let options = ReadOptions { variables, size, is_lenient: lenient };
        run(py, None, |_| {
            let bytes = io::read_bytes(&path).map_err(|error| format!("{}: {error}", path.display()))?;
            read(bytes, path, &options, &|path| io::read_bytes(path))
        })?
        .map_err(errors::scene)
    }

    /// Reads a scene from text, like `load_file`. Files that it names are searched in `folder`.
    #[staticmethod]
    #[pyo3(signature = (text, folder, variables, size = None, lenient = false))]
    fn load_string(
        py: Python<'_>,
        text: String,
        folder: PathBuf,
        variables: Vec<(String, String)>,
        size: Option<(usize, usize)>,
        lenient: bool,
    ) -> PyResult<Read> {
        let options = ReadOptions { variables, size, is_lenient: lenient };
        let path = folder.join("<string>");
        run(py, None, |_| read(text.into_bytes(), path, &options, &|path| io::read_bytes(path)))?
            .map_err(errors::scene)
    }

    /// Reads a scene again from the files that `load_file` or `load_string` returned, which need not exist.
    #[staticmethod]
    #[pyo3(signature = (files, variables, size = None, lenient = false))]
    fn load_files(
        py: Python<'_>,
        files: Vec<(PathBuf, PyBackedBytes)>,
        variables: Vec<(String, String)>,
        size: Option<(usize, usize)>,
        lenient: bool,
    ) -> PyResult<Self> {
        let options = ReadOptions { variables, size, is_lenient: lenient };
        run(py, None, |_| {
            let (path, main) = files.first().ok_or("a scene is made of at least one file")?;
            let open = |path: &Path| {
                let found = files.iter().find(|(other, _)| other == path);
                found.map(|(_, bytes)| bytes.to_vec()).ok_or_else(|| ErrorKind::NotFound.into())
            };
            read(main.to_vec(), path.clone(), &options, &open).map(|(scene, _, _)| scene)
        })?
        .map_err(errors::scene)
    }

    /// Writes the scene as Mitsuba XML, with its meshes and textures beside it.
    fn write(&self, py: Python<'_>, path: PathBuf) -> PyResult<()> {
        run(py, None, |_| io::write_scene(&path, &self.core))?.map_err(errors::scene)
    }

    /// Columns and rows.
    #[getter]
    fn size(&self) -> (usize, usize) {
        self.core.size()
    }

    /// Names of shapes, implicit surfaces, materials and lights.
    #[getter]
    fn objects(&self) -> [Vec<String>; 4] {
        let d = self.core.description();
        [
            d.shapes.iter().map(|shape| shape.id.clone()).collect(),
            d.implicits.iter().map(|implicit| implicit.id.clone()).collect(),
            d.materials.iter().map(|material| material.id.clone()).collect(),
            d.lights.iter().map(|light| light.id().to_owned()).collect(),
        ]
    }

    /// Names of all parameters.
    fn parameter_names(&self) -> Vec<String> {
        Parameters::names(&self.core)
    }

    /// The camera.
    #[getter]
    fn camera(&self) -> Camera {
        Camera { core: self.core.description().camera.clone() }
    }

    /// Positions and triangles of a mesh.
    fn mesh<'py>(&self, py: Python<'py>, name: &str) -> PyResult<MeshArrays<'py>> {
        let shape = self.core.find_shape(name).map_err(|error| PyKeyError::new_err(error.to_string()))?;
        let mesh = &self.core.description().shapes[shape].mesh;
        let positions: Vec<f64> = mesh.positions().iter().flat_map(DVec3::to_array).collect();
        let triangles = mesh.triangles().concat();
        let (rows, faces) = (mesh.positions().len(), mesh.triangles().len());
        let triangles = triangles.into_pyarray(py).reshape([faces, 3])?;
        Ok((to_array(py, positions).reshape([rows, 3])?, triangles))
    }

    /// The same scene through another camera, on a film of another size.
    #[pyo3(signature = (camera = None, size = None))]
    fn seen(&self, camera: Option<&Camera>, size: Option<(usize, usize)>) -> PyResult<Self> {
        let d = self.core.description();
        let camera = camera.map_or_else(|| d.camera.clone(), |camera| camera.core.clone());
        let film = size.map_or(d.film, |(width, height)| Film { width, height, crop: None, ..d.film });
        let core = self.core.seen_by(camera, film).map_err(errors::scene)?;
        Ok(Self { core: Arc::new(core) })
    }

    /// The image, its standard error, and non-finite samples.
    #[pyo3(signature = (spp, seed, report = None))]
    fn render<'py>(
        &self,
        py: Python<'py>,
        spp: usize,
        seed: u64,
        report: Option<Py<PyAny>>,
    ) -> PyResult<Rendered<'py>> {
        let render = |progress: &_| gradient::render(&self.core, spp, seed, progress);
        let rendering = run(py, report.as_ref(), render)?.map_err(errors::gradient)?;
        let Rendering { image, standard_error, non_finite, .. } = rendering;
        let non_finite = non_finite.iter().map(|s| (s.column, s.row, s.sample)).collect();
        Ok((image_to_array(py, &image)?, image_to_array(py, &standard_error)?, non_finite))
    }
}

/// A scene, notes on interpretations, and the files that were read.
type Read = (Scene, Vec<String>, Vec<(PathBuf, Vec<u8>)>);

/// Reads a description and builds its scene.
fn read(
    bytes: Vec<u8>,
    path: PathBuf,
    options: &ReadOptions,
    open: &dyn Fn(&Path) -> std::io::Result<Vec<u8>>,
) -> Result<Read, String> {
    let files = RefCell::new(BTreeMap::new());
    let kept = |path: &Path| {
        let bytes = open(path)?;
        files.borrow_mut().insert(path.to_path_buf(), bytes.clone());
        Ok(bytes)
    };
    let read = io::read_scene_with(&bytes, &path, options, &kept);
    let (description, notes) = read.map_err(|error| error.to_string())?;
    let core = Core::new(description).map_err(|error| format!("{}: {error}", path.display()))?;
    let notes = notes.iter().map(Note::to_string).collect();
    let files = std::iter::once((path, bytes)).chain(files.into_inner()).collect();
    Ok((Scene { core: Arc::new(core) }, notes, files))
}
