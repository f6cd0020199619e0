//! What is told about a scene besides what it holds: notes of how it was read, and all that is refused.

use std::cell::RefCell;
use std::collections::HashSet;
use std::fmt;

use super::element::Element;
use crate::io::{Error, Place};

/// Something about a scene that was read in another way than it may have been meant, and how.
#[derive(Clone, Debug, PartialEq, Eq, Hash)]
pub struct Note {
    /// The element.
    pub place: Place,
    /// What was done with it.
    pub text: String,
    /// Whether derivatives by the geometry of a shape are those of something else than what the file says.
    pub is_geometric: bool,
    /// Whether the image is another one than Mitsuba's: such a note is for every run.
    pub changes_image: bool,
}

impl fmt::Display for Note {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "{}: {}", self.place, self.text)
    }
}

/// Notes and refusals, in the order in which they come up, each once.
#[derive(Debug, Default)]
pub(super) struct Journal {
    /// Whether what is refused is left out or replaced, and noted.
    pub(super) is_lenient: bool,
    notes: RefCell<Vec<Note>>,
    problems: RefCell<Vec<Error>>,
    /// The same for looking up: there may be as many as elements.
    noted: RefCell<HashSet<Note>>,
    refused: RefCell<HashSet<String>>,
}

impl Journal {
    pub(super) fn new(is_lenient: bool) -> Self {
        Self { is_lenient, ..Self::default() }
    }

    pub(super) fn note(&self, element: &Element, text: impl Into<String>) {
        self.push(Note {
            place: element.place(),
            text: text.into(),
            is_geometric: false,
            changes_image: false,
        });
    }

    /// A note on what makes the image another one than Mitsuba's.
    pub(super) fn note_image(&self, element: &Element, text: impl Into<String>) {
        let place = element.place();
        self.push(Note { place, text: text.into(), is_geometric: false, changes_image: true });
    }

    /// A note on what the geometry of a shape is.
    pub(super) fn note_shape(&self, element: &Element, text: impl Into<String>) {
        self.push(Note {
            place: element.place(),
            text: text.into(),
            is_geometric: true,
            changes_image: false,
        });
    }

    fn push(&self, note: Note) {
        if self.noted.borrow_mut().insert(note.clone()) {
            self.notes.borrow_mut().push(note);
        }
    }

    /// A refusal that does not keep the rest from being looked at.
    pub(super) fn refuse(&self, error: Error) {
        // The same material may be asked for by many shapes.
        if self.refused.borrow_mut().insert(error.to_string()) {
            self.problems.borrow_mut().push(error);
        }
    }

    /// A value; or nothing, with a refusal, or leniently with a note of what is done `instead`.
    pub(super) fn accept<T>(&self, result: Result<T, Error>, element: &Element, instead: &str) -> Option<T> {
        let error = match result {
            Ok(value) => return Some(value),
            Err(error) => error,
        };
        if self.is_lenient {
            self.note(element, format!("{instead}, because: {error}"));
        } else {
            self.refuse(error);
        }
        None
    }

    /// What has been noted; or what was refused.
    pub(super) fn close(&self) -> Result<Vec<Note>, Error> {
        let mut problems = self.problems.take();
        match problems.len() {
            0 => Ok(self.notes.take()),
            1 => Err(problems.remove(0)),
            _ => Err(Error::Several { problems }),
        }
    }
}
