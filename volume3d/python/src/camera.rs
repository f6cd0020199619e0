//! Cameras.

use std::path::PathBuf;

use glam::DVec2;
use pyo3::prelude::*;
use volume3d::io::views::LookAt;
use volume3d::scene::{Calibration, Camera as Core, Lens};

use crate::arrays::triple;
use crate::errors;

/// A camera that never changes.
#[pyclass(frozen, module = "volume3d._core")]
pub(crate) struct Camera {
    pub(crate) core: Core,
}

/// Origin, right, up, forward and horizontal field of view in radians.
type Frame = ([f64; 3], [f64; 3], [f64; 3], [f64; 3], f64);

/// Rows of the rotation, centre, focal lengths and principal point.
type Matrices = ([[f64; 3]; 3], [f64; 3], [f64; 2], [f64; 2]);

/// Everything of a camera: frame, principal point and pixel aspect, lens, and distance of an orthographic
/// sensor.
type Whole = (Frame, [f64; 2], f64, Option<[f64; 2]>, Option<f64>);

#[pymethods]
impl Camera {
    /// A camera from everything that a pickle holds.
    #[new]
    fn new(
        frame: Frame,
        principal_point: [f64; 2],
        pixel_aspect: f64,
        lens: Option<[f64; 2]>,
        orthographic: Option<f64>,
    ) -> Self {
        let (origin, right, up, forward, field_of_view) = frame;
        let core = Core {
            origin: origin.into(),
            right: right.into(),
            up: up.into(),
            forward: forward.into(),
            field_of_view,
            principal_point: principal_point.into(),
            pixel_aspect,
            lens: lens.map(|[radius, focus_distance]| Lens { radius, focus_distance }),
            orthographic,
        };
        Self { core }
    }

    fn __getnewargs__(&self) -> Whole {
        let Core { principal_point, pixel_aspect, lens, orthographic, .. } = self.core;
        let lens = lens.map(|lens| [lens.radius, lens.focus_distance]);
        (self.frame(), principal_point.to_array(), pixel_aspect, lens, orthographic)
    }

    fn __repr__(&self) -> String {
        format!("{:?}", self.core)
    }

    /// A camera at `origin` that looks at `target`, with a horizontal field of view in degrees.
    #[staticmethod]
    fn look_at(origin: [f64; 3], target: [f64; 3], up: [f64; 3], degrees: f64) -> PyResult<Self> {
        let (origin, target, up) = (origin.into(), target.into(), up.into());
        let look_at =
            LookAt { picture: PathBuf::new(), origin, target, up, field_of_view: degrees.to_radians() };
        look_at.camera().map(|core| Self { core }).map_err(errors::scene)
    }

    /// Origin, right, up, forward and horizontal field of view in radians.
    #[getter]
    fn frame(&self) -> Frame {
        let Core { origin, right, up, forward, field_of_view, .. } = self.core;
        (triple(origin), triple(right), triple(up), triple(forward), field_of_view)
    }

    /// R, c, (f_x, f_y) and (c_x, c_y) on a film of these columns and rows.
    fn calibration(&self, size: (usize, usize)) -> PyResult<Matrices> {
        let found = self.core.calibration(DVec2::new(size.0 as f64, size.1 as f64));
        let Some(Calibration { rotation, center, focal, principal, .. }) = found else {
            return Err(errors::scene(
                "a thin lens and an orthographic sensor have no matrix: only pinholes have",
            ));
        };
        let rows = rotation.transpose().to_cols_array_2d();
        Ok((rows, triple(center), focal.to_array(), principal.to_array()))
    }
}
