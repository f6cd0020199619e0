//! Plugin instance with its parameters, all of which must be queried.

use std::cell::{Cell, RefCell};
use std::collections::HashMap;
use std::rc::Rc;

use glam::{DAffine3, DVec3};

use super::element::Element;
use super::journal::Journal;
use super::spectrum::Meaning;
use super::{harmless, spectrum, support, transform, values};
use crate::io::{Error, SceneProblem};

/// Weights of linear RGB in the luminance (Rec. 709).
const LUMINANCE: DVec3 = DVec3::new(0.2126, 0.7152, 0.0722);

/// The elements that are parameters.
const VALUES: [&str; 12] = [
    "float",
    "integer",
    "boolean",
    "string",
    "rgb",
    "srgb",
    "spectrum",
    "blackbody",
    "point",
    "vector",
    "transform",
    "texture",
];

/// Elements by id, and the journal.
pub(super) struct Ids<'a> {
    elements: HashMap<&'a str, &'a Element>,
    pub(super) journal: Rc<Journal>,
}

impl<'a> Ids<'a> {
    pub(super) fn new(elements: HashMap<&'a str, &'a Element>, journal: Rc<Journal>) -> Self {
        Self { elements, journal }
    }

    pub(super) fn get(&self, id: &str) -> Option<&'a Element> {
        self.elements.get(id).copied()
    }

    pub(super) fn contains_key(&self, id: &str) -> bool {
        self.elements.contains_key(id)
    }
}

/// An element that creates something, with what it contains.
///
/// Everything in it must be queried by name or kind; [`finish`](Self::finish) refuses the rest. The supported
/// parameters listed in an error are therefore exactly those that are read.
pub(super) struct Object<'a> {
    pub(super) element: &'a Element,
    /// The type; empty for the scene.
    pub(super) plugin: &'a str,
    pub(super) journal: Rc<Journal>,
    children: Vec<Child<'a>>,
    asked: RefCell<Vec<&'static str>>,
}

struct Child<'a> {
    /// The element in the file.
    element: &'a Element,
    /// Its target: another element if it is a reference.
    target: &'a Element,
    used: Cell<bool>,
}

impl<'a> Object<'a> {
    pub(super) fn new(element: &'a Element, ids: &Ids<'a>) -> Result<Self, Error> {
        element.check_attributes(&["type", "id", "name"])?;
        Self::with_plugin(element, element.required("type")?, ids)
    }

    pub(super) fn with_plugin(element: &'a Element, plugin: &'a str, ids: &Ids<'a>) -> Result<Self, Error> {
        let mut children: Vec<Child<'a>> = vec![];
        let mut names: HashMap<&str, &Element> = HashMap::new();
        for child in &element.children {
            if let Some(name) = child.attribute("name")
                && let Some(first) = names.insert(name, child)
            {
                // An old and a new name may both be given, and are merged.
                if first.says_the_same(child) {
                    ids.journal.note(child, format!("{name} was given before, with the same value"));
                    continue;
                }
                let (name, first) = (name.to_owned(), first.place());
                return Err(child.error(SceneProblem::Duplicate { what: "parameter", name, first }));
            }
            let target = if child.tag == "ref" { dereference(child, ids)? } else { child };
            children.push(Child { element: child, target, used: Cell::new(false) });
        }
        let plugin = match support::spelling(&element.tag, plugin) {
            Some(usual) => {
                ids.journal.note(element, format!("{} \"{plugin}\" is read as \"{usual}\"", element.tag));
                usual
            }
            None => plugin,
        };
        Ok(Self { element, plugin, journal: ids.journal.clone(), children, asked: RefCell::default() })
    }

    /// A message's name for this object.
    pub(super) fn describe(&self) -> String {
        match self.plugin {
            "" => format!("the {}", self.element.tag),
            plugin => format!("{} \"{plugin}\"", self.element.tag),
        }
    }

