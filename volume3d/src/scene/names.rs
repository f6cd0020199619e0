//! Lookup of names in a scene, with suggestions.

use super::object::{Collection, Object};
use super::{Environment, Light, Scene};

/// Failed lookup of a name: no object has it, or only an object of another kind.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
#[non_exhaustive]
pub enum NameError {
    /// The scene has no object of the kind.
    #[error("there is no {what} `{id}`: the scene has no {what} at all")]
    Nothing {
        /// "shape" or "implicit surface".
        what: &'static str,
        /// The name.
        id: String,
    },
    /// The scene has objects of the kind, but none with this name.
    #[error("there is no {what} `{id}`; closest first, there are: {}", listed(.known))]
    Unknown {
        /// "shape" or "implicit surface".
        what: &'static str,
        /// The name.
        id: String,
        /// Existing names, most similar first.
        known: Vec<String>,
    },
    /// An object of another kind has the name.
    #[error(
        "`{id}` is {found}, and no {what}{}",
        if .known.is_empty() { String::new() } else { format!("; closest first, {what}s are: {}", listed(.known)) }
    )]
    Other {
        /// "shape" or "implicit surface".
        what: &'static str,
        /// The name.
        id: String,
        /// Description of that object, with an article.
        found: String,
        /// Existing names of the requested kind, most similar first.
        known: Vec<String>,
    },
}

/// Lists some names, and counts the rest.
pub(crate) fn listed(names: &[String]) -> String {
    /// Number of names listed.
    const SHOWN: usize = 12;
    let shown = names.iter().take(SHOWN).map(|name| format!("`{name}`")).collect::<Vec<_>>().join(", ");
    match names.len().saturating_sub(SHOWN) {
        0 => shown,
        more => format!("{shown} and {more} more"),
    }
}

/// Sorts names by their similarity to `id`, most similar first.
pub(crate) fn closest_first(id: &str, names: &mut [String]) {
    names.sort_by_key(|name| strsim::osa_distance(id, name));
}

impl Scene {
    /// All named objects, with their names. A material may have several names.
    pub fn objects(&self) -> impl Iterator<Item = (Object, &str)> {
        let d = self.description();
        fn of<'n>(
            names: impl Iterator<Item = &'n String>,
            object: fn(usize) -> Object,
        ) -> impl Iterator<Item = (Object, &'n str)> {
            names.enumerate().map(move |(index, name)| (object(index), name.as_str()))
        }
        let environment = d.environment.iter().map(|environment| match environment {
            Environment::Constant { id, .. } | Environment::Map { id, .. } => {
                (Object::Environment, id.as_str())
            }
        });
        let aliases = d.aliases.iter().map(|alias| (Object::Material(alias.material), alias.id.as_str()));
        let instances =
            of(d.instances.iter().map(|i| &i.id), |i| Object::Collection(Collection::Instances(i)));
        of(d.shapes.iter().map(|s| &s.id), Object::Shape)
            .chain(of(d.implicits.iter().map(|s| &s.id), Object::Implicit))
            .chain(of(d.materials.iter().map(|m| &m.id), Object::Material))
            .chain(aliases)
            .chain(of(d.lights.iter().map(Light::id), Object::Light))
            .chain(environment)
            .chain(instances)
            .chain(of(d.media.iter().map(|m| &m.id), Object::Medium))
            .chain(of(d.textures.iter().map(|t| &t.id), Object::Texture))
            .chain([
                (Object::Camera, "camera"),
                (Object::Collection(Collection::All), "all"),
                (Object::Collection(Collection::Lights), "lights"),
            ])
    }

    /// All objects with a name, which objects of different kinds may share. `camera` is the camera; `all` and
    /// `lights` are all geometry and all lights, unless an object of the scene has that name.
    #[must_use]
    pub fn named(&self, id: &str) -> Vec<Object> {
        if id == "camera" {
            return vec![Object::Camera];
        }
        let mut found: Vec<Object> = self.objects().filter(|(_, name)| *name == id).map(|(o, _)| o).collect();
        if found.len() > 1 {
            found
                .retain(|object| !matches!(object, Object::Collection(Collection::All | Collection::Lights)));
        }
        found
    }

    /// Description of an object's kind, with an article.
    #[must_use]
    pub fn describe(&self, object: Object) -> String {
        let d = self.description();
        match object {
            Object::Camera if d.camera.orthographic.is_some() => "an orthographic camera".to_owned(),
            Object::Camera => "the camera".to_owned(),
            Object::Shape(s) if d.shapes[s].radiance.is_some() => "a shape that emits".to_owned(),
            Object::Shape(_) => "a shape that emits nothing".to_owned(),
            Object::Implicit(_) => "an implicit surface".to_owned(),
            Object::Material(m) => format!("a material ({})", d.materials[m].bsdf.name()),
            Object::Light(l) => match d.lights[l] {
                Light::Point { .. } => "a point light",
                Light::Spot { .. } => "a spot light",
                Light::Projector { .. } => "a projector",
                Light::Directional { .. } => "a directional light",
            }
            .to_owned(),
            Object::Environment => match d.environment {
                Some(Environment::Map { .. }) => "an environment map".to_owned(),
                _ => "a constant environment".to_owned(),
            },
            Object::Medium(_) => "a medium".to_owned(),
            Object::Texture(_) => "a texture".to_owned(),
            Object::Collection(Collection::All) => "all geometry".to_owned(),
            Object::Collection(Collection::Lights) => "all lights".to_owned(),
            Object::Collection(Collection::Instances(_)) => "an instance or a group of shapes".to_owned(),
        }
    }

    /// Index of the shape with a name.
    ///
    /// # Errors
    /// A [`NameError`] with suggestions, if there is none.
    pub fn find_shape(&self, id: &str) -> Result<usize, NameError> {
        self.find("shape", id, |object| match object {
            Object::Shape(shape) => Some(shape),
            _ => None,
        })
    }

    /// Index of the implicit surface with a name, among implicit surfaces.
    ///
    /// # Errors
    /// A [`NameError`] with suggestions, if there is none.
    pub fn find_implicit(&self, id: &str) -> Result<usize, NameError> {
        self.find("implicit surface", id, |object| match object {
            Object::Implicit(implicit) => Some(implicit),
            _ => None,
        })
    }

    fn find(
        &self,
        what: &'static str,
        id: &str,
        index: impl Fn(Object) -> Option<usize>,
    ) -> Result<usize, NameError> {
        let named = self.named(id);
        if let Some(index) = named.iter().find_map(|&object| index(object)) {
            return Ok(index);
        }
        let of_kind = self.objects().filter(|(object, _)| index(*object).is_some());
        let mut known: Vec<String> = of_kind.map(|(_, name)| name.to_owned()).collect();
        closest_first(id, &mut known);
        let id = id.to_owned();
        Err(match named.first() {
            Some(&object) => NameError::Other { what, id, found: self.describe(object), known },
            None if known.is_empty() => NameError::Nothing { what, id },
            None => NameError::Unknown { what, id, known },
        })
    }
}
