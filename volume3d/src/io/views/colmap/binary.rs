//! COLMAP's binary files, little-endian.
//!
//! `cameras.bin`: their number (64 bits), and for each its id and model (32 bits), width and height (64
//! bits) and parameters (double). `images.bin`: their number (64 bits), and for each its id (32 bits),
//! quaternion and translation (double), camera (32 bits), name that ends in a zero byte, number of points
//! (64 bits) and 24 bytes for each point.

use std::collections::BTreeMap;

use super::model::Model;
use super::{CameraRecord, ImageRecord, Located};
use crate::io::{At, ViewsProblem};

/// Bytes of a point in an image.
const POINT: usize = 24;

/// The rest of a file, and the item that is read.
struct Bytes<'a> {
    rest: &'a [u8],
    at: At,
    what: String,
}

impl<'a> Bytes<'a> {
    fn new(rest: &'a [u8]) -> Self {
        Self { rest, at: At::Whole, what: "its number of items".to_owned() }
    }

    /// The next item is this one.
    fn begin(&mut self, name: &str, index: u64, count: u64) {
        self.at = At::Item(name.to_owned(), usize::try_from(index).unwrap_or(usize::MAX));
        self.what = format!("{name} {index} (from 0) of {count}");
    }

    fn error(&self, problem: ViewsProblem) -> Located {
        (self.at.clone(), problem)
    }

    fn truncated(&self) -> Located {
        (At::Whole, ViewsProblem::Truncated { what: self.what.clone() })
    }

    fn take<const N: usize>(&mut self) -> Result<[u8; N], Located> {
        let (bytes, rest) = self.rest.split_first_chunk().ok_or_else(|| self.truncated())?;
        self.rest = rest;
        Ok(*bytes)
    }

    fn u32(&mut self) -> Result<u32, Located> {
        self.take().map(u32::from_le_bytes)
    }

    fn u64(&mut self) -> Result<u64, Located> {
        self.take().map(u64::from_le_bytes)
    }

    fn f64(&mut self) -> Result<f64, Located> {
        self.take().map(f64::from_le_bytes)
    }

    /// Text that ends in a zero byte.
    fn name(&mut self) -> Result<String, Located> {
        let end = self.rest.iter().position(|b| *b == 0).ok_or_else(|| self.truncated())?;
        let name = str::from_utf8(&self.rest[..end]).map_err(|_| self.error(ViewsProblem::Text))?;
        self.rest = &self.rest[end + 1..];
        Ok(name.to_owned())
    }

    fn skip(&mut self, bytes: Option<usize>) -> Result<(), Located> {
        let rest = bytes.and_then(|bytes| self.rest.get(bytes..));
        self.rest = rest.ok_or_else(|| self.truncated())?;
        Ok(())
    }

    fn end(&self, what: &'static str) -> Result<(), Located> {
        match self.rest.len() {
            0 => Ok(()),
            bytes => Err((At::Whole, ViewsProblem::Trailing { bytes, what })),
        }
    }
}

pub(super) fn cameras(bytes: &[u8]) -> Result<BTreeMap<u32, CameraRecord>, Located> {
    let mut bytes = Bytes::new(bytes);
    let count = bytes.u64()?;
    let mut cameras = BTreeMap::new();
    for index in 0..count {
        bytes.begin("camera", index, count);
        let id = bytes.u32()?;
        let number = bytes.take().map(i32::from_le_bytes)?;
        let wrong = |bytes: &Bytes<'_>, what: &str, found: String, expected| {
            bytes.error(ViewsProblem::Value { what: what.to_owned(), found, expected })
        };
        let model = Model::numbered(number)
            .ok_or_else(|| wrong(&bytes, "the model", number.to_string(), "the number of one, 0 to 11"))?;
        let size = (bytes.u64()?, bytes.u64()?);
        if size.0 == 0 || size.1 == 0 {
            return Err(wrong(&bytes, "the size", format!("{}×{}", size.0, size.1), "at least one pixel"));
        }
        let parameters = model.parameters.iter().map(|_| bytes.f64()).collect::<Result<_, _>>()?;
        let record = CameraRecord { at: bytes.at.clone(), model, size, parameters };
        if cameras.insert(id, record).is_some() {
            return Err(bytes.error(ViewsProblem::Twice { what: format!("cameras {id}") }));
        }
    }
    bytes.end("camera")?;
    Ok(cameras)
}

pub(super) fn images(bytes: &[u8]) -> Result<Vec<ImageRecord>, Located> {
    let mut bytes = Bytes::new(bytes);
    let count = bytes.u64()?;
    let mut images = vec![];
    for index in 0..count {
        bytes.begin("image", index, count);
        bytes.u32()?;
        let quaternion = [bytes.f64()?, bytes.f64()?, bytes.f64()?, bytes.f64()?];
        let translation = [bytes.f64()?, bytes.f64()?, bytes.f64()?];
        let camera = bytes.u32()?;
        let name = bytes.name()?;
        let points = usize::try_from(bytes.u64()?).ok();
        bytes.skip(points.and_then(|points| points.checked_mul(POINT)))?;
        images.push(ImageRecord { at: bytes.at.clone(), quaternion, translation, camera, name });
    }
    bytes.end("image")?;
    Ok(images)
}