    /// Notes how this object was read.
    pub(super) fn note(&self, text: impl Into<String>) {
        self.journal.note(self.element, text);
    }

    pub(super) fn missing(&self, name: &str) -> Error {
        self.element.error(SceneProblem::Missing { plugin: self.describe(), name: name.to_owned() })
    }

    pub(super) fn conflict(&self, first: &'static str, second: &'static str) -> Error {
        self.element.error(SceneProblem::Conflict { plugin: self.describe(), first, second })
    }

    pub(super) fn unknown_plugin(&self, tag: &'static str, supported: &'static str) -> Error {
        self.element.error(SceneProblem::Plugin { tag, plugin: self.plugin.to_owned(), supported })
    }

    /// The element of a parameter.
    pub(super) fn parameter(&self, name: &'static str) -> Option<&'a Element> {
        self.ask(name);
        let child = self.children.iter().find(|c| c.element.attribute("name") == Some(name))?;
        child.used.set(true);
        Some(child.target)
    }

    /// A parameter that must be given by one of these elements.
    fn of_kind(
        &self,
        name: &'static str,
        tags: &[&str],
        expected: &'static str,
    ) -> Result<Option<&'a Element>, Error> {
        let Some(element) = self.parameter(name) else { return Ok(None) };
        if !tags.contains(&element.tag.as_str()) {
            let (name, found) = (name.to_owned(), element.tag.clone());
            return Err(element.error(SceneProblem::Kind { name, found, expected }));
        }
        let is_plugin = element.tag == "spectrum" && element.attribute("type").is_some();
        if tags != ["transform"] && !is_plugin {
            element.check_childless()?;
        }
        Ok(Some(element))
    }

    fn value(
        &self,
        name: &'static str,
        tags: &[&str],
        expected: &'static str,
    ) -> Result<Option<(&'a Element, &'a str)>, Error> {
        let Some(element) = self.of_kind(name, tags, expected)? else { return Ok(None) };
        element.check_attributes(&["name", "value"])?;
        Ok(Some((element, element.required("value")?)))
    }

    pub(super) fn float(&self, name: &'static str) -> Result<Option<f64>, Error> {
        self.float_where(name, "a finite number", |_| true)
    }

    /// A number with an additional condition.
    pub(super) fn float_where(
        &self,
        name: &'static str,
        expected: &'static str,
        holds: impl Fn(f64) -> bool,
    ) -> Result<Option<f64>, Error> {
        let Some((element, value)) = self.value(name, &["float", "integer"], "<float>")? else {
            return Ok(None);
        };
        let number = values::number(element, name, value)?;
        if holds(number) { Ok(Some(number)) } else { Err(element.bad_value(name, value, expected)) }
    }

    /// A number that may be a texture: `<float>`, or a constant texture, a colour by its luminance.
    pub(super) fn number_where(
        &self,
        name: &'static str,
        expected: &'static str,
        holds: impl Fn(f64) -> bool,
    ) -> Result<Option<f64>, Error> {
        let Some(element) = self.parameter(name).filter(|element| element.tag == "spectrum") else {
            return self.float_where(name, expected, holds);
        };
        let Some(colour) = self.colour(name)? else { return Ok(None) };
        let is_grey = colour == DVec3::splat(colour.x);
        let number = if is_grey { colour.x } else { LUMINANCE.dot(colour) };
        if !is_grey {
            self.journal.note(element, format!("the colour is read as its luminance, {number}"));
        }
        if holds(number) {
            Ok(Some(number))
        } else {
            Err(element.bad_value(name, &number.to_string(), expected))
        }
    }

    pub(super) fn positive(&self, name: &'static str) -> Result<Option<f64>, Error> {
        self.float_where(name, "a number greater than 0", |x| x > 0.0)
    }

