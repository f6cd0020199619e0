//! Parameter names: parsing, look-up and errors.

use std::collections::{BTreeMap, HashMap};
use std::fmt;

use super::quantity::{Member, Quantity};
use crate::scene::{Collection, Object, Scene, closest_first, listed};

/// Unknown parameter names, or names that exclude each other.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
#[non_exhaustive]
pub enum ParameterError {
    /// The name is not an object, a dot and a kind of parameter.
    #[error("`{name}` names no parameter{}", form_words(.name, *.nearest))]
    Form {
        /// The name.
        name: String,
        /// The most similar form, or that of a word with the same meaning, if there is one.
        nearest: Option<&'static str>,
    },
    /// No object of the scene has this name.
    #[error("`{name}`: nothing is called `{what}`{}{}", meant(.near), having(.kind, .known))]
    Unknown {
        /// The name.
        name: String,
        /// The unknown part.
        what: String,
        /// The most similar name of any object, if similar enough, and what it names.
        near: Option<Box<[String; 2]>>,
        /// The parameter's kind.
        kind: &'static str,
        /// The names of objects with such a parameter, the most similar first.
        known: Vec<String>,
    },
    /// The object has no such parameter.
    #[error("`{name}`: {lack}")]
    Lacks {
        /// The name.
        name: String,
        /// Details: the parameters of the object.
        lack: Box<Lack>,
    },
    /// The parameter has no such component.
    #[error(
        "`{name}`: `{parameter}` {}",
        .components.map_or("has no components".to_owned(), |[a, b, c]| format!("has the components {a}, {b} and {c}"))
    )]
    Component {
        /// The name.
        name: String,
        /// The name without the component.
        parameter: String,
        /// The components that the parameter has.
        components: Option<[&'static str; 3]>,
    },
    /// Two components of one rotation, or a component and the whole.
    #[error(
        "`{name}` and `{other}` are of one rotation, whose components do not add up: take one of them, or the whole rotation"
    )]
    Rotation {
        /// The second name.
        name: String,
        /// The first.
        other: String,
    },
    /// The texture is a mesh attribute with texels out of range.
    #[error(
        "`{name}` is made of an attribute of a mesh, with four texels a triangle, and a fourth one that no triangle shows is \
         out of range; give the surface an image, whose texels can be fitted"
    )]
    Attribute {
        /// The name.
        name: String,
    },
    /// A parameter is named twice, or two names refer to one texture.
    #[error("{}", twice(.name, .other))]
    Twice {
        /// The second name.
        name: String,
        /// The first.
        other: String,
    },
    /// A list of tied names is empty.
    #[error("parameter {index} is a tie of no names")]
    Empty {
        /// Its index.
        index: usize,
    },
    /// Two parameters move one object in different ways.
    #[error("`{name}` and `{other}` both move {id}; fit one of them")]
    Moved {
        /// The second name.
        name: String,
        /// The first.
        other: String,
        /// The object that both move, in words.
        id: String,
    },
    /// Tied parameters have different sizes.
    #[error("`{name}` and `{other}` cannot be tied: they are {size} and {other_size} numbers")]
    TiedSizes {
        /// A name.
        name: String,
        /// The first name of the tie.
        other: String,
        /// The size of the parameter.
        size: usize,
        /// The size of the other parameter.
        other_size: usize,
    },
    /// Tied parameters have different bounds.
    #[error("`{name}` and `{other}` cannot be tied: one is from {bounds}, the other from {other_bounds}")]
    TiedBounds {
        /// A name.
        name: String,
        /// The first name of the tie.
        other: String,
        /// Lower and upper bound of the parameter, in words.
        bounds: String,
        /// Those of the other parameter.
        other_bounds: String,
    },
    /// A rotation is tied to a parameter that is not one.
    #[error("`{name}` and `{other}` cannot be tied: only one of them is a rotation")]
    TiedRotation {
        /// A name.
        name: String,
        /// The first name of the tie.
        other: String,
    },
}

