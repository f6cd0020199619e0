//! `--move`: a direction in the space of parameters, in words.

use std::fmt;
use std::str::FromStr;

use anyhow::bail;
use clap::Args;
use glam::DVec3;
use volume3d::gradient::Tangent;
use volume3d::optimize::{ParameterError, Quantity};
use volume3d::scene::Scene;

#[derive(Args, Debug)]
pub(super) struct Moves {
    /// What moves, and how fast; several add up. The gradient is the derivative by the
    /// parameter θ that all of them have in common, at θ = 0.
    ///
    ///   SHAPE:translate:x,y,z            by θ (x, y, z), in scene units
    ///   SHAPE:rotate:px,py,pz:ax,ay,az   by θ |a| radians about the axis a through p
    ///   SHAPE:scale:px,py,pz:s           x becomes p + (1 + θ s) (x − p)
    ///   SHAPE:vertex:INDEX:x,y,z         one vertex of its file, from 0, by θ (x, y, z)
    ///   SHAPE:radiance:r,g,b             what it emits, by θ (r, g, b)
    ///   LIGHT:radiance:r,g,b             that of a constant environment
    ///   LIGHT:intensity:r,g,b            of a point light
    ///   LIGHT:irradiance:r,g,b           of a directional light
    ///   MATERIAL:reflectance:r,g,b       its constant reflectance
    ///   MATERIAL:roughness:rate          its alpha
    ///   camera:translate:x,y,z           its origin, in scene units
    ///   camera:rotate:ax,ay,az           by θ |a| radians about the axis a through its origin, or
    ///                                    the middle of an orthographic sensor
    ///   camera:fov:rate                  its horizontal field of view, radians; not orthographic
    ///
    /// SHAPE, MATERIAL and LIGHT are ids of the scene, which `volume3d info` lists. Axes are in the
    /// world, and turns right-handed. Vertices of a file at one place move together.
    #[arg(long = "move", value_name = "WHAT:HOW:RATE", verbatim_doc_comment, allow_hyphen_values = true)]
    pub(super) moves: Vec<Move>,
}

/// One motion of one thing.
#[derive(Clone, Debug, PartialEq)]
pub(super) struct Move {
    what: String,
    how: How,
}

#[derive(Clone, Copy, Debug, PartialEq)]
enum How {
    Translate(DVec3),
    Rotate {
        centre: DVec3,
        axis: DVec3,
    },
    Scale {
        centre: DVec3,
        rate: f64,
    },
    Vertex {
        index: usize,
        velocity: DVec3,
    },
    /// A radiance, an intensity, an irradiance or a reflectance.
    Colour(&'static str, DVec3),
    Roughness(f64),
    CameraTranslate(DVec3),
    CameraRotate(DVec3),
    CameraFieldOfView(f64),
}

const SHAPE_FORMS: &str = "SHAPE:translate:x,y,z, SHAPE:rotate:px,py,pz:ax,ay,az, SHAPE:scale:px,py,pz:s, \
    SHAPE:vertex:INDEX:x,y,z, SHAPE:radiance:r,g,b, LIGHT:radiance:r,g,b, LIGHT:intensity:r,g,b, LIGHT:irradiance:r,g,b, \
    MATERIAL:reflectance:r,g,b or MATERIAL:roughness:rate";
const CAMERA_FORMS: &str = "camera:translate:x,y,z, camera:rotate:ax,ay,az or camera:fov:rate";

/// The words for what happens.
const HOW: [&str; 10] = [
    "translate",
    "rotate",
    "scale",
    "vertex",
    "radiance",
    "intensity",
    "irradiance",
    "reflectance",
    "roughness",
    "fov",
];

impl FromStr for Move {
    type Err = String;

