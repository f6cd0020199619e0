//! PLY attributes: numbers at vertices or faces other than positions, normals or texture coordinates.

use std::path::Path;

use glam::DVec3;

use super::body::{Ascii, Binary, Body};
use super::header::{self, Element, Encoding, Header, Kind, Property};
use super::{Failure, length, room, skip, skip_property};
use crate::io::error::excerpt;
use crate::io::memory::with_room;
use crate::io::{At, Error, MemoryError, MeshProblem, Place};

/// Properties of `vertex` that are not attributes.
const NO_ATTRIBUTES: [&str; 12] =
    ["x", "y", "z", "nx", "ny", "nz", "u", "v", "s", "t", "texture_u", "texture_v"];

/// A number or a colour for each vertex of the file, or for each of its triangles.
#[derive(Debug, PartialEq)]
pub(in crate::io) enum PlyAttribute {
    Vertices(Vec<DVec3>),
    Faces(Vec<DVec3>),
}

/// Reads the attribute of a name by Mitsuba's convention: `vertex_` or `face_`, and the common stem of its
/// properties before `_x`, `_r`, `_0` or the like. Red, green and blue are `color`, or end in it. The
/// suffixes give the order of the numbers, in whatever order they are declared. A single number is grey, and
/// its property may have no suffix. An opacity is ignored. Integer colours are fractions of the largest
/// integer, and not otherwise converted.
///
/// # Errors
/// [`Error::Mesh`], also if the file has no attribute of this name, or two properties for one of its numbers.
pub(in crate::io) fn read_attribute(bytes: &[u8], path: &Path, name: &str) -> Result<PlyAttribute, Error> {
    let error = |(at, problem)| Error::Mesh { place: Place::new(path, at), problem };
    let (header, rest, lines) = header::parse(bytes).map_err(error)?;
    let mut body: Box<dyn Body> = match header.encoding {
        Encoding::Ascii => Box::new(Ascii::new(rest, lines)),
        Encoding::LittleEndian => Box::new(Binary::<true>::new(rest)),
        Encoding::BigEndian => Box::new(Binary::<false>::new(rest)),
    };
    attribute(&header, &mut *body, name).map_err(error)
}

/// The indices of an attribute's numbers among the properties of its element, with their factors.
type Columns = Vec<(usize, f64)>;

fn attribute(header: &Header, body: &mut dyn Body, name: &str) -> Result<PlyAttribute, Failure> {
    let found = header.elements.iter().enumerate().find_map(|(index, element)| {
        let columns = match element.name.as_str() {
            "vertex" => columns(element, name.strip_prefix("vertex_")?),
            "face" => columns(element, name.strip_prefix("face_")?),
            _ => return None,
        };
        columns.transpose().map(|columns| (index, columns))
    });
    let Some((index, columns)) = found else {
        let known = header.elements.iter().flat_map(known).collect::<Vec<_>>().join(", ");
        let known = if known.is_empty() { "no attribute".to_owned() } else { known };
        return Err((At::Whole, MeshProblem::Attribute { name: name.to_owned(), known }));
    };
    let columns = columns?;
    for element in &header.elements[..index] {
        skip(element, body)?;
    }
    let element = &header.elements[index];
    let values = with_room(room(element, body), "an attribute")
        .map_err(|error: MemoryError| (At::Whole, error.into()))?;
    if element.name == "vertex" {
        vertices(element, body, &columns, values).map(PlyAttribute::Vertices)
    } else {
        faces(element, body, &columns, values).map(PlyAttribute::Faces)
    }
}

/// The role of a property in an attribute.
struct Channel {
    /// The attribute's name without `vertex_` or `face_`.
    stem: String,
    /// The index of the number; 3 is an opacity.
    slot: usize,
    is_colour: bool,
}