/// An object that lacks a requested parameter.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Lack {
    /// Its name.
    pub what: String,
    /// Its type, with an article.
    pub found: String,
    /// The names of its parameters.
    pub has: Vec<String>,
    /// The names of parameters of objects that belong to it.
    pub related: Vec<String>,
    /// The requested kind of parameter.
    pub kind: &'static str,
    /// The names of objects with such a parameter, the most similar first.
    pub known: Vec<String>,
}

impl fmt::Display for Lack {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let Self { what, found, has, related, kind, known } = self;
        write!(f, "`{what}` is {found}{}{}", parameters(has, related), having(kind, known))
    }
}

fn meant(near: &Option<Box<[String; 2]>>) -> String {
    let words = |near: &[String; 2]| format!("; did you mean `{}`, {}?", near[0], near[1]);
    near.as_deref().map(words).unwrap_or_default()
}

fn having(kind: &str, known: &[String]) -> String {
    if known.is_empty() && kind == "texture" {
        "; nothing in this scene has a texture: where <texture type=\"bitmap\" name=\"reflectance\"> stands in the place of a \
         material's colour, its texels are a parameter, and the mesh needs texture coordinates"
            .to_owned()
    } else if known.is_empty() {
        format!("; nothing in this scene has a parameter `{kind}`")
    } else {
        format!("; closest first, objects with a parameter `{kind}`: {}", listed(known))
    }
}

fn parameters(has: &[String], related: &[String]) -> String {
    let own = if has.is_empty() {
        " without parameters".to_owned()
    } else {
        format!(", whose parameters are {}", listed(has))
    };
    let related = if related.is_empty() {
        String::new()
    } else {
        format!("; what belongs to it has {}", listed(related))
    };
    own + &related
}

fn twice(name: &str, other: &str) -> String {
    if name == other {
        format!("`{name}` is given twice; keep one of them")
    } else {
        format!("`{name}` is the same parameter as `{other}`")
    }
}

/// Forms of parameter names.
const FORMS: [&str; 22] = [
    "SHAPE.vertex_positions",
    "SHAPE.translation",
    "SHAPE.rotation",
    "SHAPE.scale",
    "SHAPE.sdf",
    "SHAPE.radiance",
    "SHAPE.radiance_texture",
    "LIGHT.radiance",
    "LIGHT.intensity",
    "LIGHT.irradiance",
    "LIGHT.translation",
    "LIGHT.rotation",
    "LIGHT.texture",
    "MATERIAL.reflectance",
    "MATERIAL.roughness",
    "MATERIAL.texture",
    "MATERIAL.roughness_texture",
    "MATERIAL.metallic_texture",
    "camera.translation",
    "camera.rotation",
    "camera.fov",
    "WHAT.PARAMETER.COMPONENT, such as SHAPE.translation.x or SHAPE.radiance.r",
];

/// Words for kinds of parameters in other programs.
const SYNONYMS: [(&[&str], &str); 9] = [
    (
        &[
            "position",
            "location",
            "offset",
            "origin",
            "translate",
            "shift",
            "move",
            "pos",
            "center",
            "centre",
        ],
        "translation",
    ),
    (&["rotate", "orientation", "angle", "angles", "turn", "euler", "quaternion", "rot"], "rotation"),
    (&["size", "scaling"], "scale"),
    (&["vertices", "vertex", "points", "positions", "verts"], "vertex_positions"),
    (&["color", "colour", "albedo", "diffuse", "base_color", "reflectivity", "kd"], "reflectance"),
    (&["alpha", "shininess"], "roughness"),
    (&["emission", "brightness", "power", "emissive", "light"], "radiance"),
    (&["grid", "distance", "distances", "surface", "weights"], "sdf"),
    (&["field_of_view", "focal_length", "angle_of_view"], "fov"),
];

