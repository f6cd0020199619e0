//! Tests of the readers and writers.

mod animation;
mod attributes;
mod clip;
mod deviations;
mod dialects;
mod dtu;
mod files;
mod fuzz;
mod image;
mod layers;
mod materials;
mod media;
mod mirrors;
mod names;
mod network;
mod npy;
mod obj;
mod ply;
mod polygon;
mod scene;
mod scene_errors;
mod scene_versions;
mod sdf;
mod serialized;
mod views;
mod write_scene;

use std::io::{Cursor, Write as _};
use std::path::Path;

use ::image::{DynamicImage, ImageFormat};

use super::Error;
use super::error::excerpt;

/// The message of an expected error.
fn message<T: std::fmt::Debug>(result: Result<T, Error>) -> String {
    match result {
        Ok(value) => panic!("accepted as {}", excerpt(&format!("{value:?}"))),
        Err(error) => error.to_string(),
    }
}

/// Checks that each call fails with its message, and lists all that do not.
fn check_messages(cases: &[(String, &str)]) {
    let wrong: Vec<_> = cases.iter().filter(|(found, expected)| found != expected).collect();
    for (found, expected) in &wrong {
        eprintln!("found    {found}\nexpected {expected}\n");
    }
    assert!(wrong.is_empty(), "{} of {} messages differ", wrong.len(), cases.len());
}

/// Checks that each input of a table is refused with the message that follows it on an indented line.
fn check_table(table: &str, refused: impl Fn(&str) -> String) {
    let (mut cases, mut input) = (vec![], vec![]);
    for line in table.lines().skip(1) {
        match line.strip_prefix("    ") {
            Some(expected) => cases.push((refused(&std::mem::take(&mut input).join("\n")), expected)),
            None => input.push(line),
        }
    }
    assert!(!cases.is_empty() && input.is_empty(), "{table}");
    check_messages(&cases);
}

fn here(name: &str) -> &Path {
    Path::new(name)
}

/// An image as a file.
fn encoded(format: ImageFormat, image: impl Into<DynamicImage>) -> Vec<u8> {
    let mut bytes = vec![];
    image.into().write_to(&mut Cursor::new(&mut bytes), format).unwrap();
    bytes
}

fn gzipped(bytes: &[u8]) -> Vec<u8> {
    let mut encoder = flate2::write::GzEncoder::new(vec![], flate2::Compression::fast());
    encoder.write_all(bytes).unwrap();
    encoder.finish().unwrap()
}
