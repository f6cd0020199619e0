//! Journal of a reader: notes and errors.

use std::cell::RefCell;
use std::collections::HashSet;
use std::fmt;

use super::element::Element;
use crate::io::{Error, Place};

/// Note on an interpretation that may differ from the intended one.
#[derive(Clone, Debug, PartialEq, Eq, Hash)]
pub struct Note {
    /// The element.
    pub place: Place,
    /// The interpretation.
    pub text: String,
    /// Whether geometric derivatives refer to something other than the file's shape.
    pub is_geometric: bool,
    /// Whether the image differs from Mitsuba's, or from the probable intention. Every run shows such a note.
    pub changes_image: bool,
}

impl fmt::Display for Note {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "{}: {}", self.place, self.text)
    }
}

/// Notes and errors, in order of occurrence, without duplicates.
#[derive(Debug, Default)]
pub(super) struct Journal {
    /// Whether unsupported parts are omitted or replaced, with a note.
    pub(super) is_lenient: bool,
    notes: RefCell<Vec<Note>>,
    problems: RefCell<Vec<Error>>,
    /// The set of notes, for look-up: there may be as many as elements.
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

    /// Adds a note on a difference from Mitsuba's image, or from the image that was probably meant.
    pub(super) fn note_image(&self, element: &Element, text: impl Into<String>) {
        let place = element.place();
        self.push(Note { place, text: text.into(), is_geometric: false, changes_image: true });
    }

    /// Adds a note on the geometry of a shape.
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

    /// Records an error and lets reading continue.
    pub(super) fn refuse(&self, error: Error) {
        // Many shapes may use the same material.
        if self.refused.borrow_mut().insert(error.to_string()) {
            self.problems.borrow_mut().push(error);
        }
    }

    /// The value; or `None`, with an error, or in lenient mode with a note of what is done `instead`.
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

    /// The notes; or the errors, if any.
    pub(super) fn close(&self) -> Result<Vec<Note>, Error> {
        let mut problems = self.problems.take();
        match problems.len() {
            0 => Ok(self.notes.take()),
            1 => Err(problems.remove(0)),
            _ => Err(Error::Several { problems }),
        }
    }
}