/// The probable meaning of the name, with its own object; all forms if it is unknown.
fn form_words(name: &str, nearest: Option<&'static str>) -> String {
    let (what, kind) = split_last(name);
    match nearest {
        Some(form) if form.contains(' ') => {
            format!(
                "; `{kind}` is not a component: vectors have x, y and z, colours r, g and b, as in `{what}.x`"
            )
        }
        Some(form) if what.is_empty() => format!("; the nearest form is {form}"),
        Some(form) => format!("; did you mean `{what}.{}`?", split_last(form).1),
        None if what.is_empty() && !kind.is_empty() => {
            format!("; it is an object, a dot and a kind, such as `{kind}.translation` and `{kind}.rotation`")
        }
        None if kind.eq_ignore_ascii_case("pose") => {
            format!("; a pose is two parameters, `{what}.translation` and `{what}.rotation`")
        }
        _ => format!("; forms are: {}", FORMS.join(", ")),
    }
}

const COMPONENTS: [&str; 6] = ["x", "y", "z", "r", "g", "b"];

/// A parsed parameter name.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct NameParts<'n> {
    /// The object's name.
    pub what: &'n str,
    /// The kind of parameter.
    pub kind: &'static str,
    /// The component of each vector, if one is named.
    pub component: Option<&'n str>,
}

/// Splits a name at its last dot.
fn split_last(name: &str) -> (&str, &str) {
    name.rsplit_once('.').unwrap_or(("", name))
}

impl Quantity {
    /// Parses a parameter name into object, kind and component, independently of a scene.
    ///
    /// # Errors
    /// [`ParameterError::Form`] if it is not a parameter name.
    pub fn split_name(name: &str) -> Result<NameParts<'_>, ParameterError> {
        let is_camera = |what: &str| what == "camera";
        let known = || FORMS[..FORMS.len() - 1].iter().map(|form| split_last(form));
        let found = |(what, kind): (&str, &str)| {
            let fits = |&(of, k): &(&str, &str)| k == kind && is_camera(of) == is_camera(what);
            known().find(fits).filter(|_| !what.is_empty()).map(|(_, kind)| kind)
        };
        let (what, kind) = split_last(name);
        if let Some(kind) = found((what, kind)) {
            return Ok(NameParts { what, kind, component: None });
        }
        let inner = split_last(what);
        if let Some(of) = found(inner) {
            if COMPONENTS.contains(&kind) {
                return Ok(NameParts { what: inner.0, kind: of, component: Some(kind) });
            }
            return Err(ParameterError::Form { name: name.to_owned(), nearest: FORMS.last().copied() });
        }
        let plain = kind.to_lowercase();
        let meant = SYNONYMS.iter().find(|(words, _)| words.contains(&plain.as_str()));
        let word = meant.map_or(plain.as_str(), |(_, kind)| kind);
        let distance = |form: &&&str| strsim::osa_distance(word, split_last(form).1);
        let fitting =
            FORMS[..FORMS.len() - 1].iter().filter(|form| is_camera(split_last(form).0) == is_camera(what));
        let nearest = fitting.min_by_key(distance).filter(|form| distance(form) <= 1 + word.len() / 3);
        Err(ParameterError::Form { name: name.to_owned(), nearest: nearest.copied() })
    }

    /// The names of all parameters of a scene, sorted, without those of components.
    #[must_use]
    pub fn names(scene: &Scene) -> Vec<String> {
        let ids: HashMap<&str, usize> = scene.objects().fold(HashMap::new(), |mut ids, (_, id)| {
            *ids.entry(id).or_default() += 1;
            ids
        });
        // As in `Scene::named`.
        let is_named = |object: &Object, id: &str| match object {
            Object::Camera => true,
            Object::Collection(Collection::All | Collection::Lights) => ids[id] == 1,
            _ => id != "camera" && !id.is_empty(),
        };
        let mut usable: BTreeMap<String, bool> = BTreeMap::new();
        for (object, id) in scene.objects().filter(|(object, id)| is_named(object, id)) {
            for (kind, quantity) in Self::of(scene, object) {
                *usable.entry(format!("{id}.{kind}")).or_insert(true) &=
                    !quantity.is_attribute_out_of_range(scene);
            }
        }
        usable.into_iter().filter_map(|(name, usable)| usable.then_some(name)).collect()
    }

    /// Finds a parameter of a scene by its name; the first if several objects have the name.
    ///
    /// # Errors
    /// A [`ParameterError`] that suggests similar names.
    pub fn find(scene: &Scene, name: &str) -> Result<Member, ParameterError> {
        Self::find_all(scene, name).map(|found| found[0])
    }

    /// Finds all parameters of a scene with a name: several materials may share one, which a scene file made
    /// of one.
    ///
    /// # Errors
    /// A [`ParameterError`] that suggests similar names.
    pub fn find_all(scene: &Scene, name: &str) -> Result<Vec<Member>, ParameterError> {
        let NameParts { what, kind, component } = Self::split_name(name)?;
        let objects = scene.named(what);
        let of_kind = |object: &Object| {
            Self::of(scene, *object).into_iter().find(|(k, _)| *k == kind).map(|(_, quantity)| quantity)
        };
        let found: Vec<Self> = objects.iter().filter_map(of_kind).collect();
        let Some(first) = found.first() else {
            return Err(missing(scene, (name, what, kind), &objects));
        };
        let component = match component {
            None => None,
            Some(letter) => {
                let components = first.components();
                let at = components.and_then(|letters| letters.iter().position(|l| *l == letter));
                let parameter = format!("{what}.{kind}");
                let error = ParameterError::Component { name: name.to_owned(), parameter, components };
                Some(at.ok_or(error)?)
            }
        };
        if found.iter().any(|quantity| quantity.is_attribute_out_of_range(scene)) {
            return Err(ParameterError::Attribute { name: name.to_owned() });
        }
        Ok(found.into_iter().map(|quantity| Member { quantity, component }).collect())
    }
}

