//! Scenes.

use std::path::{Path, PathBuf};
use std::sync::Arc;

use glam::DVec3;
use numpy::{IntoPyArray, PyArray2, PyArray3, PyArrayMethods};
use pyo3::exceptions::PyKeyError;
use pyo3::prelude::*;
use volume3d::gradient::{self, Rendering};
use volume3d::io::{self, Note, ReadOptions};
use volume3d::optimize::Parameters;
use volume3d::scene::{Camera, Film, Scene as Core};

use crate::arrays::{image_to_array, to_array, triple};
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

/// Origin, right, up, forward and horizontal field of view in radians.
type CameraFrame = ([f64; 3], [f64; 3], [f64; 3], [f64; 3], f64);

/// Positions (n, 3) and triangles (m, 3) of a mesh.
type MeshArrays<'py> = (Bound<'py, PyArray2<f64>>, Bound<'py, PyArray2<u32>>);

#[pymethods]
impl Scene {
    /// Reads a scene file. Returns the scene and notes on interpretations.
    #[staticmethod]
    #[pyo3(signature = (path, variables, size = None, lenient = false))]
    fn load_file(
        py: Python<'_>,
        path: PathBuf,
        variables: Vec<(String, String)>,
        size: Option<(usize, usize)>,
        lenient: bool,
    ) -> PyResult<(Self, Vec<String>)> {
        run(py, None, |_| {
            let bytes = io::read_bytes(&path).map_err(|error| format!("{}: {error}", path.display()))?;
            read(&bytes, &path, variables, size, lenient)
        })?
        .map_err(errors::scene)
    }

    /// Reads a scene from text. Files that it names are searched in `folder`.
    #[staticmethod]
    #[pyo3(signature = (text, folder, variables, size = None, lenient = false))]
    fn load_string(
        py: Python<'_>,
        text: String,
        folder: PathBuf,
        variables: Vec<(String, String)>,
        size: Option<(usize, usize)>,
        lenient: bool,
    ) -> PyResult<(Self, Vec<String>)> {
        let path = folder.join("<string>");
        run(py, None, |_| read(text.as_bytes(), &path, variables, size, lenient))?.map_err(errors::scene)
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

    /// Origin, right, up, forward and horizontal field of view in radians.
    #[getter]
    fn camera(&self) -> CameraFrame {
        let camera = &self.core.description().camera;
        let Camera { origin, right, up, forward, field_of_view, .. } = *camera;
        (triple(origin), triple(right), triple(up), triple(forward), field_of_view)
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

    /// The same scene through a camera at `origin` that looks at `target`, with a horizontal field of view in
    /// degrees, on a film of another size.
    #[pyo3(signature = (look_at = None, size = None))]
    fn seen(&self, look_at: Option<LookAt>, size: Option<(usize, usize)>) -> PyResult<Self> {
        let d = self.core.description();
        let camera = look_at.map_or_else(|| d.camera.clone(), LookAt::camera);
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

/// A camera by origin, target, up and horizontal field of view in degrees.
#[derive(Clone, Copy, FromPyObject)]
pub(crate) struct LookAt([f64; 3], [f64; 3], [f64; 3], f64);

impl LookAt {
    pub(crate) fn camera(self) -> Camera {
        let Self(origin, target, up, degrees) = self;
        Camera::look_at(origin.into(), target.into(), up.into(), degrees.to_radians())
    }
}

/// Reads a description and builds its scene.
fn read(
    bytes: &[u8],
    path: &Path,
    variables: Vec<(String, String)>,
    size: Option<(usize, usize)>,
    is_lenient: bool,
) -> Result<(Scene, Vec<String>), String> {
    let options = ReadOptions { variables, size, is_lenient };
    let read = io::read_scene_with(bytes, path, &options, &|path| io::read_bytes(path));
    let (description, notes) = read.map_err(|error| error.to_string())?;
    let core = Core::new(description).map_err(|error| format!("{}: {error}", path.display()))?;
    let notes = notes.iter().map(Note::to_string).collect();
    Ok((Scene { core: Arc::new(core) }, notes))
}
