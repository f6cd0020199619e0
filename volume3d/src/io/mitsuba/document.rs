//! Scene document: a scene file with its includes, `$name`s substituted and older versions upgraded.

use std::collections::HashMap;
use std::path::{Path, PathBuf};
use std::rc::Rc;
use std::sync::Arc;

use super::animation;
use super::element::{Element, Open};
use super::folders::{Folders, MOST_FOLDERS};
use super::journal::Journal;
use super::spectrum::CONSTANT;
use super::transform;
use super::upgrade;
use super::variables::{MOST_TEXT, Problem, Variables};
use crate::io::error::excerpt;
use crate::io::{At, Error, Place, SceneProblem};

/// Maximum depth of includes, as in Mitsuba.
const MAX_INCLUDES: usize = 15;
/// Maximum nesting of elements; scenes need six.
const MAX_DEPTH: usize = 64;
/// Maximum number of elements, so that a file that includes itself twice does not exhaust the memory.
const MAX_ELEMENTS: usize = 1_000_000;

/// A scene with all its includes.
#[derive(Debug)]
pub(super) struct Document {
    pub(super) root: Element,
    pub(super) folders: Folders,
    pub(super) journal: Rc<Journal>,
    aliases: Vec<Element>,
}

impl Document {
    pub(super) fn parse(
        bytes: &[u8],
        path: &Path,
        variables: Variables,
        open: Open<'_>,
        journal: Rc<Journal>,
    ) -> Result<Self, Error> {
        let folders = Folders::new(path);
        let mut builder =
            Builder { variables, open, folders, journal, elements: 0, opened: vec![], aliases: vec![] };
        let mut root = builder.file(bytes, path, 0)?;
        if root.tag != "scene" {
            return Err(root.error(SceneProblem::Tag {
                tag: root.tag.clone(),
                parent: "the file".to_owned(),
                supported: "<scene>".to_owned(),
            }));
        }
        root.check_attributes(&["version", "id", "name"])?;
        if let Some(name) = builder.variables.unused() {
            return Err(root.error(SceneProblem::UnusedVariable { name: name.to_owned() }));
        }
        let Builder { folders, journal, aliases, .. } = builder;
        animation::stop(&mut root, &journal);
        transform::note_axes(&root, &journal);
        Ok(Self { root, folders, journal, aliases })
    }

    /// All elements with an id.
    pub(super) fn by_id(&self) -> Result<HashMap<&str, &Element>, Error> {
        let mut ids = HashMap::new();
        collect_ids(&self.root, &mut ids)?;
        for alias in &self.aliases {
            alias.check_attributes(&["id", "as"])?;
            let (id, other) = (alias.required("id")?, alias.required("as")?);
            let Some(&element) = ids.get(id) else {
                let known = "the elements before the alias".to_owned();
                return Err(alias.error(SceneProblem::Reference { id: id.to_owned(), known }));
            };
            if let Some(first) = ids.insert(other, element) {
                let (name, first) = (other.to_owned(), first.place());
                return Err(alias.error(SceneProblem::Duplicate { what: "id", name, first }));
            }
        }
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
    folders: Folders,
    journal: Rc<Journal>,
    aliases: Vec<Element>,
    elements: usize,
    /// The current file, after those that include it.
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
        let lines = Lines { text, offset: 0, line: 1, column: 1 };
        let root = xml.root_element();
        let version = root.attribute("version").unwrap_or_default();
        let major = version.split('.').next().and_then(|major| major.parse().ok());
        let mut file =
            File { path: Arc::from(path), lines, is_old: major.is_some_and(|major: u32| major < 2) };
        if major.is_none_or(|major| major > 3) {
            let (line, column) = file.lines.place(root.range().start);
            let problem = Box::new(SceneProblem::Version { found: excerpt(version) });
            return Err(Error::Scene { place: Place::new(path, At::Column(line, column)), problem });
        }
        self.opened.push(path.to_path_buf());
        let root = self.element(root, &mut file, includes, 0)?;
        self.opened.pop();
        if file.is_old {
            let text = format!(
                "version {version} is read as its upgrade to 2.0: names in camelCase, uscale and the like"
            );
            self.journal.note(&root, text);
        }
        Ok(root)
    }