/// The error for a name without a parameter.
fn missing(
    scene: &Scene,
    (name, what, kind): (&str, &str, &'static str),
    objects: &[Object],
) -> ParameterError {
    let kinds_of = |object: Object| Quantity::of(scene, object).into_iter().map(|(kind, _)| kind);
    let has_kind = |object: Object| kinds_of(object).any(|k| k == kind);
    let mut known: Vec<String> =
        scene.objects().filter(|(object, _)| has_kind(*object)).map(|(_, name)| name.to_owned()).collect();
    closest_first(what, &mut known);
    let (name, what_owned) = (name.to_owned(), what.to_owned());
    let Some(&object) = objects.first() else {
        let near = scene.objects().min_by_key(|(_, known)| strsim::osa_distance(what, known));
        let near = near.filter(|(_, known)| strsim::osa_distance(what, known) <= 1 + what.len() / 3);
        let near = near.map(|(object, known)| Box::new([known.to_owned(), scene.describe(object)]));
        return ParameterError::Unknown { name, what: what_owned, near, kind, known };
    };
    let has = objects.iter().flat_map(|&object| kinds_of(object));
    let has = has.map(|kind| format!("{what}.{kind}")).collect();
    let related = objects.iter().flat_map(|&object| belonging(scene, object)).collect();
    let (what, found) = (what_owned, scene.describe(object));
    ParameterError::Lacks { name, lack: Box::new(Lack { what, found, has, related, kind, known }) }
}

/// The parameter names of related objects: of a shape's materials, and of the objects that use a texture.
fn belonging(scene: &Scene, object: Object) -> Vec<String> {
    let d = scene.description();
    let material = |index: usize| {
        let id = &d.materials[index].id;
        let kinds = Quantity::of(scene, Object::Material(index)).into_iter();
        kinds.map(move |(kind, _)| format!("{id}.{kind}"))
    };
    match object {
        Object::Shape(shape) => {
            d.parts_of_material(d.shapes[shape].material).into_iter().flat_map(material).collect()
        }
        Object::Implicit(implicit) => {
            d.parts_of_material(d.implicits[implicit].material).into_iter().flat_map(material).collect()
        }
        Object::Texture(texture) => {
            let uses = |object: Object, id: &str| {
                let of = Quantity::of(scene, object).into_iter();
                let of =
                    of.filter(|(_, q)| matches!(q, Quantity::Texture { texture: t, .. } if *t == texture));
                of.map(|(kind, _)| format!("{id}.{kind}")).collect::<Vec<_>>()
            };
            scene.objects().flat_map(|(object, id)| uses(object, id)).collect()
        }
        _ => vec![],
    }
}