    pub(super) fn integer_in(
        &self,
        name: &'static str,
        range: std::ops::RangeInclusive<i64>,
        expected: &'static str,
    ) -> Result<Option<i64>, Error> {
        let Some((element, value)) = self.value(name, &["integer"], "<integer>")? else { return Ok(None) };
        let number = value.trim().parse().ok().filter(|i| range.contains(i));
        number.map(Some).ok_or_else(|| element.bad_value(name, value, expected))
    }

    pub(super) fn boolean(&self, name: &'static str) -> Result<Option<bool>, Error> {
        let Some((element, value)) = self.value(name, &["boolean"], "<boolean>")? else { return Ok(None) };
        match value.trim().to_ascii_lowercase().as_str() {
            "true" => Ok(Some(true)),
            "false" => Ok(Some(false)),
            _ => Err(element.bad_value(name, value, "true or false")),
        }
    }

    /// A boolean of which only one value is supported.
    pub(super) fn boolean_that_is(&self, name: &'static str, value: bool) -> Result<(), Error> {
        match self.boolean(name)? {
            Some(found) if found != value => {
                let what = format!("{name} {found}");
                Err(self.element.unsupported(what, "leave it out"))
            }
            _ => Ok(()),
        }
    }

    pub(super) fn string(&self, name: &'static str) -> Result<Option<&'a str>, Error> {
        Ok(self.value(name, &["string"], "<string>")?.map(|(_, value)| value))
    }

    /// One of the words in `choices`, as its index.
    pub(super) fn choice(
        &self,
        name: &'static str,
        choices: &[&str],
        expected: &'static str,
    ) -> Result<Option<usize>, Error> {
        let Some((element, value)) = self.value(name, &["string"], "<string>")? else { return Ok(None) };
        let found = choices.iter().position(|choice| choice.eq_ignore_ascii_case(value.trim()));
        found.map(Some).ok_or_else(|| element.bad_value(name, value, expected))
    }

    pub(super) fn vector(&self, name: &'static str) -> Result<Option<DVec3>, Error> {
        let Some(element) = self.of_kind(name, &["point", "vector"], "<point> or <vector>")? else {
            return Ok(None);
        };
        element.check_attributes(&["name", "x", "y", "z", "value"])?;
        if element.attribute("value").is_none() {
            ["x", "y", "z"].into_iter().try_for_each(|name| element.required(name).map(|_| ()))?;
        }
        values::vector(element, 0.0).map(Some)
    }

    /// A constant colour, linear RGB. The conversion of a spectrum depends on its meaning: see [`Meaning`].
    pub(super) fn colour(&self, name: &'static str) -> Result<Option<DVec3>, Error> {
        let tags = ["rgb", "float", "integer", "spectrum", "srgb", "blackbody"];
        let expected = "<rgb>, <float> or <spectrum>";
        let Some(element) = self.of_kind(name, &tags, expected)? else { return Ok(None) };
        if !matches!(element.tag.as_str(), "spectrum" | "blackbody") {
            element.check_attributes(&["name", "value"])?;
            return values::colour(element).map(Some);
        }
        let meaning = match (self.element.tag.as_str(), name) {
            ("emitter", _) => Meaning::Emission,
            (_, "eta" | "k" | "int_ior" | "ext_ior" | "sigma_t" | "sigma_s" | "sigma_a") => Meaning::Index,
            _ => Meaning::Reflectance,
        };
        let colour = spectrum::colour(element, meaning)?;
        if let Some(how) = colour.approximation {
            let [r, g, b] = colour.rgb.to_array();
            self.journal
                .note(element, format!("the spectrum is read as linear RGB {r:.4} {g:.4} {b:.4}{how}"));
        }
        Ok(Some(colour.rgb))
    }

    pub(super) fn transform(&self, name: &'static str) -> Result<Option<&'a Element>, Error> {
        self.of_kind(name, &["transform"], "<transform>")
    }

    pub(super) fn affine(&self, name: &'static str) -> Result<Option<(&'a Element, DAffine3)>, Error> {
        let Some(element) = self.transform(name)? else { return Ok(None) };
        transform::affine(element).map(|map| Some((element, map)))
    }

    /// The nested elements of a kind: `<tag>`.
    pub(super) fn nested(&self, tag: &'static str) -> Vec<&'a Element> {
        self.ask(tag);
        let matching = self.children.iter().filter(|c| format!("<{}>", c.target.tag) == tag);
        matching.map(|c| (c.used.set(true), c.target).1).collect()
    }

    /// At most one nested element of a kind.
    pub(super) fn at_most_one(&self, tag: &'static str) -> Result<Option<&'a Element>, Error> {
        match self.nested(tag)[..] {
            [] => Ok(None),
            [element] => Ok(Some(element)),
            [_, second, ..] => Err(second.error(SceneProblem::Count {
                what: tag.to_owned(),
                parent: self.describe(),
                found: self.nested(tag).len(),
                expected: "at most one",
            })),
        }
    }

    /// Ignores nested elements of a kind, all of them or those that are called by one name.
    pub(super) fn ignore(&self, tag: &str, name: Option<&str>, why: &str) {
        let is_called = |c: &Child<'_>| name.is_none() || c.element.attribute("name") == name;
        for child in self.children.iter().filter(|c| c.target.tag == tag && is_called(c)) {
            child.used.set(true);
            self.journal.note(child.element, format!("the {tag} is ignored: {why}"));
        }
    }

    /// Refuses everything that was not queried.
    pub(super) fn finish(&self) -> Result<(), Error> {
        let mut refused = None;
        for child in self.children.iter().filter(|c| !c.used.get()) {
            let element = child.element;
            let name = element.attribute("name").unwrap_or_default();
            if let Some(why) = harmless::reason(&self.element.tag, name) {
                self.journal.note(element, format!("{name} is ignored: {why}"));
                continue;
            }
            let error = self.unasked(child);
            if self.journal.is_lenient {
                self.journal.note(element, format!("ignored, because: {error}"));
            } else if refused.is_none() {
                refused = Some(error);
            } else {
                self.journal.refuse(error);
            }
        }
        refused.map_or(Ok(()), Err)
    }

    /// The error for a parameter or element that was not queried.
    fn unasked(&self, child: &Child<'a>) -> Error {
        let asked = self.asked.borrow();
        let list = |are_tags: bool| {
            let names: Vec<&str> = asked.iter().copied().filter(|a| a.starts_with('<') == are_tags).collect();
            if names.is_empty() { "none".to_owned() } else { names.join(", ") }
        };
        let is_value = |tag: &str| VALUES.contains(&tag);
        let problem = match child.element.attribute("name") {
            Some(name) if is_value(&child.target.tag) => SceneProblem::Parameter {
                plugin: self.describe(),
                name: name.to_owned(),
                supported: list(false),
            },
            None if is_value(&child.target.tag) => {
                SceneProblem::MissingAttribute { tag: child.element.tag.clone(), attribute: "name" }
            }
            _ => SceneProblem::Tag {
                tag: child.target.tag.clone(),
                parent: self.describe(),
                supported: list(true),
            },
        };
        child.element.error(problem)
    }

    fn ask(&self, name: &'static str) {
        let mut asked = self.asked.borrow_mut();
        if !asked.contains(&name) {
            asked.push(name);
        }
    }
}

fn dereference<'a>(reference: &'a Element, ids: &Ids<'a>) -> Result<&'a Element, Error> {
    reference.check_attributes(&["id", "name"])?;
    reference.check_childless()?;
    let id = reference.required("id")?;
    ids.elements.get(id).copied().ok_or_else(|| {
        /// Maximum number of ids in a message.
        const SHOWN: usize = 20;
        let mut known: Vec<&str> = ids.elements.keys().copied().collect();
        known.sort_unstable();
        known.truncate(SHOWN);
        let known = if known.is_empty() { "none".to_owned() } else { known.join(", ") };
        reference.error(SceneProblem::Reference { id: id.to_owned(), known })
    })
}
