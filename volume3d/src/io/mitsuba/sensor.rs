//! Cameras, films and integrators.

use glam::{DAffine3, DVec2, DVec3};

use super::clip::Clips;
use super::object::{Ids, Object};
use super::transform;
use crate::io::{Error, SceneProblem};
use crate::scene::{Camera, Crop, Film, Filter, Integrator};

/// The largest number of columns and of rows, so that their product is a sound size.
const MAX_SIDE: i64 = 1 << 16;
/// Mitsuba's film, where no size is given.
const DEFAULT_SIZE: (i64, i64) = (768, 576);
/// Mitsuba's samples per pixel, where none are given.
const DEFAULT_SAMPLES: i64 = 4;
/// Mitsuba's focal length in millimetres, where neither it nor an angle is given.
const DEFAULT_FOCAL_LENGTH: f64 = 50.0;
/// Width and height of 35 mm film in millimetres, to whose diagonal focal lengths refer.
const FILM_35MM: (f64, f64) = (36.0, 24.0);
/// `max_depth` of Mitsuba's differentiating integrators, where none is given.
const DEFAULT_PRB_DEPTH: usize = 6;

/// What a sensor says.
pub(super) struct Sensor<'a> {
    pub(super) camera: Camera,
    pub(super) clips: Clips<'a>,
    pub(super) film: Film,
    /// Samples per pixel.
    pub(super) samples: usize,
}

pub(super) fn sensor<'a>(object: &Object<'a>, ids: &Ids<'a>) -> Result<Sensor<'a>, Error> {
    if object.plugin != "perspective" {
        return Err(object.unknown_plugin("sensor", "perspective"));
    }
    let film = match object.at_most_one("<film>")? {
        Some(element) => film(&Object::new(element, ids)?, ids)?,
        None => film_of_size(DEFAULT_SIZE),
    };
    let samples = match object.at_most_one("<sampler>")? {
        Some(element) => sampler(&Object::new(element, ids)?)?,
        None => DEFAULT_SAMPLES as usize,
    };
    let (camera, clips) = camera(object, film.width as f64 / film.height as f64)?;
    object.finish()?;
    Ok(Sensor { camera, clips, film, samples })
}

fn camera<'a>(object: &Object<'a>, aspect: f64) -> Result<(Camera, Clips<'a>), Error> {
    let pixel_aspect = object.positive("pixel_aspect")?.unwrap_or(1.0);
    // An angle along columns is f_y's.
    let field_of_view = field_of_view(object, aspect * pixel_aspect)?;
    let clips = Clips::read(object)?;
    let offset = |name| object.float(name).map(|offset| offset.unwrap_or(0.0));
    // Mitsuba says where in the picture of a centred camera the middle of this one is.
    let principal_point =
        -DVec2::new(offset("principal_point_offset_x")?, offset("principal_point_offset_y")?);
    // All is sharp without a lens.
    object.positive("focus_distance")?;
    // Nothing moves while the shutter is open.
    object.float("shutter_open")?;
    object.float("shutter_close")?;
    let (frame, origin) = match object.affine("to_world")? {
        Some((element, map)) => (transform::rotation(element, &map)?, map.translation),
        None => (DAffine3::IDENTITY.matrix3, DVec3::ZERO),
    };
    // Mitsuba's x axis points to the left of the image.
    let (right, up, forward) = (-frame.x_axis, frame.y_axis, frame.z_axis);
    Ok((Camera { origin, right, up, forward, field_of_view, principal_point, pixel_aspect }, clips))
}

/// The horizontal field of view in radians, with `aspect` the film's width by its height.
fn field_of_view(object: &Object<'_>, aspect: f64) -> Result<f64, Error> {
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

fn film_of_size((width, height): (i64, i64)) -> Film {
    let filter = Filter::Gaussian { deviation: 0.5 };
    Film { width: width as usize, height: height as usize, crop: None, filter }
}

fn film<'a>(object: &Object<'a>, ids: &Ids<'a>) -> Result<Film, Error> {
    if object.plugin != "hdrfilm" {
        return Err(object.unknown_plugin("film", "hdrfilm"));
    }
    let side = |name, default| {
        let value = object.integer_in(name, 1..=MAX_SIDE, "a whole number from 1 to 65536")?;
        Ok::<_, Error>(value.unwrap_or(default))
    };
    let (width, height) = (side("width", DEFAULT_SIZE.0)?, side("height", DEFAULT_SIZE.1)?);
    let mut film = film_of_size((width, height));
    film.crop = crop(object, width, height)?;
    object.choice("pixel_format", &["rgb", "rgba"], "rgb or rgba, of which the colours are rendered")?;
    // What a file of the image would be like, and what to do beyond the border: see the module's documentation.
    object.choice("file_format", &["openexr", "exr"], "openexr")?;
    object.choice("component_format", &["float16", "float32"], "float16 or float32")?;
    for name in ["sample_border", "compensate", "banner", "high_quality_edges"] {
        object.boolean(name)?;
    }
    if let Some(element) = object.at_most_one("<rfilter>")? {
        film.filter = filter(&Object::new(element, ids)?)?;
    }
    object.finish()?;
    Ok(film)
}

