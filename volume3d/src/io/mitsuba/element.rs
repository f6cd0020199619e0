//! The elements of a scene and of the files it includes, with `$name` replaced.

use std::collections::HashMap;
use std::path::{Path, PathBuf};
use std::sync::Arc;

use crate::io::error::excerpt;
use crate::io::{At, Error, Place, SceneProblem};

/// Files may include files this deep, as in Mitsuba.
const MAX_INCLUDES: usize = 15;
/// Elements may be nested this deep; scenes need six.
const MAX_DEPTH: usize = 64;
/// Elements there may be, so that a file that includes itself twice does not fill the memory.
const MAX_ELEMENTS: usize = 1_000_000;

/// How other files are read.
pub(super) type Open<'a> = &'a dyn Fn(&Path) -> std::io::Result<Vec<u8>>;

/// An element: its attributes and children, and where it stands.
#[derive(Debug)]
pub(super) struct Element {
    pub(super) tag: String,
    pub(super) attributes: Vec<(String, String)>,
    pub(super) children: Vec<Element>,
    file: Arc<Path>,
    line: usize,
    column: usize,
}

impl Element {
    pub(super) fn attribute(&self, name: &str) -> Option<&str> {
        self.attributes.iter().find(|(n, _)| n == name).map(|(_, value)| value.as_str())
    }

    /// An attribute that must be given.
    pub(super) fn required(&self, attribute: &'static str) -> Result<&str, Error> {
        let missing = || SceneProblem::MissingAttribute { tag: self.tag.clone(), attribute };
        self.attribute(attribute).ok_or_else(|| self.error(missing()))
    }

    /// The value of a parameter.
    pub(super) fn value_of(&self, name: &str) -> Option<&str> {
        self.children.iter().find(|c| c.attribute("name") == Some(name))?.attribute("value")
    }

    /// Refuses all attributes but these.
    pub(super) fn check_attributes(&self, known: &[&str]) -> Result<(), Error> {
        match self.attributes.iter().find(|(name, _)| !known.contains(&name.as_str())) {
            None => Ok(()),
            Some((name, _)) => Err(self.error(SceneProblem::Attribute {
                tag: self.tag.clone(),
                attribute: name.clone(),
                supported: known.join(", "),
            })),
        }
    }

    /// Refuses children.
    pub(super) fn check_childless(&self) -> Result<(), Error> {
        match self.children.first() {
            None => Ok(()),
            Some(child) => Err(child.error(SceneProblem::Tag {
                tag: child.tag.clone(),
                parent: format!("<{}>", self.tag),
                supported: "nothing".to_owned(),
            })),
        }
    }

    pub(super) fn place(&self) -> Place {
        Place::new(&self.file, At::Column(self.line, self.column))
    }

    pub(super) fn error(&self, problem: SceneProblem) -> Error {
        Error::Scene { place: self.place(), problem: Box::new(problem) }
    }

    pub(super) fn bad_value(&self, name: &str, value: &str, expected: &'static str) -> Error {
        self.error(SceneProblem::Value { name: name.to_owned(), value: excerpt(value), expected })
    }

    pub(super) fn unsupported(&self, what: impl Into<String>, instead: &'static str) -> Error {
        self.error(SceneProblem::Unsupported { what: what.into(), instead })
    }

    /// An error in a file that this element names.
    pub(super) fn referenced(&self, source: Error) -> Error {
        Error::Referenced { place: self.place(), source: Box::new(source) }
    }

    /// A file beside the one this element stands in.
    pub(super) fn beside(&self, name: &str) -> PathBuf {
        self.file.parent().unwrap_or(Path::new("")).join(name)
    }

    /// Reads a file that this element names.
    pub(super) fn open(&self, path: &Path, open: Open<'_>) -> Result<Vec<u8>, Error> {
        let error = |source| Error::File { action: "read", path: path.to_path_buf(), source };
        open(path).map_err(|source| self.referenced(error(source)))
    }
}

/// The values of `$name`s.
#[derive(Debug, Default)]
pub(super) struct Variables {
    values: Vec<Variable>,
}

