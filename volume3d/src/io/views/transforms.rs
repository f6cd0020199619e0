//! `transforms.json` of NeRF, instant-ngp and nerfstudio.
//!
//! A frame's `transform_matrix` maps the camera's coordinates to those of the world: its columns are the
//! directions to the right and up in the picture, the direction against the view, and the position.

use std::path::{Path, PathBuf};

use glam::{DMat3, DVec3};
use serde_json::{Map, Value};

use super::frame::{Focal, Frame, IMAGES, Lens, rotation};
use crate::io::error::excerpt;
use crate::io::{At, Error, Place, ViewsProblem};

type Object = Map<String, Value>;

/// Coefficients of distortion, which must be 0.
const COEFFICIENTS: [&str; 8] = ["k1", "k2", "k3", "k4", "k5", "k6", "p1", "p2"];
/// Models that are pinholes if their coefficients are 0.
const MODELS: [&str; 6] = ["PINHOLE", "SIMPLE_PINHOLE", "SIMPLE_RADIAL", "RADIAL", "OPENCV", "FULL_OPENCV"];

const A_NUMBER: &str = "a finite number";
const POSITIVE: &str = "a number greater than 0";
const AN_ANGLE: &str = "radians between 0 and pi";
const WHOLE: &str = "a whole number of pixels from 1 to 2^31";
const A_PATH: &str = "the path of a picture";
const A_MATRIX: &str = "4 rows of 4 finite numbers, the last 0, 0, 0, 1";
const A_ROTATION: &str =
    "a rotation and a position: columns that are orthogonal, right-handed and of one length";

/// The frames of a file.
pub(in crate::io) fn parse(bytes: &[u8], path: &Path) -> Result<Vec<Frame>, Error> {
    let error = |at, problem| Error::Views { place: Place::new(path, at), problem: Box::new(problem) };
    let whole = |problem| error(At::Whole, problem);
    let root: Value = serde_json::from_slice(bytes).map_err(|e| whole(e.into()))?;
    let expected = "an object with \"frames\"";
    let Value::Object(root) = root else { return Err(whole(wrong("the file", &root, expected))) };
    let frames = match root.get("frames") {
        Some(Value::Array(frames)) if frames.is_empty() => return Err(whole(ViewsProblem::Empty)),
        Some(Value::Array(frames)) => frames,
        Some(other) => return Err(whole(wrong("\"frames\"", other, "a list of objects"))),
        None => return Err(whole(missing("\"frames\"", "a list of objects"))),
    };
    let read = |(i, value): (usize, &Value)| {
        let frame = match value {
            Value::Object(frame) => frame_of(&Scopes([frame, &root]), i),
            other => Err(wrong("it", other, "an object with \"file_path\" and \"transform_matrix\"")),
        };
        frame.map_err(|problem| error(item(i), problem))
    };
    frames.iter().enumerate().map(read).collect()
}

fn item(index: usize) -> At {
    At::Item("frame".to_owned(), index)
}

/// The file of a picture whose extension may be missing. If there is none it stays, for the message.
pub(super) fn picture(path: &Path) -> PathBuf {
    if path.exists() {
        return path.to_path_buf();
    }
    let with = |extension: &&str| {
        let mut name = path.as_os_str().to_owned();
        name.push(".");
        name.push(extension);
        Some(PathBuf::from(name)).filter(|path| path.exists())
    };
    IMAGES.iter().find_map(with).unwrap_or_else(|| path.to_path_buf())
}

fn wrong(what: &str, found: &Value, expected: &'static str) -> ViewsProblem {
    ViewsProblem::Value { what: what.to_owned(), found: excerpt(&found.to_string()), expected }
}

fn missing(what: &str, expected: &'static str) -> ViewsProblem {
    ViewsProblem::Missing { what: what.to_owned(), expected }
}

/// A frame, and the file's values for all frames.
struct Scopes<'a>([&'a Object; 2]);

impl Scopes<'_> {
    fn get(&self, key: &str) -> Option<&Value> {
        self.0.iter().find_map(|scope| value(scope, key))
    }

    fn number(&self, key: &str, expected: &'static str, valid: impl Fn(f64) -> bool) -> Number {
        number(self.get(key), key, expected, valid)
    }
}

type Number = Result<Option<f64>, ViewsProblem>;

/// A value that is not null.
fn value<'a>(scope: &'a Object, key: &str) -> Option<&'a Value> {
    scope.get(key).filter(|value| !value.is_null())
}

fn number(found: Option<&Value>, key: &str, expected: &'static str, valid: impl Fn(f64) -> bool) -> Number {
    let Some(found) = found else { return Ok(None) };
    let number = found.as_f64().filter(|x| x.is_finite() && valid(*x));
    number.map(Some).ok_or_else(|| wrong(&format!("\"{key}\""), found, expected))
}