    fn from_str(text: &str) -> Result<Self, String> {
        let parts: Vec<&str> = text.split(':').collect();
        // An id may have colons in it: it ends before the first word that tells what happens.
        let at = (1..parts.len()).find(|&i| HOW.contains(&parts[i]));
        let Some(at) = at else { return Err(format!("expected {SHAPE_FORMS}; or {CAMERA_FORMS}")) };
        let what = parts[..at].join(":");
        let how = if what == "camera" {
            match parts[at..] {
                ["translate", v] => How::CameraTranslate(vector(v)?),
                ["rotate", v] => How::CameraRotate(vector(v)?),
                ["fov", rate] => How::CameraFieldOfView(number(rate)?),
                _ => return Err(format!("expected {CAMERA_FORMS}")),
            }
        } else {
            match parts[at..] {
                ["translate", v] => How::Translate(vector(v)?),
                ["rotate", centre, axis] => How::Rotate { centre: vector(centre)?, axis: vector(axis)? },
                ["scale", centre, rate] => How::Scale { centre: vector(centre)?, rate: number(rate)? },
                ["vertex", index, v] => {
                    let index = index.parse().map_err(|_| format!("`{index}` is not a vertex's index"))?;
                    How::Vertex { index, velocity: vector(v)? }
                }
                ["radiance", v] => How::Colour("radiance", vector(v)?),
                ["intensity", v] => How::Colour("intensity", vector(v)?),
                ["irradiance", v] => How::Colour("irradiance", vector(v)?),
                ["reflectance", v] => How::Colour("reflectance", vector(v)?),
                ["roughness", rate] => How::Roughness(number(rate)?),
                _ => return Err(format!("expected {SHAPE_FORMS}")),
            }
        };
        Ok(Self { what, how })
    }
}

/// As it is read: numbers are the shortest that mean the same.
impl fmt::Display for Move {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let vector = |v: DVec3| format!("{},{},{}", v.x, v.y, v.z);
        let how = match self.how {
            How::Translate(v) | How::CameraTranslate(v) => format!("translate:{}", vector(v)),
            How::Rotate { centre, axis } => format!("rotate:{}:{}", vector(centre), vector(axis)),
            How::CameraRotate(axis) => format!("rotate:{}", vector(axis)),
            How::Scale { centre, rate } => format!("scale:{}:{rate}", vector(centre)),
            How::Vertex { index, velocity } => format!("vertex:{index}:{}", vector(velocity)),
            How::Colour(kind, rate) => format!("{kind}:{}", vector(rate)),
            How::Roughness(rate) => format!("roughness:{rate}"),
            How::CameraFieldOfView(rate) => format!("fov:{rate}"),
        };
        write!(f, "{}:{how}", self.what)
    }
}

fn number(text: &str) -> Result<f64, String> {
    let number = text.trim().parse().ok().filter(|x: &f64| x.is_finite());
    number.ok_or_else(|| format!("`{text}` is not a finite number"))
}

fn vector(text: &str) -> Result<DVec3, String> {
    let numbers = text.split(',').map(number).collect::<Result<Vec<f64>, String>>()?;
    match numbers[..] {
        [x, y, z] => Ok(DVec3::new(x, y, z)),
        _ => Err(format!("`{text}` is not three numbers with commas between")),
    }
}

/// The sum of all motions.
pub(super) fn change(scene: &Scene, moves: &[Move]) -> anyhow::Result<Tangent> {
    let mut change = Tangent::still(scene);
    moves.iter().try_for_each(|m| m.add_to(scene, &mut change))?;
    Ok(change)
}

impl Move {
    fn quantity(&self, scene: &Scene, kind: &str) -> Result<Quantity, ParameterError> {
        Quantity::find(scene, &format!("{}.{kind}", self.what))
    }

