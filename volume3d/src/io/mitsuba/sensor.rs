//! Sensors.

use glam::{DAffine3, DVec2, DVec3};

use super::clip::Clips;
use super::element::Element;
use super::film::{DEFAULT_SIZE, film, film_of_size};
use super::integrator::NO_MEDIA;
use super::object::{Ids, Object};
use super::{orthographic, support, transform};
use crate::io::Error;
use crate::scene::{Camera, Film, Lens};

/// The horizontal field of view of the default sensor, in degrees.
const DEFAULT_ANGLE: f64 = 45.0;
/// Mitsuba's default number of samples per pixel.
const DEFAULT_SAMPLES: i64 = 4;
/// Mitsuba's default focal length in millimetres, if no angle is given either.
const DEFAULT_FOCAL_LENGTH: f64 = 50.0;
/// Width and height of 35 mm film in millimetres, to whose diagonal focal lengths refer.
const FILM_35MM: (f64, f64) = (36.0, 24.0);
/// Mitsuba's default far clipping plane.
const DEFAULT_FAR_CLIP: f64 = 1e4;
/// Contents of a sensor element.
pub(super) struct Sensor<'a> {
    pub(super) camera: Camera,
    pub(super) clips: Clips<'a>,
    pub(super) film: Film,
    /// Samples per pixel.
    pub(super) samples: usize,
    /// The medium around the sensor, if any.
    pub(super) medium: Option<&'a Element>,
}

/// Reads a sensor, optionally with another film size.
pub(super) fn sensor<'a>(
    object: &Object<'a>,
    ids: &Ids<'a>,
    size: Option<(usize, usize)>,
    sees_media: bool,
) -> Result<Sensor<'a>, Error> {
    let film = match object.at_most_one("<film>")? {
        Some(element) => film(&Object::new(element, ids)?, ids, size)?,
        None => film_of_size(size.unwrap_or(DEFAULT_SIZE)),
    };
    let samples = match object.at_most_one("<sampler>")? {
        Some(element) => sampler(&Object::new(element, ids)?)?,
        None => DEFAULT_SAMPLES as usize,
    };
    let (camera, clips) = if object.plugin == "orthographic" {
        orthographic::camera(object)?
    } else {
        let radius = aperture_radius(object)?;
        camera(object, radius, film.width as f64 / film.height as f64)?
    };
    let medium = if sees_media {
        object.at_most_one("<medium>")?
    } else {
        object.ignore("medium", None, NO_MEDIA);
        None
    };
    if let Some(element) = medium.filter(|_| object.plugin == "orthographic") {
        // The approximating camera is far away, and its paths would be as long in the medium.
        return Err(element.unsupported("an orthographic sensor within a medium", "a perspective sensor"));
    }
    object.finish()?;
    Ok(Sensor { camera, clips, film, samples, medium })
}

/// Mitsuba 2's default sensor: it looks along z, with the whole scene in view. `None` if the scene is empty.
pub(super) fn default_sensor<'a>(
    corners: impl Iterator<Item = DVec3>,
    size: Option<(usize, usize)>,
) -> Option<Sensor<'a>> {
    let (low, high) = corners.map(|x| (x, x)).reduce(|a, b| (a.0.min(b.0), a.1.max(b.1)))?;
    let center = 0.5 * (low + high);
    let field_of_view = DEFAULT_ANGLE.to_radians();
    let distance = 0.5 * (high - low).max_element() / (0.5 * field_of_view).tan();
    let camera = Camera {
        origin: DVec3::new(center.x, center.y, low.z - distance),
        right: DVec3::NEG_X,
        up: DVec3::Y,
        forward: DVec3::Z,
        field_of_view,
        principal_point: DVec2::ZERO,
        pixel_aspect: 1.0,
        lens: None,
        orthographic: None,
    };
    let film = film_of_size(size.unwrap_or(DEFAULT_SIZE));
    Some(Sensor { camera, clips: Clips::default(), film, samples: DEFAULT_SAMPLES as usize, medium: None })
}

/// The radius of the lens; 0 for a pinhole.
fn aperture_radius(object: &Object<'_>) -> Result<f64, Error> {
    match object.plugin {
        "perspective" => Ok(0.0),
        "thinlens" => object
            .float_where("aperture_radius", "a number of at least 0", |r| r >= 0.0)?
            .ok_or_else(|| object.missing("aperture_radius")),
        _ if object.journal.is_lenient => {
            object.note(format!("sensor \"{}\" is read as perspective", object.plugin));
            Ok(0.0)
        }
        _ => Err(object.unknown_plugin("sensor", support::SENSORS)),
    }
}

