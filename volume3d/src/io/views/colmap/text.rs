//! COLMAP's text files.

use std::collections::BTreeMap;
use std::str::FromStr;

use super::model::Model;
use super::{CameraRecord, ImageRecord, Located};
use crate::io::error::excerpt;
use crate::io::{At, ViewsProblem};

/// The lines of a file, from 1, without white space around them.
fn lines(bytes: &[u8]) -> Result<impl Iterator<Item = (usize, &str)>, Located> {
    let text = str::from_utf8(bytes).map_err(|_| (At::Whole, ViewsProblem::Text))?;
    Ok(text.lines().enumerate().map(|(i, line)| (i + 1, line.trim())))
}

fn is_content(line: &str) -> bool {
    !line.is_empty() && !line.starts_with('#')
}

/// The words of a line.
struct Words<'a> {
    rest: &'a str,
    line: usize,
}

impl<'a> Words<'a> {
    fn error(&self, problem: ViewsProblem) -> Located {
        (At::Line(self.line), problem)
    }

    fn word(&mut self, what: &'static str) -> Result<&'a str, Located> {
        let rest = self.rest.trim_start();
        let end = rest.find(char::is_whitespace).unwrap_or(rest.len());
        let (word, rest) = rest.split_at(end);
        self.rest = rest;
        if word.is_empty() {
            let expected = "cameras as `ID MODEL WIDTH HEIGHT PARAMETERS`, images as `ID QW QX QY QZ TX TY TZ CAMERA NAME`";
            return Err(self.error(ViewsProblem::Missing { what: what.to_owned(), expected }));
        }
        Ok(word)
    }

    fn parse<T: FromStr>(&mut self, what: &'static str, expected: &'static str) -> Result<T, Located> {
        let word = self.word(what)?;
        word.parse().map_err(|_| {
            self.error(ViewsProblem::Value { what: what.to_owned(), found: excerpt(word), expected })
        })
    }
}

const AN_ID: &str = "a whole number from 0 to 2^32 − 1";
const A_NUMBER: &str = "a number";
const A_SIZE: &str = "a whole number of pixels, at least 1";

pub(super) fn cameras(bytes: &[u8]) -> Result<BTreeMap<u32, CameraRecord>, Located> {
    let mut cameras = BTreeMap::new();
    for (line, content) in lines(bytes)?.filter(|(_, content)| is_content(content)) {
        let mut words = Words { rest: content, line };
        let id = words.parse("the camera's number", AN_ID)?;
        let name = words.word("the camera's model")?;
        let model = Model::named(name).ok_or_else(|| {
            let (what, found) = ("the camera's model".to_owned(), excerpt(name));
            words.error(ViewsProblem::Value { what, found, expected: "a model of COLMAP, such as PINHOLE" })
        })?;
        let side = |words: &mut Words<'_>, what| {
            let side: u64 = words.parse(what, A_SIZE)?;
            let found = side.to_string();
            let error = ViewsProblem::Value { what: what.to_owned(), found, expected: A_SIZE };
            if side == 0 { Err(words.error(error)) } else { Ok(side) }
        };
        let size = (side(&mut words, "the width")?, side(&mut words, "the height")?);
        let parameter = |name: &&'static str| words.parse(name, A_NUMBER);
        let parameters = model.parameters.iter().map(parameter).collect::<Result<_, _>>()?;
        let rest = words.rest.trim();
        if !rest.is_empty() {
            let (what, found) =
                (format!("what follows the {} of the model", model.parameters.len()), excerpt(rest));
            return Err(words.error(ViewsProblem::Value { what, found, expected: "nothing" }));
        }
        let record = CameraRecord { at: At::Line(line), model, size, parameters };
        if cameras.insert(id, record).is_some() {
            return Err(words.error(ViewsProblem::Twice { what: format!("cameras {id}") }));
        }
    }
    Ok(cameras)
}

/// Images have two lines each, of which the second lists points and may be empty.
pub(super) fn images(bytes: &[u8]) -> Result<Vec<ImageRecord>, Located> {
    let mut images = vec![];
    let mut lines = lines(bytes)?;
    while let Some((line, content)) = lines.next() {
        if !is_content(content) {
            continue;
        }
        let mut words = Words { rest: content, line };
        let _id: u32 = words.parse("the image's number", AN_ID)?;
        let mut number = |what| words.parse(what, A_NUMBER);
        let quaternion = [number("QW")?, number("QX")?, number("QY")?, number("QZ")?];
        let translation = [number("TX")?, number("TY")?, number("TZ")?];
        let camera = words.parse("the camera's number", AN_ID)?;
        let name = words.rest.trim().to_owned();
        if name.is_empty() {
            words.word("the picture's name")?;
        }
        images.push(ImageRecord { at: At::Line(line), quaternion, translation, camera, name });
        lines.next();
    }
    Ok(images)
}
