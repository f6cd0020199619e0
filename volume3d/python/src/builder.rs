//! Scenes from arrays.

use std::sync::{Arc, Mutex, PoisonError};

use glam::{DAffine2, DVec2, DVec3};
use numpy::{PyReadonlyArray2, PyUntypedArrayMethods};
use pyo3::exceptions::PyValueError;
use pyo3::prelude::*;
use volume3d::Image;
use volume3d::geometry::{Attribute, Mesh};
use volume3d::scene::{
    Bsdf, Description, Environment, Film, Filter, Integrator, Material, Microfacets, Reflectance,
    Scene as Core, Texture, Wrap,
};

use crate::arrays::{Array, array_to_image, numbers, vectors};
use crate::camera::Camera;
use crate::errors;
use crate::run::run;
use crate::scene::Scene;

/// A scene that is being described.
#[pyclass(frozen, module = "volume3d._core")]
pub(crate) struct Builder {
    description: Mutex<Description>,
}

impl Builder {
    fn edit<T>(&self, edit: impl FnOnce(&mut Description) -> PyResult<T>) -> PyResult<T> {
        edit(&mut self.description.lock().unwrap_or_else(PoisonError::into_inner))
    }
}

#[pymethods]
impl Builder {
    #[new]
    fn new(camera: &Camera, size: (usize, usize), max_depth: Option<usize>) -> Self {
        let (width, height) = size;
        let filter = Filter::Tent { radius: 1.0 };
        let film = Film { width, height, crop: None, sample_border: true, filter };
        let mut description = Description::new(camera.core.clone(), film);
        description.integrator = Integrator { max_depth, ..Integrator::default() };
        Self { description: Mutex::new(description) }
    }

    /// Adds a texture, linear RGB (height, width, 3), and returns its index.
    fn texture(&self, name: &str, texels: Array<'_>) -> PyResult<usize> {
        let image = array_to_image(&texels, "a texture")?;
        let (id, wrap, to_uv) = (name.to_owned(), Wrap::Repeat, DAffine2::IDENTITY);
        let Image { width, height, pixels: texels } = image;
        let texture = Texture { id, width, height, texels, wrap, to_uv };
        self.edit(|d| Ok(d.add_texture(texture)))
    }

    /// Adds a diffuse material whose reflectance is a colour or a texture.
    fn diffuse(&self, name: &str, colour: [f64; 3], texture: Option<usize>) -> PyResult<usize> {
        let reflectance = texture.map_or(Reflectance::Constant(colour.into()), Reflectance::Texture);
        self.edit(|d| Ok(d.add_material(Material::new(name, Bsdf::Diffuse { reflectance }, true))))
    }

    /// Adds a rough metal that reflects a colour at normal incidence.
    fn metal(&self, name: &str, colour: [f64; 3], alpha: f64) -> PyResult<usize> {
        let specular_reflectance = Reflectance::Constant(colour.into());
        let bsdf = Bsdf::RoughConductor {
            distribution: Microfacets::Ggx,
            alpha,
            stretch: 1.0,
            eta: DVec3::ZERO,
            k: DVec3::ONE,
            specular_reflectance,
        };
        self.edit(|d| Ok(d.add_material(Material::new(name, bsdf, true))))
    }

    /// Adds a mesh.
    #[expect(clippy::too_many_arguments, reason = "called by one Python function, which names them")]
    fn mesh(
        &self,
        name: &str,
        positions: Array<'_>,
        triangles: PyReadonlyArray2<'_, u32>,
        smooth: bool,
        uvs: Option<Array<'_>>,
        material: Option<usize>,
        radiance: Option<[f64; 3]>,
    ) -> PyResult<()> {
        let &[_, 3] = positions.shape() else {
            let text =
                format!("the positions of `{name}` must have the shape (n, 3), not {:?}", positions.shape());
            return Err(PyValueError::new_err(text));
        };
        let &[_, 3] = triangles.shape() else {
            let text =
                format!("the triangles of `{name}` must have the shape (m, 3), not {:?}", triangles.shape());
            return Err(PyValueError::new_err(text));
        };
        let corners = triangles.as_slice().map_err(|error| PyValueError::new_err(error.to_string()))?;
        let triangles: Vec<[u32; 3]> = corners.chunks_exact(3).map(|t| [t[0], t[1], t[2]]).collect();
        let of_mesh = |error: volume3d::geometry::MeshError| errors::scene(format!("mesh `{name}`: {error}"));
        let mut mesh = Mesh::new(vectors(&positions)?, triangles.clone()).map_err(of_mesh)?;
        if smooth {
            mesh = mesh.smooth();
        }
        if let Some(uvs) = uvs {
            let &[_, 2] = uvs.shape() else {
                let text = format!("the uvs of `{name}` must have the shape (n, 2), not {:?}", uvs.shape());
                return Err(PyValueError::new_err(text));
            };
            let values = numbers(&uvs)?.chunks_exact(2).map(DVec2::from_slice).collect();
            mesh = mesh.with_uvs(Attribute { values, triangles }).map_err(of_mesh)?;
        }
        self.edit(|d| {
            match (material, radiance) {
                (None, Some(radiance)) => d.add_emitter(name, mesh, radiance.into()),
                (None, None) => {
                    let grey =
                        d.add_material(Material::diffuse(&format!("{name}-material"), DVec3::splat(0.5)));
                    d.add_shape(name, mesh, grey)
                }
                (Some(material), radiance) => {
                    let index = d.add_shape(name, mesh, material);
                    d.shapes[index].radiance = radiance.map(DVec3::from);
                    index
                }
            };
            Ok(())
        })
    }

    /// Adds a constant environment.
    fn sky(&self, radiance: [f64; 3]) -> PyResult<()> {
        self.edit(|d| {
            d.environment = Some(Environment::Constant { id: "sky".to_owned(), radiance: radiance.into() });
            Ok(())
        })
    }

    /// The scene.
    fn build(&self, py: Python<'_>) -> PyResult<Scene> {
        let description = self.edit(|d| Ok(d.clone()))?;
        let core = run(py, None, |_| Core::new(description))?.map_err(errors::scene)?;
        Ok(Scene { core: Arc::new(core) })
    }
}