    fn element(
        &mut self,
        node: roxmltree::Node<'_, '_>,
        file: &mut File<'_>,
        includes: usize,
        depth: usize,
    ) -> Result<Element, Error> {
        let place = file.lines.place(node.range().start);
        let mut element = Element::new(node.tag_name().name(), &file.path, place);
        self.elements += 1;
        if self.elements > MAX_ELEMENTS {
            return Err(element.error(SceneProblem::Limit { what: "elements", limit: MAX_ELEMENTS }));
        }
        if depth > MAX_DEPTH {
            return Err(element.error(SceneProblem::Limit { what: "levels of elements", limit: MAX_DEPTH }));
        }
        for attribute in node.attributes() {
            let value = self.variables.substitute(attribute.value()).map_err(|problem| {
                element.error(match problem {
                    Problem::Unknown(name) => SceneProblem::Variable { name },
                    Problem::TooLong => {
                        SceneProblem::Limit { what: "bytes of values of $names", limit: MOST_TEXT }
                    }
                })
            })?;
            element.attributes.push((attribute.name().to_owned(), value));
        }
        if element.tag == "spectrum" && element.attribute("filename").is_some() {
            self.spectrum(&mut element)?;
        }
        if file.is_old {
            upgrade::names(&mut element);
        }
        for child in node.children() {
            if let Some(text) = child.text().filter(|text| child.is_text() && !text.trim().is_empty()) {
                return Err(element.error(SceneProblem::Text { text: excerpt(text.trim()) }));
            }
            if !child.is_element() {
                continue;
            }
            let child = self.element(child, file, includes, depth + 1)?;
            match child.tag.as_str() {
                "default" => self.default(&child)?,
                "include" => self.include(&child, &mut element.children, includes)?,
                "path" => self.path(&child)?,
                "alias" => self.aliases.push(child),
                _ => element.children.push(child),
            }
        }
        if file.is_old {
            upgrade::parameters(&mut element)?;
        }
        if element.tag == "texture" && element.attribute("type").is_some_and(|t| CONSTANT.contains(&t)) {
            "spectrum".clone_into(&mut element.tag);
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

    /// Replaces the name of a spectrum file, with a wavelength and a value per line, by its content.
    fn spectrum(&self, element: &mut Element) -> Result<(), Error> {
        let name = element.required("filename")?;
        let (path, bytes) = element.open(name, &self.folders, self.open)?;
        let lines = String::from_utf8_lossy(&bytes);
        let mut pairs = vec![];
        for (i, line) in lines.lines().map(str::trim).enumerate() {
            if line.is_empty() || line.starts_with('#') {
                continue;
            }
            let [wavelength, value] = line.split_whitespace().collect::<Vec<_>>()[..] else {
                let (value, expected) = (excerpt(line), "a wavelength and a value");
                let problem = Box::new(SceneProblem::Value { name: "line".to_owned(), value, expected });
                let place = Place::new(&path, At::Line(i + 1));
                return Err(element.referenced(Error::Scene { place, problem }));
            };
            pairs.push(format!("{wavelength}:{value}"));
        }
        element.attributes.retain(|(name, _)| name != "filename");
        element.attributes.push(("value".to_owned(), pairs.join(" ")));
        Ok(())
    }

    /// Adds a search folder.
    fn path(&mut self, element: &Element) -> Result<(), Error> {
        element.check_attributes(&["value"])?;
        element.check_childless()?;
        if self.folders.add(element.required("value")?, element.file()) {
            return Ok(());
        }
        Err(element.error(SceneProblem::Limit { what: "folders to look for files in", limit: MOST_FOLDERS }))
    }

    /// Replaces the element by the children of another scene's root; or by the root, if it is not a scene.
    fn include(&mut self, element: &Element, to: &mut Vec<Element>, includes: usize) -> Result<(), Error> {
        element.check_attributes(&["filename", "name"])?;
        element.check_childless()?;
        if includes == MAX_INCLUDES {
            let problem = SceneProblem::Limit { what: "files including one another", limit: MAX_INCLUDES };
            return Err(element.error(problem));
        }
        let name = element.required("filename")?;
        let likeliest = self.folders.candidates(name, element.file()).swap_remove(0);
        if self.opened.contains(&likeliest) {
            return Err(element.error(SceneProblem::Cycle { path: likeliest }));
        }
        let (path, bytes) = element.open(name, &self.folders, self.open)?;
        if self.opened.contains(&path) {
            return Err(element.error(SceneProblem::Cycle { path }));
        }
        let mut root = self.file(&bytes, &path, includes + 1).map_err(|error| element.referenced(error))?;
        if root.tag == "scene" {
            root.check_attributes(&["version", "id", "name"])?;
            to.append(&mut root.children);
        } else {
            root.attributes.retain(|(name, _)| name != "version");
            if let Some(name) = element.attribute("name") {
                root.attributes.retain(|(name, _)| name != "name");
                root.attributes.push(("name".to_owned(), name.to_owned()));
            }
            to.push(root);
        }
        Ok(())
    }
}

/// The file being read.
struct File<'a> {
    path: Arc<Path>,
    lines: Lines<'a>,
    /// Whether its version is below 2.
    is_old: bool,
}

/// Line and column look-up for increasing positions.
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