#[derive(Debug)]
struct Variable {
    name: String,
    value: String,
    used: bool,
}

impl Variables {
    pub(super) fn new(given: &[(String, String)]) -> Self {
        let values = given
            .iter()
            .map(|(name, value)| Variable { name: name.clone(), value: value.clone(), used: false })
            .collect();
        Self { values }
    }

    /// A value that counts unless one was given before. That it is used is not required.
    fn set_default(&mut self, name: &str, value: &str) {
        if !self.values.iter().any(|v| v.name == name) {
            self.values.push(Variable { name: name.to_owned(), value: value.to_owned(), used: true });
        }
    }

    /// `text` with each `$name` replaced, of several names that fit the longest; `\$` is a dollar. The values
    /// are not looked at again. Otherwise the name without a value.
    fn substitute(&mut self, text: &str) -> Result<String, String> {
        let mut result = String::new();
        let mut rest = text;
        while let Some(at) = rest.find('$') {
            let (before, after) = (&rest[..at], &rest[at + 1..]);
            if let Some(before) = before.strip_suffix('\\') {
                result.push_str(before);
                result.push('$');
                rest = after;
                continue;
            }
            result.push_str(before);
            let fits = self.values.iter_mut().filter(|v| !v.name.is_empty() && after.starts_with(&v.name));
            let Some(variable) = fits.max_by_key(|v| v.name.len()) else {
                let end = after.find(|c: char| !c.is_alphanumeric() && c != '_').unwrap_or(after.len());
                return Err(after[..end].to_owned());
            };
            variable.used = true;
            result.push_str(&variable.value);
            rest = &after[variable.name.len()..];
        }
        result.push_str(rest);
        Ok(result)
    }
}

/// A scene with all that it includes.
#[derive(Debug)]
pub(super) struct Document {
    pub(super) root: Element,
}

impl Document {
    pub(super) fn parse(
        bytes: &[u8],
        path: &Path,
        variables: Variables,
        open: Open<'_>,
    ) -> Result<Self, Error> {
        let mut builder = Builder { variables, open, elements: 0, opened: vec![] };
        let root = builder.file(bytes, path, 0)?;
        if root.tag != "scene" {
            return Err(root.error(SceneProblem::Tag {
                tag: root.tag.clone(),
                parent: "the file".to_owned(),
                supported: "<scene>".to_owned(),
            }));
        }
        root.check_attributes(&["version", "id", "name"])?;
        if let Some(unused) = builder.variables.values.iter().find(|v| !v.used) {
            return Err(root.error(SceneProblem::UnusedVariable { name: unused.name.clone() }));
        }
        Ok(Self { root })
    }

    /// Everything with an id.
    pub(super) fn by_id(&self) -> Result<HashMap<&str, &Element>, Error> {
        let mut ids = HashMap::new();
        collect_ids(&self.root, &mut ids)?;
        Ok(ids)
    }
}

fn collect_ids<'a>(element: &'a Element, ids: &mut HashMap<&'a str, &'a Element>) -> Result<(), Error> {
    if element.tag != "ref"
        && let Some(id) = element.attribute("id")
        && let Some(first) = ids.insert(id, element)
    {
        let (name, first) = (id.to_owned(), first.place());
        return Err(element.error(SceneProblem::Duplicate { what: "id", name, first }));
    }
    element.children.iter().try_for_each(|child| collect_ids(child, ids))
}

struct Builder<'a> {
    variables: Variables,
    open: Open<'a>,
    elements: usize,
    /// The file that is read, after those that include it.
    opened: Vec<PathBuf>,
}