fn frame_of(scopes: &Scopes<'_>, index: usize) -> Result<Frame, ViewsProblem> {
    let Scopes([frame, _]) = scopes;
    let text = |key| match value(frame, key) {
        None => Ok(None),
        Some(Value::String(text)) if !text.is_empty() => Ok(Some(text.clone())),
        Some(other) => Err(wrong(&format!("\"{key}\""), other, A_PATH)),
    };
    let picture = text("file_path")?.ok_or_else(|| missing("\"file_path\"", A_PATH))?;
    let weights = text("mask_path")?;
    let (columns, center) = matrix(frame)?;
    let found = || wrong("\"transform_matrix\"", &frame["transform_matrix"], A_ROTATION);
    let axes = rotation(columns).ok_or_else(found)?;
    // Down and into the picture, from up and out of it.
    let rotation = DMat3::from_cols(axes.x_axis, -axes.y_axis, -axes.z_axis).transpose();
    let lens = lens(scopes)?;
    Ok(Frame { at: item(index), picture, weights, rotation, center, lens })
}

/// The first three columns, and the position, of a frame's matrix.
fn matrix(frame: &Object) -> Result<(DMat3, DVec3), ViewsProblem> {
    let key = "\"transform_matrix\"";
    let value = value(frame, "transform_matrix").ok_or_else(|| missing(key, A_MATRIX))?;
    let error = || wrong(key, value, A_MATRIX);
    let row = |row: &Value| -> Option<[f64; 4]> {
        let numbers: Vec<f64> = row.as_array()?.iter().map(Value::as_f64).collect::<Option<_>>()?;
        numbers.try_into().ok().filter(|row: &[f64; 4]| row.iter().all(|x| x.is_finite()))
    };
    let rows: Option<Vec<[f64; 4]>> = value.as_array().ok_or_else(error)?.iter().map(row).collect();
    let (Some([a, b, c]) | Some([a, b, c, [0.0, 0.0, 0.0, 1.0]])) = rows.as_deref() else {
        return Err(error());
    };
    let column = |i: usize| DVec3::new(a[i], b[i], c[i]);
    Ok((DMat3::from_cols(column(0), column(1), column(2)), column(3)))
}

fn lens(scopes: &Scopes<'_>) -> Result<Lens, ViewsProblem> {
    refuse_distortion(scopes)?;
    let side = |key| {
        let is_size = |x: f64| x.fract() == 0.0 && (1.0..=f64::from(1_u32 << 31)).contains(&x);
        scopes.number(key, WHOLE, is_size)
    };
    let size = match (side("w")?, side("h")?) {
        (Some(w), Some(h)) => Some((w, h)),
        (None, None) => None,
        (None, _) => return Err(missing("\"w\", but an \"h\"", "both or neither")),
        (_, None) => return Err(missing("\"h\", but a \"w\"", "both or neither")),
    };
    let principal = [scopes.number("cx", A_NUMBER, |_| true)?, scopes.number("cy", A_NUMBER, |_| true)?];
    let focal = |scope: &Object, length: &str, angle: &str| {
        let pixels = number(value(scope, length), length, POSITIVE, |x| x > 0.0)?;
        let is_angle = |x: f64| x > 0.0 && x < std::f64::consts::PI;
        let radians = number(value(scope, angle), angle, AN_ANGLE, is_angle)?;
        Ok::<_, ViewsProblem>(pixels.map(Focal::Pixels).or(radians.map(Focal::Angle)))
    };
    // The first scope that says something of x says all.
    for scope in scopes.0 {
        if let Some(x) = focal(scope, "fl_x", "camera_angle_x")? {
            let y = focal(scope, "fl_y", "camera_angle_y")?;
            return Ok(Lens { size, focal: (x, y), principal });
        }
    }
    let expected = "a focal length in pixels, or \"camera_angle_x\" in radians, of the frame or the file";
    Err(missing("\"fl_x\"", expected))
}

fn refuse_distortion(scopes: &Scopes<'_>) -> Result<(), ViewsProblem> {
    let model = match scopes.get("camera_model") {
        None => "a lens".to_owned(),
        Some(Value::String(model)) if MODELS.contains(&model.as_str()) => format!("the camera is {model}"),
        Some(model) => {
            let camera = format!("the camera is {}", excerpt(&model.to_string()));
            return Err(ViewsProblem::NoPinhole { camera });
        }
    };
    match scopes.get("is_fisheye") {
        None | Some(Value::Bool(false)) => {}
        Some(Value::Bool(true)) => {
            return Err(ViewsProblem::NoPinhole { camera: "the camera is a fisheye".to_owned() });
        }
        Some(other) => return Err(wrong("\"is_fisheye\"", other, "true or false")),
    }
    for key in COEFFICIENTS {
        if let Some(value) = scopes.number(key, A_NUMBER, |_| true)?.filter(|value| *value != 0.0) {
            return Err(ViewsProblem::Distorted { camera: model, coefficient: key.to_owned(), value });
        }
    }
    Ok(())
}
