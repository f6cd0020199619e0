//! All sensors of a scene, as cameras of pictures.

use std::path::Path;
use std::rc::Rc;

use glam::DVec2;

use super::document::Document;
use super::journal::Journal;
use super::object::{Ids, Object};
use super::sensor::{Sensor, sensor};
use super::variables::Variables;
use crate::io::{Error, files};
use crate::scene::{Camera, Crop, Film};

/// A sensor of a scene.
#[derive(Clone, Debug, PartialEq)]
pub struct PosedSensor {
    /// Its id, if it has one.
    pub id: Option<String>,
    /// The camera of a film of this size. The crop of a film is part of it.
    pub camera: Camera,
    /// Columns.
    pub width: usize,
    /// Rows.
    pub height: usize,
}

/// Reads all sensors of a scene, in order. `variables` are values for the `$name`s of the scene. Nothing else
/// is read, and clipping planes and media of sensors are left out.
///
/// # Errors
/// [`Error`], with the line.
pub fn load_sensors(path: &Path, variables: &[(String, String)]) -> Result<Vec<PosedSensor>, Error> {
    parse_sensors(&files::read(path)?, path, variables, &|path| files::read_bytes(path))
}

/// [`load_sensors`] from memory; `open` reads included files.
pub(in crate::io) fn parse_sensors(
    bytes: &[u8],
    path: &Path,
    variables: &[(String, String)],
    open: &dyn Fn(&Path) -> std::io::Result<Vec<u8>>,
) -> Result<Vec<PosedSensor>, Error> {
    let journal = Rc::new(Journal::new(false));
    let document = Document::parse(bytes, path, Variables::new(variables), open, journal.clone())?;
    let ids = Ids::new(document.by_id()?, journal.clone());
    let scene = Object::with_plugin(&document.root, "", &ids)?;
    let mut sensors = vec![];
    for element in scene.nested("<sensor>") {
        // A medium is accepted, and left out.
        match Object::new(element, &ids).and_then(|object| sensor(&object, &ids, None, true)) {
            Ok(sensor) => sensors.push(posed(element.attribute("id"), &sensor)),
            Err(error) => journal.refuse(error),
        }
    }
    journal.close()?;
    Ok(sensors)
}

fn posed(id: Option<&str>, sensor: &Sensor<'_>) -> PosedSensor {
    let Sensor { camera, film, .. } = sensor;
    let whole = Crop { x: 0, y: 0, width: film.width, height: film.height };
    let crop = film.crop.unwrap_or(whole);
    let camera = cropped(camera, film, crop);
    PosedSensor { id: id.map(str::to_owned), camera, width: crop.width, height: crop.height }
}

/// The camera of a film that is a part of another.
fn cropped(camera: &Camera, film: &Film, crop: Crop) -> Camera {
    let whole = DVec2::new(film.width as f64, film.height as f64);
    let part = DVec2::new(crop.width as f64, crop.height as f64);
    if part == whole {
        return camera.clone();
    }
    let corner = DVec2::new(crop.x as f64, crop.y as f64);
    let principal = (camera.principal_point + 0.5) * whole - corner;
    let tangent = (0.5 * camera.field_of_view).tan() * (part.x / whole.x);
    Camera { field_of_view: 2.0 * tangent.atan(), principal_point: principal / part - 0.5, ..camera.clone() }
}
