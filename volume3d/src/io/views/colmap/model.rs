//! Models of COLMAP's cameras.

use super::super::frame::Focal;
use crate::io::ViewsProblem;

/// A model: its number in binary files, its name, and the names of its parameters.
#[derive(Debug)]
pub(super) struct Model {
    pub(super) number: i32,
    pub(super) name: &'static str,
    pub(super) parameters: &'static [&'static str],
    /// Whether it is a pinhole if all coefficients of distortion are 0.
    is_pinhole: bool,
}

const fn model(
    number: i32,
    name: &'static str,
    parameters: &'static [&'static str],
    is_pinhole: bool,
) -> Model {
    Model { number, name, parameters, is_pinhole }
}

static MODELS: [Model; 12] = [
    model(0, "SIMPLE_PINHOLE", &["f", "cx", "cy"], true),
    model(1, "PINHOLE", &["fx", "fy", "cx", "cy"], true),
    model(2, "SIMPLE_RADIAL", &["f", "cx", "cy", "k1"], true),
    model(3, "RADIAL", &["f", "cx", "cy", "k1", "k2"], true),
    model(4, "OPENCV", &["fx", "fy", "cx", "cy", "k1", "k2", "p1", "p2"], true),
    model(5, "OPENCV_FISHEYE", &["fx", "fy", "cx", "cy", "k1", "k2", "k3", "k4"], false),
    model(6, "FULL_OPENCV", &["fx", "fy", "cx", "cy", "k1", "k2", "p1", "p2", "k3", "k4", "k5", "k6"], true),
    model(7, "FOV", &["fx", "fy", "cx", "cy", "omega"], false),
    model(8, "SIMPLE_RADIAL_FISHEYE", &["f", "cx", "cy", "k1"], false),
    model(9, "RADIAL_FISHEYE", &["f", "cx", "cy", "k1", "k2"], false),
    model(
        10,
        "THIN_PRISM_FISHEYE",
        &["fx", "fy", "cx", "cy", "k1", "k2", "p1", "p2", "k3", "k4", "sx1", "sy1"],
        false,
    ),
    model(
        11,
        "RAD_TAN_THIN_PRISM_FISHEYE",
        &["fx", "fy", "cx", "cy", "k0", "k1", "k2", "k3", "k4", "k5", "p0", "p1", "s0", "s1", "s2", "s3"],
        false,
    ),
];

impl Model {
    pub(super) fn named(name: &str) -> Option<&'static Self> {
        MODELS.iter().find(|model| model.name == name)
    }

    pub(super) fn numbered(number: i32) -> Option<&'static Self> {
        MODELS.iter().find(|model| model.number == number)
    }

    /// Focal lengths and principal point, if nothing distorts.
    #[expect(clippy::type_complexity, reason = "the two fields of a lens")]
    pub(super) fn pinhole(
        &self,
        id: u32,
        parameters: &[f64],
    ) -> Result<((Focal, Option<Focal>), [Option<f64>; 2]), ViewsProblem> {
        let camera = format!("camera {id} is {}", self.name);
        if !self.is_pinhole {
            return Err(ViewsProblem::NoPinhole { camera });
        }
        let (mut focal, mut second, mut principal) = (0.0, None, [None; 2]);
        for (&name, &value) in self.parameters.iter().zip(parameters) {
            match name {
                _ if !value.is_finite() => {
                    let (what, expected) = (format!("{name} of camera {id}"), "a finite number");
                    return Err(ViewsProblem::Value { what, found: value.to_string(), expected });
                }
                "f" | "fx" => focal = value,
                "fy" => second = Some(Focal::Pixels(value)),
                "cx" => principal[0] = Some(value),
                "cy" => principal[1] = Some(value),
                _ if value != 0.0 => {
                    return Err(ViewsProblem::Distorted { camera, coefficient: name.to_owned(), value });
                }
                _ => {}
            }
        }
        Ok(((Focal::Pixels(focal), second), principal))
    }
}
