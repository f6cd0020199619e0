//! `--move`: a direction in parameter space, as text.

use std::fmt;
use std::str::FromStr;

use anyhow::{anyhow, bail};
use clap::Args;
use glam::DVec3;
use volume3d::gradient::Tangent;
use volume3d::optimize::{ParameterError, Quantity};
use volume3d::scene::{Object, Scene};

#[derive(Args, Debug)]
pub(super) struct Moves {
    /// The parameters that change, with their rates of change with respect to θ. May be repeated;
    /// rates add up. The gradient is the derivative with respect to θ at θ = 0.
    ///
    ///   THING:translate:x,y,z            by θ (x, y, z), in scene units
    ///   THING:rotate:px,py,pz:ax,ay,az   by θ |a| radians about the axis a through p
    ///   THING:scale:px,py,pz:s           x becomes p + (1 + θ s) (x − p)
    ///   SHAPE:vertex:INDEX:x,y,z         one vertex of its file, from 0, by θ (x, y, z)
    ///   SHAPE:radiance:r,g,b             emitted radiance, by θ (r, g, b)
    ///   SHAPE:radiance_texture:r,g,b     texture of the emitted radiance, all texels alike
    ///   LIGHT:radiance:r,g,b             constant environment
    ///   LIGHT:intensity:r,g,b            point light
    ///   LIGHT:irradiance:r,g,b           directional light
    ///   LIGHT:texture:r,g,b              environment map, spot or projector, all texels alike
    ///   MATERIAL:reflectance:r,g,b       constant reflectance
    ///   MATERIAL:texture:r,g,b           texture of the reflectance, all texels alike
    ///   MATERIAL:roughness:rate          roughness (alpha)
    ///   MATERIAL:roughness_texture:r,g,b
    ///   MATERIAL:metallic_texture:r,g,b
    ///   camera:translate:x,y,z           origin, in scene units
    ///   camera:rotate:ax,ay,az           by θ |a| radians about the axis a through the origin,
    ///                                    or the centre of an orthographic sensor
    ///   camera:fov:rate                  horizontal field of view, radians; not orthographic
    ///
    /// SHAPE, MATERIAL and LIGHT are ids of the scene; `volume3d info` lists them. THING is a
    /// shape, instance or group of shapes; an implicit surface; a point light, spot, projector,
    /// directional light or environment map, as far as it can move; `all`, which is all geometry;
    /// or `lights`, which is all emitters. Axes are those of the world, and rotations
    /// right-handed. Vertices of a file that share a position move together. A single texel
    /// moves by WHAT:texture:COLUMN,ROW:r,g,b, counted from 0 at the top left.
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
    /// All texels of a texture, or one, by column and row.
    Texels {
        kind: &'static str,
        at: Option<[usize; 2]>,
        rate: DVec3,
    },
    Roughness(f64),
    CameraTranslate(DVec3),
    CameraRotate(DVec3),
    CameraFieldOfView(f64),
}

const FORMS: &str = "THING:translate:x,y,z, THING:rotate:px,py,pz:ax,ay,az, THING:scale:px,py,pz:s, \
    SHAPE:vertex:INDEX:x,y,z, SHAPE:radiance:r,g,b, LIGHT:radiance:r,g,b, LIGHT:intensity:r,g,b, LIGHT:irradiance:r,g,b, \
    MATERIAL:reflectance:r,g,b, MATERIAL:roughness:rate, or WHAT:texture:r,g,b";
const CAMERA_FORMS: &str = "camera:translate:x,y,z, camera:rotate:ax,ay,az or camera:fov:rate";

/// The kinds of changes: keyword, parameter, and form of the rate.
const HOW: [(&str, &str, &str); 14] = [
    ("translate", "translation", "x,y,z"),
    ("rotate", "rotation", "px,py,pz:ax,ay,az"),
    ("scale", "scale", "px,py,pz:s"),
    ("vertex", "vertex_positions", "INDEX:x,y,z"),
    ("radiance", "radiance", "r,g,b"),
    ("intensity", "intensity", "r,g,b"),
    ("irradiance", "irradiance", "r,g,b"),
    ("reflectance", "reflectance", "r,g,b"),
    ("texture", "texture", "r,g,b"),
    ("radiance_texture", "radiance_texture", "r,g,b"),
    ("roughness_texture", "roughness_texture", "r,g,b"),
    ("metallic_texture", "metallic_texture", "r,g,b"),
    ("roughness", "roughness", "rate"),
    ("fov", "fov", "rate"),
];

