//! Elements of scene files.

use std::cell::OnceCell;
use std::io::ErrorKind;
use std::path::{Path, PathBuf};
use std::sync::Arc;

use super::folders::Folders;
use crate::io::error::excerpt;
use crate::io::{At, Error, Place, SceneProblem};

/// Callback that reads other files.
pub(super) type Open<'a> = &'a dyn Fn(&Path) -> std::io::Result<Vec<u8>>;

/// XML element: its attributes, children and location.
#[derive(Debug)]
pub(super) struct Element {
    pub(super) tag: String,
    pub(super) attributes: Vec<(String, String)>,
    pub(super) children: Vec<Element>,
    file: Arc<Path>,
    line: usize,
    column: usize,
    /// The path of the file that it references, once found.
    found: OnceCell<PathBuf>,
}

impl Element {
    pub(super) fn new(tag: &str, file: &Arc<Path>, (line, column): (usize, usize)) -> Self {
        let (tag, file) = (tag.to_owned(), file.clone());
        Self { tag, attributes: vec![], children: vec![], file, line, column, found: OnceCell::new() }
    }

    /// A new element at the location of this one.
    pub(super) fn another(&self, tag: &str, attributes: &[(&str, String)]) -> Self {
        let mut element = Self::new(tag, &self.file, (self.line, self.column));
        element.attributes =
            attributes.iter().map(|(name, value)| ((*name).to_owned(), value.clone())).collect();
        element
    }

    /// A copy of the element.
    pub(super) fn copy(&self) -> Self {
        let mut element = Self::new(&self.tag, &self.file, (self.line, self.column));
        element.attributes.clone_from(&self.attributes);
        element.children = self.children.iter().map(Self::copy).collect();
        element
    }

    /// The file that contains it.
    pub(super) fn file(&self) -> &Arc<Path> {
        &self.file
    }

    pub(super) fn attribute(&self, name: &str) -> Option<&str> {
        self.attributes.iter().find(|(n, _)| n == name).map(|(_, value)| value.as_str())
    }

    /// Whether it is a parameter with the same kind and value as another one.
    pub(super) fn says_the_same(&self, other: &Self) -> bool {
        let is_value = |e: &Self| e.children.is_empty() && e.attribute("value").is_some();
        self.tag == other.tag && is_value(self) && is_value(other) && self.attributes == other.attributes
    }

    /// A required attribute.
    pub(super) fn required(&self, attribute: &'static str) -> Result<&str, Error> {
        let missing = || SceneProblem::MissingAttribute { tag: self.tag.clone(), attribute };
        self.attribute(attribute).ok_or_else(|| self.error(missing()))
    }

    /// The value of a parameter.
    pub(super) fn value_of(&self, name: &str) -> Option<&str> {
        self.children.iter().find(|c| c.attribute("name") == Some(name))?.attribute("value")
    }

    /// Refuses all other attributes.
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

    /// An error in a file that this element references.
    pub(super) fn referenced(&self, source: Error) -> Error {
        Error::Referenced { place: self.place(), source: Box::new(source) }
    }

    /// The path of the referenced file; before it is searched, a path next to the file of this element.
    pub(super) fn beside(&self, name: &str) -> PathBuf {
        let beside = || self.file.parent().unwrap_or(Path::new("")).join(name);
        self.found.get().cloned().unwrap_or_else(beside)
    }

    /// Finds and reads a file that this element references.
    pub(super) fn open(
        &self,
        name: &str,
        folders: &Folders,
        open: Open<'_>,
    ) -> Result<(PathBuf, Vec<u8>), Error> {
        let candidates = folders.candidates(name, &self.file);
        for path in &candidates {
            match open(path) {
                Ok(bytes) => {
                    self.found.get_or_init(|| path.clone());
                    return Ok((path.clone(), bytes));
                }
                Err(error) if matches!(error.kind(), ErrorKind::NotFound | ErrorKind::NotADirectory) => {
                    if candidates.len() == 1 {
                        let path = path.clone();
                        return Err(self.referenced(Error::File { action: "read", path, source: error }));
                    }
                }
                Err(source) => {
                    let path = path.clone();
                    return Err(self.referenced(Error::File { action: "read", path, source }));
                }
            }
        }
        let tried: Vec<String> = candidates.iter().map(|path| path.display().to_string()).collect();
        Err(self.error(SceneProblem::NotFound { name: name.to_owned(), tried: tried.join(", ") }))
    }
}
