//! `volume3d._core`: the library as a Python module, without conveniences.
//!
//! The package `volume3d` in `python/volume3d` is what users import: it converts arguments, names results and
//! holds the documentation. Here arrays are contiguous and of type `float64`, parameters are flat vectors,
//! and scenes never change: every update makes a new one, which shares all unchanged tables.

mod arrays;
mod builder;
mod camera;
mod errors;
mod estimate;
mod fit;
mod image;
mod parameters;
mod run;
mod scene;
mod study;
mod views;

use pyo3::prelude::*;

#[pymodule]
fn _core(module: &Bound<'_, PyModule>) -> PyResult<()> {
    module.add("__version__", env!("CARGO_PKG_VERSION"))?;
    errors::add_to(module)?;
    module.add_class::<scene::Scene>()?;
    module.add_class::<camera::Camera>()?;
    module.add_class::<views::Views>()?;
    module.add_class::<builder::Builder>()?;
    module.add_class::<parameters::Parameters>()?;
    module.add_class::<fit::Fit>()?;
    module.add_class::<fit::Worker>()?;
    module.add_class::<study::Tuning>()?;
    module.add("METHODS", volume3d::gradient::Estimator::METHODS)?;
    module.add_function(wrap_pyfunction!(estimate::forward, module)?)?;
    module.add_function(wrap_pyfunction!(estimate::reverse, module)?)?;
    module.add_function(wrap_pyfunction!(study::check, module)?)?;
    module.add_function(wrap_pyfunction!(study::find_problems, module)?)?;
    module.add_function(wrap_pyfunction!(views::sensors, module)?)?;
    module.add_function(wrap_pyfunction!(image::png, module)?)?;
    module.add_function(wrap_pyfunction!(image::read_image, module)?)?;
    module.add_function(wrap_pyfunction!(image::write_image, module)?)?;
    module.add_function(wrap_pyfunction!(run::set_num_threads, module)?)?;
    module.add_function(wrap_pyfunction!(run::num_threads, module)?)
}
