//! A scene with a reference gradient image, from the folder of scenes.

use std::fmt;
use std::path::{Path, PathBuf};

use anyhow::{Context as _, bail, ensure};
use clap::ValueEnum;
use glam::DVec3;
use serde::{Deserialize, Serialize};
use volume3d::gradient::Tangent;
use volume3d::io::{load_scene, read_npy};
use volume3d::scene::{Filter, Scene};

use crate::space::Reference;

/// Which normals shade.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, PartialOrd, Ord, ValueEnum, Deserialize, Serialize)]
#[serde(rename_all = "lowercase")]
pub(crate) enum Normals {
    /// Those of faces.
    #[default]
    Face,
    /// Those of vertices, interpolated.
    Vertex,
}

/// The filter of every pixel, as Mitsuba 3 defines it.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, PartialOrd, Ord, ValueEnum, Deserialize, Serialize)]
#[serde(rename_all = "lowercase")]
pub(crate) enum FilterName {
    /// The pixel itself.
    #[default]
    Box,
    /// Of radius 1 pixel.
    Tent,
    /// Of standard deviation ½ pixel.
    Gaussian,
}

impl FilterName {
    fn filter(self) -> Filter {
        match self {
            Self::Box => Filter::Box,
            Self::Tent => Filter::Tent { radius: 1.0 },
            Self::Gaussian => Filter::Gaussian { deviation: 0.5 },
        }
    }
}

/// The word for a value in options and files.
pub(super) fn word(value: impl ValueEnum) -> String {
    value.to_possible_value().map_or_else(String::new, |name| name.get_name().to_owned())
}

/// Common properties of a group of comparable measurements.
#[derive(Clone, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub(super) struct Group {
    pub(super) scene: String,
    pub(super) normals: Normals,
    pub(super) filter: FilterName,
}

impl fmt::Display for Group {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "{}, {} normals, {} filter", self.scene, word(self.normals), word(self.filter))
    }
}

impl Group {
    /// The group of a file called `SCENE_FILTER_grad.npy` or, with interpolated normals,
    /// `SCENE_FILTER_vn_grad.npy`.
    fn of_file(name: &str) -> Option<Self> {
        let rest = name.strip_suffix("_grad.npy")?;
        let (rest, normals) =
            rest.strip_suffix("_vn").map_or((rest, Normals::Face), |rest| (rest, Normals::Vertex));
        let (scene, filter) = rest.rsplit_once('_')?;
        let filter = FilterName::from_str(filter, false).ok()?;
        (!scene.is_empty()).then(|| Self { scene: scene.to_owned(), normals, filter })
    }

    /// All groups with a gradient image in the folder, in order.
    pub(super) fn all(folder: &Path) -> anyhow::Result<Vec<Self>> {
        let listing =
            std::fs::read_dir(folder).with_context(|| format!("cannot list {}", folder.display()))?;
        let mut groups = vec![];
        for entry in listing {
            let entry = entry.with_context(|| format!("cannot list {}", folder.display()))?;
            groups.extend(entry.file_name().to_str().and_then(Self::of_file));
        }
        groups.sort();
        ensure!(
            !groups.is_empty(),
            "{} holds no gradient image SCENE_FILTER_grad.npy or SCENE_FILTER_vn_grad.npy",
            folder.display()
        );
        Ok(groups)
    }
}

/// Scene, parameter and reference of a measurement.
pub(super) struct Case {
    pub(super) scene: Scene,
    pub(super) change: Tangent,
    /// A suitable step for finite differences.
    pub(super) step: f64,
    pub(super) reference: Reference,
    /// The mean of the reference image.
    pub(super) radiance: DVec3,
}

impl Case {
    /// Reads scene, parameter and reference.
    pub(super) fn load(scenes: &Path, references: &Path, group: &Group) -> anyhow::Result<Self> {
        let folder = scenes.join(&group.scene);
        let smooth = if group.normals == Normals::Vertex { "_smooth" } else { "" };
        let path = folder.join(format!("{}{smooth}.xml", group.scene));
        let mut description = load_scene(&path)?;
        description.film.filter = group.filter.filter();
        let scene = Scene::new(description).with_context(|| path.display().to_string())?;
        let path = folder.join("theta.json");
        let text =
            std::fs::read_to_string(&path).with_context(|| format!("cannot read {}", path.display()))?;
        let (change, step) = parameter(&text, &scene).with_context(|| path.display().to_string())?;
        let normals = if group.normals == Normals::Vertex { "_vn" } else { "" };
        let file = |what: &str| -> PathBuf {
            references.join(format!("{}_{}{normals}_{what}.npy", group.scene, word(group.filter)))
        };
        let gradient = pixels(&file("grad"), scene.size())?;
        let variance = pixels(&file("varmean"), scene.size())?;
        let floor = mean(&variance).dot(DVec3::splat(1.0 / 3.0));
        ensure!(floor >= 0.0, "{}: a variance is negative", file("varmean").display());
        let reference = Reference { gradient, floor, runs: vec![] };
        ensure!(reference.power() > 0.0, "{}: the gradient is zero", file("grad").display());
        let radiance = mean(&pixels(&file("img"), scene.size())?);
        Ok(Self { scene, change, step, reference, radiance })
    }
}

