//! Lookup of names in a scene, with suggestions.

use super::{Bsdf, Environment, Light, Reflectance, Scene};

/// A name that does not exist, or belongs to an object of another kind.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
#[non_exhaustive]
pub enum NameError {
    /// The scene has no object of the kind.
    #[error("there is no {what} `{id}`: the scene has no {what} at all")]
    Nothing {
        /// "shape", "material" or "light".
        what: &'static str,
        /// The name.
        id: String,
    },
    /// The scene has other objects of the kind.
    #[error("there is no {what} `{id}`; closest first, there are: {}", list(.known))]
    Unknown {
        /// "shape", "material" or "light".
        what: &'static str,
        /// The name.
        id: String,
        /// Existing names, most similar first.
        known: Vec<String>,
    },
    /// The named object lacks the requested property.
    #[error("{what} `{id}` {lacks}; {}", others(.what, .kind, .known))]
    Lacks {
        /// "shape", "material" or "light".
        what: &'static str,
        /// The name.
        id: String,
        /// The missing property, as the end of a sentence.
        lacks: &'static str,
        /// Description of the objects that have it.
        kind: &'static str,
        /// Names of those.
        known: Vec<String>,
    },
    /// An intensity or irradiance was requested of a shape or the environment, whose emission is called
    /// radiance.
    #[error(
        "`{id}` is {what}, whose light is its radiance: `{id}.radiance`, or `{id}:radiance:r,g,b` of a motion"
    )]
    Radiance {
        /// Name of the object.
        id: String,
        /// "the environment" or "a shape that emits".
        what: &'static str,
    },
    /// An environment map has texels instead of a single radiance.
    #[error("`{id}` is an environment map, which has no single radiance")]
    Map {
        /// Name of the map.
        id: String,
    },
}

/// Some of the names, and the number of others.
fn list(names: &[String]) -> String {
    /// Largest number of names listed.
    const SHOWN: usize = 12;
    let shown = names.iter().take(SHOWN).map(|name| format!("`{name}`")).collect::<Vec<_>>().join(", ");
    match names.len().saturating_sub(SHOWN) {
        0 => shown,
        more => format!("{shown} and {more} more"),
    }
}

fn others(what: &str, kind: &str, known: &[String]) -> String {
    if known.is_empty() {
        format!("no {what} of this scene does otherwise")
    } else {
        format!("{what}s {kind}: {}", list(known))
    }
}

/// An object with a radiance.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Emitter {
    Shape(usize),
    /// The constant environment.
    Environment,
}

impl Scene {
    /// Index of the shape with a name.
    ///
    /// # Errors
    /// A [`NameError`] with suggestions, if there is none.
    pub fn find_shape(&self, id: &str) -> Result<usize, NameError> {
        find("shape", id, self.description().shapes.iter().map(|s| &s.id))
    }

    /// Index of the implicit surface with a name, among implicit surfaces.
    ///
    /// # Errors
    /// A [`NameError`] with suggestions, if there is none.
    pub fn find_implicit(&self, id: &str) -> Result<usize, NameError> {
        find("implicit surface", id, self.description().implicits.iter().map(|s| &s.id))
    }

    /// An emitting shape, or a constant environment.
    pub(crate) fn find_emitter(&self, id: &str) -> Result<Emitter, NameError> {
        let shapes = &self.description().shapes;
        match &self.description().environment {
            Some(Environment::Constant { id: sky, .. }) if sky == id => return Ok(Emitter::Environment),
            Some(Environment::Map { id: map, .. }) if map == id => {
                return Err(NameError::Map { id: id.to_owned() });
            }
            _ => {}
        }
        let all = shapes.iter().map(|s| (&s.id, s.radiance.is_some()));
        find_with("shape", id, all, "emits nothing", "that emit").map(Emitter::Shape)
    }

