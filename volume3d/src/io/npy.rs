//! NumPy arrays (NPY format 1.0, NEP 1).

use std::io::Write;
use std::path::Path;

use glam::DVec3;

use super::memory::with_room;
use super::{ArrayProblem, Error, files};
use crate::Image;

/// Array of numbers with a shape, the last index running fastest.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Array {
    /// The length of each axis; an image is height × width × 3.
    pub shape: Vec<usize>,
    /// The numbers.
    pub values: Vec<f64>,
}

impl From<&Image> for Array {
    /// An array of shape height × width × 3.
    fn from(image: &Image) -> Self {
        Self {
            shape: vec![image.height, image.width, 3],
            values: image.pixels.iter().flat_map(DVec3::to_array).collect(),
        }
    }
}

impl Array {
    /// The array as an image, if the shape is height × width × 3, or height × width, which becomes grey.
    #[must_use]
    pub fn to_image(&self) -> Option<Image> {
        let pixels: Vec<DVec3> = match self.shape[..] {
            [_, _, 3] => self.values.chunks_exact(3).map(DVec3::from_slice).collect(),
            [_, _] => self.values.iter().map(|&x| DVec3::splat(x)).collect(),
            _ => return None,
        };
        Some(Image { width: self.shape[1], height: self.shape[0], pixels })
    }
}

/// Storage precision.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Precision {
    /// float32.
    Single,
    /// float64.
    Double,
}

/// Reads an array of float32 or float64 in C order, of either byte order.
///
/// # Errors
/// [`Error::File`], or [`Error::Array`].
pub fn read_npy(path: &Path) -> Result<Array, Error> {
    parse_npy(&files::read(path)?, path)
}

/// [`read_npy`] from memory. `path` is for messages.
///
/// # Errors
/// [`Error::Array`].
pub fn parse_npy(bytes: &[u8], path: &Path) -> Result<Array, Error> {
    parse(bytes).map_err(|problem| Error::Array { path: path.to_path_buf(), problem })
}

/// Writes an array in C order, little-endian, atomically.
///
/// # Errors
/// [`Error::File`], or [`Error::Array`] if the shape does not match the number of values.
pub fn write_npy(path: &Path, array: &Array, precision: Precision) -> Result<(), Error> {
    let count = array.shape.iter().try_fold(1_usize, |n, &d| n.checked_mul(d));
    if count != Some(array.values.len()) {
        let expected = format!("{:?} numbers", array.shape);
        let problem = ArrayProblem::Length { expected, found: array.values.len() };
        return Err(Error::Array { path: path.to_path_buf(), problem });
    }
    let error = |source| Error::File { action: "write", path: path.to_path_buf(), source };
    files::write(path, |file| {
        let mut write = || {
            file.write_all(&header(&array.shape, precision))?;
            array.values.iter().try_for_each(|&x| match precision {
                Precision::Single => file.write_all(&(x as f32).to_le_bytes()),
                Precision::Double => file.write_all(&x.to_le_bytes()),
            })
        };
        write().map_err(error)
    })
}

const MAGIC: &[u8] = b"\x93NUMPY";

/// Alignment of the data.
const ALIGNMENT: usize = 64;

/// Maximum number of axes, as in NumPy.
const MAX_AXES: usize = 32;

fn header(shape: &[usize], precision: Precision) -> Vec<u8> {
    let descr = match precision {
        Precision::Single => "<f4",
        Precision::Double => "<f8",
    };
    let shape: String = shape.iter().map(|d| format!("{d}, ")).collect();
    let mut text =
        format!("{{'descr': '{descr}', 'fortran_order': False, 'shape': ({}), }}", shape.trim_end());
    let before = MAGIC.len() + 4;
    let length = (before + text.len() + 1).next_multiple_of(ALIGNMENT) - before;
    text.push_str(&" ".repeat(length - 1 - text.len()));
    text.push('\n');
    // At most 32 axes of 20 digits: 16 bits are enough.
    [MAGIC, &[1, 0], &(length as u16).to_le_bytes(), text.as_bytes()].concat()
}

fn parse(bytes: &[u8]) -> Result<Array, ArrayProblem> {
    match parse_either(bytes)? {
        (array, false) => Ok(array),
        _ => Err(ArrayProblem::FortranOrder),
    }
}

/// Parses an array of either order with at most two axes, and returns it in C order.
pub(super) fn parse_matrix(bytes: &[u8]) -> Result<Array, ArrayProblem> {
    let (array, fortran_order) = parse_either(bytes)?;
    match (fortran_order, &array.shape[..]) {
        (false, _) => Ok(array),
        (true, &[rows, columns]) => {
            let mut values = with_room(array.values.len(), "the array")?;
            values.extend(
                (0..rows)
                    .flat_map(|i| (0..columns).map(move |j| (i, j)))
                    .map(|(i, j)| array.values[j * rows + i]),
            );
            Ok(Array { values, ..array })
        }
        _ => Err(ArrayProblem::FortranOrder),
    }
}

