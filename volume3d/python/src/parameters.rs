//! Parameters of a scene as one vector.

use std::sync::Arc;

use numpy::PyArray1;
use pyo3::prelude::*;
use volume3d::optimize::Parameters as Core;

use crate::arrays::{Array, numbers, to_array};
use crate::errors;
use crate::run::run;
use crate::scene::Scene;

/// Selected parameters of a scene, which never change.
#[pyclass(frozen, module = "volume3d._core")]
pub(crate) struct Parameters {
    pub(crate) core: Core,
}

/// Name, shape, bounds, and whether it is a rotation vector.
type Group = (String, Vec<usize>, [f64; 2], bool);

#[pymethods]
impl Parameters {
    #[new]
    fn new(scene: &Scene, names: Vec<String>) -> PyResult<Self> {
        Ok(Self { core: Core::new(&scene.core, &names).map_err(errors::parameter)? })
    }

    /// The groups in order. Their numbers follow one another in the vector.
    fn groups(&self, scene: &Scene) -> Vec<Group> {
        let of = |group: &volume3d::optimize::Group| {
            let shape = group.first().dimensions(&scene.core);
            (group.name.clone(), shape, group.bounds, group.turns())
        };
        self.core.groups().iter().map(of).collect()
    }

    /// The values in a scene.
    fn values<'py>(&self, py: Python<'py>, scene: &Scene) -> Bound<'py, PyArray1<f64>> {
        to_array(py, self.core.values(&scene.core))
    }

    /// The scene with other values.
    fn apply(&self, py: Python<'_>, scene: &Scene, x: Array<'_>) -> PyResult<Scene> {
        let x = numbers(&x)?;
        let core = run(py, None, |_| {
            let mut core = (*scene.core).clone();
            self.core.apply(x, &mut core).map(|()| core)
        })?;
        Ok(Scene { core: Arc::new(core.map_err(errors::parameter)?) })
    }

    /// The values moved along a step: rotations are composed, bounds are kept.
    fn retract<'py>(
        &self,
        py: Python<'py>,
        x: Array<'py>,
        step: Array<'py>,
    ) -> PyResult<Bound<'py, PyArray1<f64>>> {
        let mut moved = numbers(&x)?.to_vec();
        self.core.retract(&mut moved, numbers(&step)?);
        Ok(to_array(py, moved))
    }
}