    /// Refuses objects with a radiance where an intensity or irradiance is requested.
    fn check_no_emitter(&self, id: &str) -> Result<(), NameError> {
        let radiance = |what| Err(NameError::Radiance { id: id.to_owned(), what });
        match self.find_emitter(id) {
            Ok(Emitter::Environment) => radiance("the environment"),
            Ok(Emitter::Shape(_)) => radiance("a shape that emits"),
            Err(NameError::Map { id }) => Err(NameError::Map { id }),
            Err(_) => Ok(()),
        }
    }

    /// Index of a point, spot or projector light.
    pub(crate) fn find_point_light(&self, id: &str) -> Result<usize, NameError> {
        self.check_no_emitter(id)?;
        let lights = self.description().lights.iter();
        let all = lights.map(|l| (l.id(), !matches!(l, Light::Directional { .. })));
        find_with("light", id, all, "is no point light", "that are")
    }

    /// Index of a directional light.
    pub(crate) fn find_directional_light(&self, id: &str) -> Result<usize, NameError> {
        self.check_no_emitter(id)?;
        let lights = self.description().lights.iter();
        let all = lights.map(|l| (l.id(), matches!(l, Light::Directional { .. })));
        find_with("light", id, all, "is no directional light", "that are")
    }

    /// Index of a material with constant reflectance.
    pub(crate) fn find_plain(&self, id: &str) -> Result<usize, NameError> {
        let lacks = "has a texture, not one reflectance";
        self.find_material_with(id, lacks, "without a texture", |bsdf| {
            matches!(bsdf.reflectance(), Reflectance::Constant(_))
        })
    }

    /// Indices of a textured material and its texture.
    pub(crate) fn find_textured(&self, id: &str) -> Result<(usize, usize), NameError> {
        let texture = |bsdf: &Bsdf| match bsdf.reflectance() {
            Reflectance::Texture(texture) => Some(*texture),
            Reflectance::Constant(_) => None,
        };
        let index =
            self.find_material_with(id, "has no texture", "with a texture", |bsdf| texture(bsdf).is_some())?;
        let found = texture(&self.description().materials[index].bsdf);
        Ok((index, found.expect("a material with a texture was asked for")))
    }

    /// Index of a material with a roughness.
    pub(crate) fn find_rough(&self, id: &str) -> Result<usize, NameError> {
        self.find_material_with(id, "has no roughness", "with one", |bsdf| bsdf.roughness().is_some())
    }

    fn find_material_with(
        &self,
        id: &str,
        lacks: &'static str,
        kind: &'static str,
        has: impl Fn(&Bsdf) -> bool,
    ) -> Result<usize, NameError> {
        let all = self.description().materials.iter().map(|m| (&m.id, has(&m.bsdf)));
        find_with("material", id, all, lacks, kind)
    }
}

fn find<'a>(
    what: &'static str,
    id: &str,
    known: impl Iterator<Item = &'a String> + Clone,
) -> Result<usize, NameError> {
    if let Some(index) = known.clone().position(|name| name == id) {
        return Ok(index);
    }
    let id = id.to_owned();
    let mut known: Vec<String> = known.cloned().collect();
    if known.is_empty() {
        return Err(NameError::Nothing { what, id });
    }
    known.sort_by_key(|name| strsim::osa_distance(&id, name));
    Err(NameError::Unknown { what, id, known })
}

/// Lookup among objects of which some have a property.
fn find_with<'a>(
    what: &'static str,
    id: &str,
    all: impl Iterator<Item = (&'a String, bool)> + Clone,
    lacks: &'static str,
    kind: &'static str,
) -> Result<usize, NameError> {
    let index = find(what, id, all.clone().map(|(name, _)| name))?;
    if all.clone().nth(index).is_some_and(|(_, is)| is) {
        return Ok(index);
    }
    let known = all.filter(|(_, is)| *is).map(|(name, _)| name.clone()).collect();
    Err(NameError::Lacks { what, id: id.to_owned(), lacks, kind, known })
}