/// The mean of all pixels.
pub(super) fn mean(pixels: &[DVec3]) -> DVec3 {
    pixels.iter().sum::<DVec3>() / pixels.len() as f64
}

/// An array of height × width × 3 finite numbers, or of height × width for all channels alike.
fn pixels(path: &Path, (width, height): (usize, usize)) -> anyhow::Result<Vec<DVec3>> {
    let array = read_npy(path)?;
    let shown = path.display();
    if let Some(index) = array.values.iter().position(|v| !v.is_finite()) {
        bail!("{shown}: number {index} is not finite");
    }
    let image = array.to_image().filter(|image| (image.width, image.height) == (width, height));
    let image = image.with_context(|| {
        format!("{shown}: an array of {:?}, but the film needs [{height}, {width}, 3]", array.shape)
    })?;
    Ok(image.pixels)
}

/// The parameter of a scene: p' = p + θ·axis, or a right-handed rotation by θ radians about the axis through
/// the centre.
#[derive(Deserialize)]
struct Theta {
    kind: Kind,
    axis: [f64; 3],
    center: Option<[f64; 3]>,
    meshes: Vec<String>,
    fd_step: f64,
}

#[derive(Deserialize)]
#[serde(rename_all = "lowercase")]
enum Kind {
    Translate,
    Rotate,
}

/// The tangent with respect to θ, and the step of finite differences.
fn parameter(text: &str, scene: &Scene) -> anyhow::Result<(Tangent, f64)> {
    let Theta { kind, axis, center, meshes, fd_step } = serde_json::from_str(text)?;
    let axis = DVec3::from(axis);
    ensure!(axis != DVec3::ZERO, "“axis” is zero");
    ensure!(!meshes.is_empty(), "“meshes” must name shapes");
    ensure!(fd_step > 0.0, "“fd_step” must be a positive number");
    let mut change = Tangent::still(scene);
    for name in &meshes {
        let shape = scene.shape(name).with_context(|| format!("the scene has no shape “{name}”"))?;
        match kind {
            Kind::Translate => change.translate(scene, shape, axis),
            Kind::Rotate => {
                let center = center.context("a rotation needs its “center”")?;
                change.rotate(scene, shape, center.into(), axis.normalize());
            }
        }
    }
    Ok((change, fd_step))
}

#[cfg(test)]
mod tests {
    use super::super::tests::tiny_scene;
    use super::*;

    #[test]
    fn files_tell_their_group() {
        let group = |scene: &str, normals, filter| Some(Group { scene: scene.to_owned(), normals, filter });
        assert_eq!(Group::of_file("a_b_tent_grad.npy"), group("a_b", Normals::Face, FilterName::Tent));
        assert_eq!(Group::of_file("a_box_vn_grad.npy"), group("a", Normals::Vertex, FilterName::Box));
        for other in
            ["a_tent_img.npy", "_tent_grad.npy", "tent_grad.npy", "a_mitchell_grad.npy", "a_grad.npy"]
        {
            assert_eq!(Group::of_file(other), None, "{other}");
        }
    }

    #[test]
    fn parameters_move_what_they_name() {
        let scene = tiny_scene();
        let text = r#"{"kind": "rotate", "axis": [0, 2, 0], "center": [1, 0, 0], "meshes": ["block"], "fd_step": 0.01}"#;
        let (change, step) = parameter(text, &scene).unwrap();
        let mut expected = Tangent::still(&scene);
        expected.rotate(&scene, scene.shape("block").unwrap(), DVec3::X, DVec3::Y);
        assert_eq!((change, step), (expected, 0.01));
        let translated = text.replace("rotate", "translate").replace("[1, 0, 0]", "null");
        let mut expected = Tangent::still(&scene);
        expected.translate(&scene, scene.shape("block").unwrap(), 2.0 * DVec3::Y);
        assert_eq!(parameter(&translated, &scene).unwrap().0, expected);
        for (from, to, words) in [
            ("block", "blok", "“blok”"),
            ("rotate", "scale", "`scale`"),
            ("[0, 2, 0]", "[0, 0, 0]", "“axis”"),
            ("[1, 0, 0]", "null", "“center”"),
            ("0.01", "-1", "“fd_step”"),
            ("[\"block\"]", "[]", "“meshes”"),
            ("{", "", "line 1"),
        ] {
            let error = format!("{:#}", parameter(&text.replace(from, to), &scene).unwrap_err());
            assert!(error.contains(words), "{error}");
        }
    }
}