impl FromStr for Move {
    type Err = String;

    fn from_str(text: &str) -> Result<Self, String> {
        let parts: Vec<&str> = text.split(':').collect();
        // An id may contain colons: it ends before the first keyword.
        let word = |i: usize| HOW.iter().map(|(word, ..)| *word).find(|word| *word == parts[i]);
        let at = (1..parts.len()).find_map(|i| Some((i, word(i)?)));
        let Some((at, word)) = at else { return Err(expected(text)) };
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
                ["radiance" | "intensity" | "irradiance" | "reflectance", v] => How::Colour(word, vector(v)?),
                ["roughness", rate] => How::Roughness(number(rate)?),
                ["fov", ..] => return Err(format!("only the camera has a field of view: {CAMERA_FORMS}")),
                [kind, v] if kind.ends_with("texture") => {
                    How::Texels { kind: word, at: None, rate: vector(v)? }
                }
                [kind, at, v] if kind.ends_with("texture") => {
                    How::Texels { kind: word, at: Some(texel(at)?), rate: vector(v)? }
                }
                _ => return Err(form(&what, word)),
            }
        };
        Ok(Self { what, how })
    }
}

/// The message for a change without a keyword: the form that was probably meant, or all forms.
fn expected(text: &str) -> String {
    let mut parts = text.split([':', '.']);
    let what = parts.next().unwrap_or_default();
    let meant = parts.find_map(|part| HOW.iter().find(|(_, parameter, _)| *parameter == part));
    match meant {
        Some((word, ..)) if what != "camera" => form(what, word),
        _ => format!("expected {FORMS}; or {CAMERA_FORMS}"),
    }
}

/// The message for a change whose rate has another form.
fn form(what: &str, word: &str) -> String {
    let rate = HOW.iter().find(|(known, ..)| *known == word).map_or("rate", |(.., rate)| rate);
    format!("expected {what}:{word}:{rate}")
}

/// In the form that [`FromStr`] reads, with the shortest numbers that round-trip.
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
            How::Texels { kind, at: None, rate } => format!("{kind}:{}", vector(rate)),
            How::Texels { kind, at: Some([column, row]), rate } => {
                format!("{kind}:{column},{row}:{}", vector(rate))
            }
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
        _ => Err(format!("`{text}` is not three numbers separated by commas")),
    }
}

fn texel(text: &str) -> Result<[usize; 2], String> {
    let numbers: Option<Vec<usize>> = text.split(',').map(|number| number.trim().parse().ok()).collect();
    match numbers.as_deref() {
        Some([column, row]) => Ok([*column, *row]),
        _ => Err(format!("`{text}` is not the column and row of a texel, separated by a comma")),
    }
}

/// The sum of all changes.
pub(super) fn change(scene: &Scene, moves: &[Move]) -> anyhow::Result<Tangent> {
    let mut change = Tangent::still(scene);
    moves.iter().try_for_each(|m| m.add_to(scene, &mut change))?;
    Ok(change)
}

impl Move {
    /// The parameters of a kind of all objects with this name.
    fn quantities(&self, scene: &Scene, kind: &str) -> anyhow::Result<Vec<Quantity>> {
        let found = Quantity::find_all(scene, &format!("{}.{kind}", self.what));
        let found = found.map_err(|error| self.in_words(scene, &error))?;
        Ok(found.into_iter().map(|member| member.quantity).collect())
    }

    /// The error, with the forms of --move that the named objects have.
    fn in_words(&self, scene: &Scene, error: &ParameterError) -> anyhow::Error {
        let kinds = scene.named(&self.what).into_iter().flat_map(|object| Quantity::of(scene, object));
        let forms = kinds.filter_map(|(kind, _)| HOW.iter().find(|(_, parameter, _)| *parameter == kind));
        let forms: Vec<String> =
            forms.map(|(word, _, rate)| format!("`{}:{word}:{rate}`", self.what)).collect();
        match error {
            ParameterError::Lacks { .. } if !forms.is_empty() => {
                anyhow!("{error}; --move {} takes {}", self.what, forms.join(", "))
            }
            _ => anyhow!("{error}"),
        }
    }

