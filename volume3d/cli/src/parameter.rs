//! `--wrt`: a parameter of a scene by its name, and its part of a gradient.

use std::str::FromStr;

use volume3d::gradient::Tangent;
use volume3d::io::Array;
use volume3d::optimize::{Parameters, Quantity};
use volume3d::scene::Scene;

/// The name of a parameter.
#[derive(Clone, Debug, PartialEq, Eq)]
pub(super) struct Name(String);

impl FromStr for Name {
    type Err = String;

    fn from_str(text: &str) -> Result<Self, String> {
        Quantity::split_name(text).map_err(|e| e.to_string())?;
        Ok(Self(text.to_owned()))
    }
}

impl AsRef<str> for Name {
    fn as_ref(&self) -> &str {
        &self.0
    }
}

impl Name {
    /// A file name for the parameter: characters of the id other than letters, digits and `-` become `_`, so
    /// that it cannot lead out of a folder.
    pub(super) fn file_name(&self) -> String {
        let plain = |c: char| if c.is_alphanumeric() || c == '-' { c } else { '_' };
        let what = Quantity::split_name(&self.0).map_or(&*self.0, |name| name.what);
        let (what, kind) = self.0.split_at(what.len());
        let what: String = what.chars().map(plain).collect();
        format!("{what}{kind}.npy")
    }
}

/// The gradient with respect to each parameter. For vertex positions: one row per vertex of the file, the
/// derivative with respect to its position. Vertices of the file that share a position move together, and
/// each row has the full derivative.
pub(super) fn arrays(parameters: &Parameters, scene: &Scene, gradient: &Tangent) -> Vec<Array> {
    let whole = parameters.gradient(scene, &parameters.values(scene), gradient);
    let groups = parameters.groups().iter();
    groups
        .map(|group| {
            let (mut shape, own) = (group.first().dimensions(scene), &whole[group.range.clone()]);
            let values = match group.quantity {
                Quantity::VertexPositions { shape: s } => {
                    let width = if group.component.is_some() { 1 } else { 3 };
                    let places: Vec<&[f64]> = own.chunks_exact(width).collect();
                    let sources = scene.description().shapes[s].mesh.sources();
                    shape[0] = sources.len();
                    sources.iter().flat_map(|&i| places[i as usize]).copied().collect()
                }
                _ => own.to_vec(),
            };
            Array { shape, values }
        })
        .collect()
}