fn camera<'a>(object: &Object<'a>, radius: f64, aspect: f64) -> Result<(Camera, Clips<'a>), Error> {
    let pixel_aspect = object.positive("pixel_aspect")?.unwrap_or(1.0);
    // A vertical angle refers to f_y.
    let field_of_view = field_of_view(object, aspect * pixel_aspect)?;
    let clips = Clips::read(object)?;
    let offset = |name| object.float(name).map(|offset| offset.unwrap_or(0.0));
    // Mitsuba's offset is the position of the principal point of a centred camera in this picture.
    let principal_point =
        -DVec2::new(offset("principal_point_offset_x")?, offset("principal_point_offset_y")?);
    // Mitsuba's default focus distance is the far clipping plane.
    let focus_distance = object.positive("focus_distance")?.or(clips.far()).unwrap_or(DEFAULT_FAR_CLIP);
    // A pinhole camera has no focus.
    let lens = (radius > 0.0).then_some(Lens { radius, focus_distance });
    object.boolean_that_is("jitter", true)?;
    // Nothing moves while the shutter is open.
    object.float("shutter_open")?;
    object.float("shutter_close")?;
    let (frame, origin) = match object.affine("to_world")? {
        Some((element, map)) => (transform::orthogonal(element, &map)?, map.translation),
        None => (DAffine3::IDENTITY.matrix3, DVec3::ZERO),
    };
    // Mitsuba's x axis points to the left of the image.
    let (right, up, forward) = (-frame.x_axis, frame.y_axis, frame.z_axis);
    let orthographic = None;
    let camera = Camera {
        origin,
        right,
        up,
        forward,
        field_of_view,
        principal_point,
        pixel_aspect,
        lens,
        orthographic,
    };
    Ok((camera, clips))
}

/// The horizontal field of view in radians, with `aspect` the film's width by its height.
pub(super) fn field_of_view(object: &Object<'_>, aspect: f64) -> Result<f64, Error> {
    let axes = ["x", "y", "diagonal", "smaller", "larger"];
    let axis = object.choice("fov_axis", &axes, "x, y, diagonal, smaller or larger")?;
    let is_angle = |degrees| degrees > 0.0 && degrees < 180.0;
    let fov = object.float_where("fov", "degrees between 0 and 180", is_angle)?;
    let focal_length = focal_length(object)?;
    let (half, axis) = match (fov, focal_length) {
        (Some(_), Some(_)) => return Err(object.conflict("fov", "focal_length")),
        (Some(fov), None) => (0.5 * fov.to_radians(), axes[axis.unwrap_or(0)]),
        (None, length) => {
            let diagonal = FILM_35MM.0.hypot(FILM_35MM.1);
            ((0.5 * diagonal / length.unwrap_or(DEFAULT_FOCAL_LENGTH)).atan(), "diagonal")
        }
    };
    let is_x = match axis {
        "x" => true,
        "smaller" => aspect <= 1.0,
        "larger" => aspect > 1.0,
        _ => false,
    };
    // Half the film's width at distance 1.
    let tangent = match axis {
        _ if is_x => half.tan(),
        "diagonal" => half.tan() * aspect / aspect.hypot(1.0),
        _ => half.tan() * aspect,
    };
    Ok(2.0 * tangent.atan())
}

/// Millimetres, with or without "mm".
fn focal_length(object: &Object<'_>) -> Result<Option<f64>, Error> {
    let Some(value) = object.string("focal_length")? else { return Ok(None) };
    let number = value.trim().trim_end_matches("mm").trim_end().parse().ok();
    let length = number.filter(|x: &f64| x.is_finite() && *x > 0.0);
    length
        .map(Some)
        .ok_or_else(|| object.element.bad_value("focal_length", value, "a number greater than 0 and \"mm\""))
}

/// Samples per pixel. The kind of sampler affects noise only.
fn sampler(object: &Object<'_>) -> Result<usize, Error> {
    if !support::SAMPLERS.split(", ").any(|name| name == object.plugin) {
        object.note(format!(
            "how sampler \"{}\" draws changes noise only: only sample_count is read",
            object.plugin
        ));
    }
    let count =
        object.integer_in("sample_count", 1..=i64::from(u32::MAX), "a whole number from 1 to 2^32 − 1")?;
    object.finish()?;
    Ok(count.unwrap_or(DEFAULT_SAMPLES) as usize)
}