    /// The objects with this name that have one of these parameters; an error if there are none.
    fn objects(&self, scene: &Scene, kinds: &[&str]) -> anyhow::Result<Vec<Object>> {
        let has = |object: &Object| Quantity::of(scene, *object).iter().any(|(kind, _)| kinds.contains(kind));
        let found: Vec<Object> = scene.named(&self.what).into_iter().filter(has).collect();
        if found.is_empty() {
            self.quantities(scene, kinds[0])?;
        }
        Ok(found)
    }

    fn add_to(&self, scene: &Scene, change: &mut Tangent) -> anyhow::Result<()> {
        match self.how {
            How::Translate(velocity) => {
                for object in self.objects(scene, &["translation"])? {
                    change.translate_object(scene, object, velocity);
                }
            }
            How::Rotate { centre, axis } => {
                // Objects with a position but no orientation move around the axis.
                for object in self.objects(scene, &["rotation", "translation"])? {
                    change.rotate_object(scene, object, centre, axis);
                }
            }
            How::Scale { centre, rate } => {
                for object in self.objects(scene, &["scale"])? {
                    change.scale_object(scene, object, centre, rate);
                }
            }
            How::Vertex { index, velocity } => {
                for quantity in self.quantities(scene, "vertex_positions")? {
                    let Quantity::VertexPositions { shape } = quantity else { continue };
                    let sources = scene.description().shapes[shape].mesh.sources();
                    let Some(&position) = sources.get(index) else {
                        let count = sources.len();
                        bail!("`{}` has no vertex {index}: its {count} vertices count from 0", self.what);
                    };
                    change.positions_of_mut(scene, shape)[position as usize] += velocity;
                }
            }
            How::Colour(kind, rate) => {
                for quantity in self.quantities(scene, kind)? {
                    match quantity {
                        Quantity::Radiance { shape } => change.radiance[shape] += rate,
                        Quantity::EnvironmentRadiance => change.environment += rate,
                        Quantity::Intensity { light } => change.intensity[light] += rate,
                        Quantity::Reflectance { material } => change.reflectance[material] += rate,
                        other => bail!("{other:?} is no colour"),
                    }
                }
            }
            How::Texels { kind, at, rate } => {
                for quantity in self.quantities(scene, kind)? {
                    let Quantity::Texture { texture, .. } = quantity else { continue };
                    let image = &scene.description().textures[texture];
                    match at {
                        None => change.texels[texture].iter_mut().for_each(|texel| *texel += rate),
                        Some([column, row]) if column < image.width && row < image.height => {
                            change.texels[texture][row * image.width + column] += rate;
                        }
                        Some([column, row]) => bail!(
                            "`{}.{kind}` has no texel in column {column}, row {row}: it is {} × {}, counted from 0",
                            self.what,
                            image.width,
                            image.height
                        ),
                    }
                }
            }
            How::Roughness(rate) => {
                for quantity in self.quantities(scene, "roughness")? {
                    if let Quantity::Roughness { material } = quantity {
                        change.roughness[material] += rate;
                    }
                }
            }
            How::CameraTranslate(velocity) => change.camera.translation += velocity,
            How::CameraRotate(axis) => change.camera.rotation += axis,
            How::CameraFieldOfView(rate) => {
                self.quantities(scene, "fov")?;
                change.camera.field_of_view += rate;
            }
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
            "a:texture:1,2,3",
            "a:roughness_texture:4,0:1,2,3",
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
            "a:texture:1",
            "a:texture:1,2:3",
            "a:texture:1,-2:1,2,3",
        ];
        for text in bad {
            assert!(parse(text).is_err(), "{text}");
        }
        for (text, meant) in [
            ("a:translate", "a:translate:x,y,z"),
            ("a:rotate:0,1,0", "a:rotate:px,py,pz:ax,ay,az"),
            ("a.translation:1,0,0", "a:translate:x,y,z"),
            ("a:vertex_positions:1,0,0", "a:vertex:INDEX:x,y,z"),
        ] {
            assert_eq!(parse(text), Err(format!("expected {meant}")));
        }
    }
}