    fn add_to(&self, scene: &Scene, change: &mut Tangent) -> anyhow::Result<()> {
        let shape = || scene.find_shape(&self.what);
        let moves = matches!(
            self.how,
            How::Translate(_) | How::Rotate { .. } | How::Scale { .. } | How::Vertex { .. }
        );
        if let Some(implicit) = scene.implicit(&self.what).filter(|_| moves) {
            return self.add_to_implicit(scene, implicit, change);
        }
        match self.how {
            How::Translate(velocity) => change.translate(scene, shape()?, velocity),
            How::Rotate { centre, axis } => change.rotate(scene, shape()?, centre, axis),
            How::Scale { centre, rate } => change.scale(scene, shape()?, centre, rate),
            How::Vertex { index, velocity } => {
                let shape = shape()?;
                let sources = scene.description().shapes[shape].mesh.sources();
                let Some(&position) = sources.get(index) else {
                    let count = sources.len();
                    bail!("`{}` has no vertex {index}: its {count} vertices count from 0", self.what);
                };
                change.positions_of_mut(scene, shape)[position as usize] += velocity;
            }
            How::Colour(kind, rate) => match self.quantity(scene, kind)? {
                Quantity::Radiance { shape } => change.radiance[shape] += rate,
                Quantity::EnvironmentRadiance => change.environment += rate,
                Quantity::Intensity { light } => change.intensity[light] += rate,
                Quantity::Reflectance { material } => change.reflectance[material] += rate,
                other => bail!("{other:?} is no colour"),
            },
            How::Roughness(rate) => match self.quantity(scene, "roughness")? {
                Quantity::Roughness { material } => change.roughness[material] += rate,
                other => bail!("{other:?} is no roughness"),
            },
            How::CameraTranslate(velocity) => change.camera.translation += velocity,
            How::CameraRotate(axis) => change.camera.rotation += axis,
            How::CameraFieldOfView(rate) => {
                Quantity::find(scene, "camera.fov")?;
                change.camera.field_of_view += rate;
            }
        }
        Ok(())
    }

    fn add_to_implicit(&self, scene: &Scene, index: usize, change: &mut Tangent) -> anyhow::Result<()> {
        let (shape, rates) = (&scene.description().implicits[index], &mut change.implicits[index]);
        match self.how {
            How::Translate(velocity) => rates.translation += velocity,
            How::Rotate { centre, axis } => rates.rotate(shape, centre, axis),
            _ => bail!("`{}` is an implicit surface, which can be translated and rotated only", self.what),
        }
        Ok(())
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn parse(text: &str) -> Result<Move, String> {
        text.parse()
    }

    #[test]
    fn motions_are_read() {
        let v = DVec3::new(1.0, -2.0, 0.5);
        let of = |what: &str, how| Ok(Move { what: what.to_owned(), how });
        assert_eq!(parse("a:translate:1,-2,0.5"), of("a", How::Translate(v)));
        assert_eq!(parse("a:rotate:0,0,0:1,-2,.5"), of("a", How::Rotate { centre: DVec3::ZERO, axis: v }));
        assert_eq!(parse("a:b:vertex:7:1,-2,0.5"), of("a:b", How::Vertex { index: 7, velocity: v }));
        assert_eq!(parse("camera:rotate:1,-2,0.5"), of("camera", How::CameraRotate(v)));
        assert_eq!(parse("camera:fov:1e-2"), of("camera", How::CameraFieldOfView(0.01)));
    }

    #[test]
    fn motions_are_written_as_they_are_read() {
        let texts = [
            "a:b:translate:1,-2,0.5",
            "a:rotate:0,0,0.25:1,-2,0.5",
            "a:scale:1,2,3:-0.1",
            "a:vertex:7:1,-2,0.5",
            "a:irradiance:1,2,3",
            "a:roughness:0.1",
            "camera:translate:1,-2,0.5",
            "camera:rotate:1,-2,0.5",
            "camera:fov:0.01",
        ];
        for text in texts {
            assert_eq!(parse(text).unwrap().to_string(), text);
        }
    }

    #[test]
    fn what_is_no_motion_is_refused() {
        let bad = [
            "",
            "a",
            "a:jump:1,2,3",
            "translate:1,2,3",
            "a:translate:1,2",
            "a:translate:1,2,inf",
            "a:scale:1",
            "a:vertex:-1:0,0,0",
            "camera:scale:0,0,0:1",
            "a:fov:1",
            "a:rotate:1,2,3",
        ];
        for text in bad {
            assert!(parse(text).is_err(), "{text}");
        }
    }
}