/// Parses the numbers in file order, and whether this is Fortran order where that differs from C order.
fn parse_either(bytes: &[u8]) -> Result<(Array, bool), ArrayProblem> {
    let (text, data) = split(bytes).ok_or(ArrayProblem::Magic)?;
    let Header { little_endian, size, fortran_order, shape } = Header::parse(text)?;
    let length = shape.iter().try_fold(size, |n, &d| n.checked_mul(d));
    if length != Some(data.len()) {
        let expected = length.map_or_else(|| "more than 2^64 bytes".to_owned(), |n| format!("{n} bytes"));
        return Err(ArrayProblem::Length { expected, found: data.len() });
    }
    let number = |bytes: &[u8]| {
        // Big-endian numbers are byte-reversed.
        let mut le = [0; 8];
        let le = &mut le[..size];
        le.copy_from_slice(bytes);
        if !little_endian {
            le.reverse();
        }
        match *le {
            [a, b, c, d] => f64::from(f32::from_le_bytes([a, b, c, d])),
            [a, b, c, d, e, f, g, h] => f64::from_le_bytes([a, b, c, d, e, f, g, h]),
            _ => f64::NAN,
        }
    };
    let mut values = with_room(data.len() / size, "the array")?;
    values.extend(data.chunks_exact(size).map(number));
    let differs = fortran_order && shape.iter().filter(|&&d| d != 1).count() > 1;
    Ok((Array { values, shape }, differs))
}

/// Splits a file into the header's text and the data after it.
fn split(bytes: &[u8]) -> Option<(&str, &[u8])> {
    let rest = bytes.strip_prefix(MAGIC)?;
    let (&[major, _], rest) = rest.split_first_chunk()?;
    let (length, rest) = match major {
        1 => {
            let (&length, rest) = rest.split_first_chunk()?;
            (u16::from_le_bytes(length) as usize, rest)
        }
        2 | 3 => {
            let (&length, rest) = rest.split_first_chunk()?;
            (u32::from_le_bytes(length) as usize, rest)
        }
        _ => return None,
    };
    let (text, data) = rest.split_at_checked(length)?;
    Some((str::from_utf8(text).ok()?, data))
}

struct Header {
    little_endian: bool,
    /// Size of a number in bytes.
    size: usize,
    fortran_order: bool,
    shape: Vec<usize>,
}

impl Header {
    /// Parses the Python dictionary as written by NumPy, with its keys in any order.
    fn parse(text: &str) -> Result<Self, ArrayProblem> {
        let error = |expected| ArrayProblem::Header { expected };
        let text = text.trim().strip_prefix('{').and_then(|t| t.strip_suffix('}'));
        let mut rest = text.ok_or(error("{…}"))?.trim();
        let (mut descr, mut fortran_order, mut shape) = (None, None, None);
        while !rest.is_empty() {
            let (key, after) = rest.split_once(':').ok_or(error("'key': value"))?;
            let after = after.trim_start();
            let end = if after.starts_with('(') { after.find(')').map(|i| i + 1) } else { after.find(',') };
            let (value, after) = after.split_at(end.unwrap_or(after.len()));
            match unquote(key.trim()) {
                Some("descr") => {
                    descr = Some(unquote(value.trim()).ok_or(error("one type, no structure, as 'descr'"))?);
                }
                Some("fortran_order") => {
                    fortran_order = Some(match value.trim() {
                        "True" => true,
                        "False" => false,
                        _ => return Err(error("True or False as 'fortran_order'")),
                    });
                }
                Some("shape") => shape = Some(parse_shape(value).ok_or(error("(n, …) as 'shape'"))?),
                _ => return Err(error("'descr', 'fortran_order' and 'shape'")),
            }
            let after = after.trim_start();
            rest = after.strip_prefix(',').unwrap_or(after).trim_start();
        }
        let all = "'descr', 'fortran_order' and 'shape'";
        let (little_endian, size) = parse_type(descr.ok_or(error(all))?)?;
        let (fortran_order, shape) = (fortran_order.ok_or(error(all))?, shape.ok_or(error(all))?);
        Ok(Self { little_endian, size, fortran_order, shape })
    }
}

fn unquote(text: &str) -> Option<&str> {
    ['\'', '"'].iter().find_map(|&q| text.strip_prefix(q)?.strip_suffix(q))
}

fn parse_type(descr: &str) -> Result<(bool, usize), ArrayProblem> {
    match descr {
        "<f4" => Ok((true, 4)),
        "<f8" => Ok((true, 8)),
        ">f4" => Ok((false, 4)),
        ">f8" => Ok((false, 8)),
        _ => Err(ArrayProblem::Type { found: super::error::excerpt(descr) }),
    }
}

fn parse_shape(text: &str) -> Option<Vec<usize>> {
    let inner = text.trim().strip_prefix('(')?.strip_suffix(')')?.trim();
    if inner.is_empty() {
        return Some(vec![]);
    }
    let shape: Option<Vec<usize>> =
        inner.strip_suffix(',').unwrap_or(inner).split(',').map(|d| d.trim().parse().ok()).collect();
    shape.filter(|s| s.len() <= MAX_AXES)
}