fn channel(property: &Property) -> Option<Channel> {
    if property.list.is_some() || NO_ATTRIBUTES.contains(&property.name.as_str()) {
        return None;
    }
    let slot = |ends: [&[&str]; 4], end: &str| ends.iter().position(|ends| ends.contains(&end));
    let colour = |end| slot([&["r", "red"], &["g", "green"], &["b", "blue"], &["a", "alpha"]], end);
    let number = |end| slot([&["x", "0"], &["y", "1"], &["z", "2"], &["w", "3"]], end);
    if let Some(slot) = colour(&property.name) {
        return Some(Channel { stem: "color".to_owned(), slot, is_colour: true });
    }
    if let Some((stem, end)) = property.name.rsplit_once('_') {
        if let Some(slot) = colour(end) {
            return Some(Channel { stem: format!("{stem}_color"), slot, is_colour: true });
        }
        if let Some(slot) = number(end) {
            return Some(Channel { stem: stem.to_owned(), slot, is_colour: false });
        }
    }
    Some(Channel { stem: property.name.clone(), slot: 0, is_colour: false })
}

/// The names of an element's attributes.
fn known(element: &Element) -> Vec<String> {
    let mut names: Vec<String> = vec![];
    if matches!(element.name.as_str(), "vertex" | "face") {
        for Channel { stem, .. } in element.properties.iter().filter_map(channel) {
            let name = format!("{}_{stem}", element.name);
            if columns(element, &stem).is_ok_and(|found| found.is_some()) && !names.contains(&name) {
                names.push(name);
            }
        }
    }
    names
}

/// The first number alone, or the first three; `None` for other combinations.
fn columns(element: &Element, name: &str) -> Result<Option<Columns>, Failure> {
    let mut found: [Option<(usize, f64)>; 4] = [None; 4];
    for (index, property) in element.properties.iter().enumerate() {
        let Some(Channel { slot, is_colour, .. }) = channel(property).filter(|c| c.stem == name) else {
            continue;
        };
        let scale = if is_colour { 1.0 / largest(property.value) } else { 1.0 };
        if found[slot].replace((index, scale)).is_some() {
            let (expected, found) = ("each number of an attribute once", excerpt(&property.name));
            return Err((At::Line(property.line), MeshProblem::Expected { expected, found }));
        }
    }
    Ok(match found {
        [Some(grey), None, None, None] => Some(vec![grey]),
        [Some(r), Some(g), Some(b), _] => Some(vec![r, g, b]),
        _ => None,
    })
}

/// The largest number of a colour.
fn largest(kind: Kind) -> f64 {
    match kind {
        Kind::I8 => f64::from(i8::MAX),
        Kind::U8 => f64::from(u8::MAX),
        Kind::I16 => f64::from(i16::MAX),
        Kind::U16 => f64::from(u16::MAX),
        Kind::I32 => f64::from(i32::MAX),
        Kind::U32 => f64::from(u32::MAX),
        Kind::F32 | Kind::F64 => 1.0,
    }
}

/// The value of one vertex or face, and the number of its corners.
fn value(
    element: &Element,
    body: &mut dyn Body,
    columns: &[(usize, f64)],
) -> Result<(DVec3, usize), Failure> {
    let mut numbers = [0.0; 3];
    let mut corners = 0;
    for (index, property) in element.properties.iter().enumerate() {
        if property.is_indices() {
            corners = length(property, body)?;
            for _ in 0..corners {
                body.number(property.value)?;
            }
        } else if let Some(slot) = columns.iter().position(|&(column, _)| column == index) {
            numbers[slot] = columns[slot].1 * body.number(property.value)?;
        } else {
            skip_property(property, body)?;
        }
    }
    let [r, g, b] = numbers;
    let value = if columns.len() == 1 { DVec3::splat(r) } else { DVec3::new(r, g, b) };
    if value.is_finite() {
        return Ok((value, corners));
    }
    let (expected, found) = ("a finite number", value.to_string());
    Err((body.place(), MeshProblem::Expected { expected, found }))
}

fn vertices(
    element: &Element,
    body: &mut dyn Body,
    columns: &[(usize, f64)],
    mut values: Vec<DVec3>,
) -> Result<Vec<DVec3>, Failure> {
    for index in 0..element.count {
        body.begin(&element.name, index);
        values.push(value(element, body, columns)?.0);
    }
    Ok(values)
}

/// Face values, repeated for each triangle of a face.
fn faces(
    element: &Element,
    body: &mut dyn Body,
    columns: &[(usize, f64)],
    mut values: Vec<DVec3>,
) -> Result<Vec<DVec3>, Failure> {
    for index in 0..element.count {
        body.begin(&element.name, index);
        let (value, corners) = value(element, body, columns)?;
        values.extend(std::iter::repeat_n(value, corners.saturating_sub(2)));
    }
    Ok(values)
}
