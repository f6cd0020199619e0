//! PLY body: the numbers after the header.

use super::Failure;
use super::header::Kind;
use crate::io::error::excerpt;
use crate::io::{At, MeshProblem};

/// A source of numbers.
pub(super) trait Body {
    /// Begins an element: the following numbers belong to it.
    fn begin(&mut self, element: &str, index: usize);

    /// The location of the last number.
    fn place(&self) -> At;

    /// Upper bound on the number of remaining numbers.
    fn remaining(&self) -> usize;

    /// The next number.
    fn number(&mut self, kind: Kind) -> Result<f64, Failure>;

    /// The next number, which must be an integer.
    fn integer(&mut self, kind: Kind) -> Result<i64, Failure>;

    /// Checks that nothing follows.
    fn finish(&mut self) -> Result<(), Failure>;
}

/// ASCII numbers, separated by white space. Line ends are not significant.
pub(super) struct Ascii<'a> {
    rest: &'a [u8],
    line: usize,
    element: (String, usize),
}

impl<'a> Ascii<'a> {
    /// The body after a header of `lines` lines.
    pub(super) fn new(rest: &'a [u8], lines: usize) -> Self {
        Self { rest, line: lines + 1, element: (String::new(), 0) }
    }

    /// Skips white space.
    fn skip_space(&mut self) {
        let space = self.rest.iter().position(|b| !b.is_ascii_whitespace()).unwrap_or(self.rest.len());
        self.line += self.rest[..space].iter().filter(|&&b| b == b'\n').count();
        self.rest = &self.rest[space..];
    }

    fn word(&mut self) -> Result<&'a [u8], Failure> {
        self.skip_space();
        let end = self.rest.iter().position(u8::is_ascii_whitespace).unwrap_or(self.rest.len());
        let (word, rest) = self.rest.split_at(end);
        self.rest = rest;
        if word.is_empty() {
            let (name, index) = &self.element;
            return Err((
                self.place(),
                MeshProblem::Truncated { what: format!("the end of {name} {index}") },
            ));
        }
        Ok(word)
    }

    fn parse<T: std::str::FromStr>(&mut self, expected: &'static str) -> Result<T, Failure> {
        let word = self.word()?;
        str::from_utf8(word).ok().and_then(|w| w.parse().ok()).ok_or_else(|| {
            let found = excerpt(&String::from_utf8_lossy(word));
            (self.place(), MeshProblem::Expected { expected, found })
        })
    }
}

impl Body for Ascii<'_> {
    fn begin(&mut self, element: &str, index: usize) {
        if self.element.0 != element {
            element.clone_into(&mut self.element.0);
        }
        self.element.1 = index;
    }

    fn place(&self) -> At {
        At::Line(self.line)
    }

    fn remaining(&self) -> usize {
        // A digit and a space each.
        self.rest.len().div_ceil(2)
    }

    fn number(&mut self, _: Kind) -> Result<f64, Failure> {
        self.parse("a number")
    }

    fn integer(&mut self, _: Kind) -> Result<i64, Failure> {
        self.parse("a whole number")
    }

    fn finish(&mut self) -> Result<(), Failure> {
        self.skip_space();
        match self.rest.len() {
            0 => Ok(()),
            bytes => Err((self.place(), MeshProblem::Trailing { bytes })),
        }
    }
}

/// Binary numbers of fixed size.
pub(super) struct Binary<'a, const LITTLE: bool> {
    rest: &'a [u8],
    element: (String, usize),
}

impl<'a, const LITTLE: bool> Binary<'a, LITTLE> {
    pub(super) fn new(rest: &'a [u8]) -> Self {
        Self { rest, element: (String::new(), 0) }
    }

    fn take<const N: usize>(&mut self) -> Result<[u8; N], Failure> {
        let Some((bytes, rest)) = self.rest.split_first_chunk::<N>() else {
            return Err((
                self.place(),
                MeshProblem::Truncated { what: "the end of this element".to_owned() },
            ));
        };
        self.rest = rest;
        let mut bytes = *bytes;
        if !LITTLE {
            bytes.reverse();
        }
        Ok(bytes)
    }
}

impl<const LITTLE: bool> Body for Binary<'_, LITTLE> {
    fn begin(&mut self, element: &str, index: usize) {
        if self.element.0 != element {
            element.clone_into(&mut self.element.0);
        }
        self.element.1 = index;
    }

    fn place(&self) -> At {
        let (name, index) = &self.element;
        At::Item(name.clone(), *index)
    }

    fn remaining(&self) -> usize {
        self.rest.len()
    }

    fn number(&mut self, kind: Kind) -> Result<f64, Failure> {
        match kind {
            Kind::F32 => self.take().map(f32::from_le_bytes).map(f64::from),
            Kind::F64 => self.take().map(f64::from_le_bytes),
            // At most 32 bits.
            _ => self.integer(kind).map(|i| i as f64),
        }
    }

    fn integer(&mut self, kind: Kind) -> Result<i64, Failure> {
        match kind {
            Kind::I8 => self.take().map(i8::from_le_bytes).map(i64::from),
            Kind::U8 => self.take().map(u8::from_le_bytes).map(i64::from),
            Kind::I16 => self.take().map(i16::from_le_bytes).map(i64::from),
            Kind::U16 => self.take().map(u16::from_le_bytes).map(i64::from),
            Kind::I32 => self.take().map(i32::from_le_bytes).map(i64::from),
            Kind::U32 => self.take().map(u32::from_le_bytes).map(i64::from),
            Kind::F32 | Kind::F64 => {
                let found = self.number(kind)?.to_string();
                Err((self.place(), MeshProblem::Expected { expected: "a whole number", found }))
            }
        }
    }

    fn finish(&mut self) -> Result<(), Failure> {
        // Some programs end every file with a line break.
        match self.rest.trim_ascii().len() {
            0 => Ok(()),
            bytes => Err((At::Whole, MeshProblem::Trailing { bytes })),
        }
    }
}