fn crop(object: &Object<'_>, width: i64, height: i64) -> Result<Option<Crop>, Error> {
    let offset = |name, side| {
        let value = object.integer_in(name, 0..=side - 1, "a whole number within the film")?;
        Ok::<_, Error>(value)
    };
    let (x, y) = (offset("crop_offset_x", width)?, offset("crop_offset_y", height)?);
    let (left, top) = (x.unwrap_or(0), y.unwrap_or(0));
    let side = |name, rest| object.integer_in(name, 1..=rest, "a whole number that ends within the film");
    let (w, h) = (side("crop_width", width - left)?, side("crop_height", height - top)?);
    if [x, y, w, h].iter().all(Option::is_none) {
        return Ok(None);
    }
    Ok(Some(Crop {
        x: left as usize,
        y: top as usize,
        width: w.unwrap_or(width - left) as usize,
        height: h.unwrap_or(height - top) as usize,
    }))
}

fn filter(object: &Object<'_>) -> Result<Filter, Error> {
    let filter = match object.plugin {
        "box" => {
            object.float_where("radius", "0.5, the only box that is supported", |r| r == 0.5)?;
            Filter::Box
        }
        "tent" => Filter::Tent { radius: object.positive("radius")?.unwrap_or(1.0) },
        "gaussian" => Filter::Gaussian { deviation: object.positive("stddev")?.unwrap_or(0.5) },
        _ => return Err(object.unknown_plugin("rfilter", "box, tent, gaussian")),
    };
    object.finish()?;
    Ok(filter)
}

/// Samples per pixel. How they are drawn changes noise only.
fn sampler(object: &Object<'_>) -> Result<usize, Error> {
    let supported = "independent, stratified, multijitter, orthogonal, ldsampler";
    if !supported.split(", ").any(|name| name == object.plugin) {
        return Err(object.unknown_plugin("sampler", supported));
    }
    let count =
        object.integer_in("sample_count", 1..=i64::from(u32::MAX), "a whole number from 1 to 2^32 − 1")?;
    object.integer_in("seed", 0..=i64::MAX, "a whole number of at least 0")?;
    object.boolean("jitter")?;
    object.integer_in("strength", 0..=i64::MAX, "a whole number of at least 0")?;
    object.finish()?;
    Ok(count.unwrap_or(DEFAULT_SAMPLES) as usize)
}

pub(super) fn integrator(object: &Object<'_>) -> Result<Integrator, Error> {
    let integrator = match object.plugin {
        "path" => depths(object, None)?,
        "prb" | "prb_basic" | "prb_reparam" | "prb_projective" => {
            let integrator = depths(object, Some(DEFAULT_PRB_DEPTH))?;
            derivatives(object)?;
            integrator
        }
        "direct" | "direct_reparam" | "direct_projective" => {
            derivatives(object)?;
            let expected = "a whole number of at least 1, as all strategies are used";
            for name in ["emitter_samples", "bsdf_samples", "shading_samples"] {
                object.integer_in(name, 1..=i64::from(u32::MAX), expected)?;
            }
            Integrator { max_depth: Some(2), ..Integrator::default() }
        }
        _ => {
            let supported = "path, direct, prb, prb_basic, prb_reparam, prb_projective, direct_reparam, \
                             direct_projective";
            return Err(object.unknown_plugin("integrator", supported));
        }
    };
    if object.boolean("hide_emitters")? == Some(true) {
        let problem = SceneProblem::Unsupported {
            what: "hide_emitters".to_owned(),
            instead: "leave it out, and subtract what emits",
        };
        return Err(object.element.error(problem));
    }
    object.finish()?;
    Ok(integrator)
}

/// How Mitsuba would compute derivatives: these are computed another way, and the image does not depend on it.
fn derivatives(object: &Object<'_>) -> Result<(), Error> {
    let (integers, floats, booleans, words): (&[_], &[_], &[_], &[_]) = match object.plugin {
        "prb_reparam" | "direct_reparam" => (
            &["reparam_max_depth", "reparam_rays"],
            &["reparam_kappa", "reparam_exp"],
            &["reparam_antithetic", "reparam_unroll"],
            &[],
        ),
        "prb_projective" | "direct_projective" => {
            (&["sppc", "sppp", "sppi", "guiding_rounds"], &[], &["guiding_proj"], &["guiding", "proj_seed"])
        }
        _ => (&[], &[], &[], &[]),
    };
    for name in integers {
        object.integer_in(name, -1..=i64::from(u32::MAX), "a whole number")?;
    }
    floats.iter().try_for_each(|name| object.float(name).map(|_| ()))?;
    words.iter().try_for_each(|name| object.string(name).map(|_| ()))?;
    booleans.iter().try_for_each(|name| object.boolean(name).map(|_| ()))
}

fn depths(object: &Object<'_>, default: Option<usize>) -> Result<Integrator, Error> {
    let limit = i64::from(u32::MAX);
    let depth = object.integer_in("max_depth", -1..=limit, "−1 or a whole number of at least 1")?;
    let max_depth = match depth {
        None => default,
        Some(-1) => None,
        Some(0) => {
            let expected = "−1 or a whole number of at least 1 (0 is a black image)";
            return Err(object.element.bad_value("max_depth", "0", expected));
        }
        Some(depth) => Some(depth as usize),
    };
    let rr_depth = object.integer_in("rr_depth", 1..=limit, "a whole number of at least 1")?;
    let rr_depth = rr_depth.map_or(Integrator::default().rr_depth, |depth| depth as usize);
    Ok(Integrator { max_depth, rr_depth })
}