impl Builder<'_> {
    /// The root of a file, without `version`.
    fn file(&mut self, bytes: &[u8], path: &Path, includes: usize) -> Result<Element, Error> {
        let text = str::from_utf8(bytes).map_err(|error| {
            let source = std::io::Error::new(std::io::ErrorKind::InvalidData, error);
            Error::File { action: "read", path: path.to_path_buf(), source }
        })?;
        let xml = roxmltree::Document::parse(text)
            .map_err(|source| Error::Xml { path: path.to_path_buf(), source })?;
        let mut lines = Lines { text, offset: 0, line: 1, column: 1 };
        let file = Arc::from(path);
        self.opened.push(path.to_path_buf());
        let root = self.element(xml.root_element(), &file, &mut lines, includes, 0)?;
        self.opened.pop();
        let version = root.attribute("version").unwrap_or_default();
        // Names and meanings have been the same since 2.0.
        if !matches!(version.split('.').next(), Some("2" | "3")) {
            return Err(root.error(SceneProblem::Version { found: excerpt(version) }));
        }
        Ok(root)
    }

    fn element(
        &mut self,
        node: roxmltree::Node<'_, '_>,
        file: &Arc<Path>,
        lines: &mut Lines<'_>,
        includes: usize,
        depth: usize,
    ) -> Result<Element, Error> {
        let (line, column) = lines.place(node.range().start);
        let tag = node.tag_name().name().to_owned();
        let file = file.clone();
        let mut element = Element { tag, attributes: vec![], children: vec![], file, line, column };
        self.elements += 1;
        if self.elements > MAX_ELEMENTS {
            return Err(element.error(SceneProblem::Limit { what: "elements", limit: MAX_ELEMENTS }));
        }
        if depth > MAX_DEPTH {
            return Err(element.error(SceneProblem::Limit { what: "levels of elements", limit: MAX_DEPTH }));
        }
        for attribute in node.attributes() {
            let value = self
                .variables
                .substitute(attribute.value())
                .map_err(|name| element.error(SceneProblem::Variable { name }))?;
            element.attributes.push((attribute.name().to_owned(), value));
        }
        for child in node.children() {
            if let Some(text) = child.text().filter(|text| child.is_text() && !text.trim().is_empty()) {
                return Err(element.error(SceneProblem::Text { text: excerpt(text.trim()) }));
            }
            if !child.is_element() {
                continue;
            }
            let child = self.element(child, &element.file, lines, includes, depth + 1)?;
            match child.tag.as_str() {
                "default" => self.default(&child)?,
                "include" => self.include(&child, &mut element.children, includes)?,
                _ => element.children.push(child),
            }
        }
        Ok(element)
    }

    fn default(&mut self, element: &Element) -> Result<(), Error> {
        element.check_attributes(&["name", "value"])?;
        element.check_childless()?;
        let (name, value) = (element.required("name")?, element.required("value")?);
        if name.is_empty() {
            return Err(element.bad_value("name", name, "a name"));
        }
        self.variables.set_default(name, value);
        Ok(())
    }

    /// Puts what is in the root of another scene in the place of the element; or the root, if it is no scene.
    fn include(&mut self, element: &Element, to: &mut Vec<Element>, includes: usize) -> Result<(), Error> {
        element.check_attributes(&["filename"])?;
        element.check_childless()?;
        if includes == MAX_INCLUDES {
            let problem = SceneProblem::Limit { what: "files including one another", limit: MAX_INCLUDES };
            return Err(element.error(problem));
        }
        let path = element.beside(element.required("filename")?);
        if self.opened.contains(&path) {
            return Err(element.error(SceneProblem::Cycle { path }));
        }
        let bytes = element.open(&path, self.open)?;
        let mut root = self.file(&bytes, &path, includes + 1).map_err(|error| element.referenced(error))?;
        if root.tag == "scene" {
            root.check_attributes(&["version", "id", "name"])?;
            to.append(&mut root.children);
        } else {
            root.attributes.retain(|(name, _)| name != "version");
            to.push(root);
        }
        Ok(())
    }
}

/// Finds lines and columns of places that come in their order.
struct Lines<'a> {
    text: &'a str,
    offset: usize,
    line: usize,
    column: usize,
}

impl Lines<'_> {
    fn place(&mut self, offset: usize) -> (usize, usize) {
        for c in self.text.get(self.offset..offset).unwrap_or_default().chars() {
            if c == '\n' {
                self.line += 1;
                self.column = 1;
            } else {
                self.column += 1;
            }
        }
        self.offset = self.offset.max(offset);
        (self.line, self.column)
    }
}
