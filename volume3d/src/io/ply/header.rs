//! PLY header: elements and their properties.

use super::Failure;
use crate::io::error::excerpt;
use crate::io::{At, MeshProblem};

/// Maximum number of elements of a header, and of properties of an element; meshes have some ten, and splat
/// clouds sixty.
const MOST: usize = 1000;

/// Storage encoding.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Encoding {
    Ascii,
    LittleEndian,
    BigEndian,
}

/// The type of a number.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Kind {
    I8,
    U8,
    I16,
    U16,
    I32,
    U32,
    F32,
    F64,
}

impl Kind {
    fn parse(name: &str) -> Option<Self> {
        Some(match name {
            "char" | "int8" => Self::I8,
            "uchar" | "uint8" => Self::U8,
            "short" | "int16" => Self::I16,
            "ushort" | "uint16" => Self::U16,
            "int" | "int32" => Self::I32,
            "uint" | "uint32" => Self::U32,
            "float" | "float32" => Self::F32,
            "double" | "float64" => Self::F64,
            _ => return None,
        })
    }

    pub(super) fn is_integer(self) -> bool {
        !matches!(self, Self::F32 | Self::F64)
    }
}

#[derive(Debug)]
pub(super) struct Property {
    pub(super) name: String,
    /// The line of its declaration.
    pub(super) line: usize,
    /// The type of a list's length, if it is a list.
    pub(super) list: Option<Kind>,
    pub(super) value: Kind,
}

impl Property {
    /// Whether this list, in the element "face", holds the corners.
    pub(super) fn is_indices(&self) -> bool {
        self.list.is_some() && matches!(self.name.as_str(), "vertex_index" | "vertex_indices")
    }

    /// Whether this list, in the element "face", holds the texture coordinates of the corners.
    pub(super) fn is_coordinates(&self) -> bool {
        self.list.is_some() && self.name == "texcoord"
    }
}

#[derive(Debug)]
pub(super) struct Element {
    pub(super) name: String,
    pub(super) count: usize,
    pub(super) properties: Vec<Property>,
}

#[derive(Debug)]
pub(super) struct Header {
    pub(super) encoding: Encoding,
    pub(super) elements: Vec<Element>,
}

/// Parses the header; also returns the bytes after it, and its number of lines.
pub(super) fn parse(bytes: &[u8]) -> Result<(Header, &[u8], usize), Failure> {
    let mut rest = bytes;
    let mut encoding = None;
    let mut elements: Vec<Element> = vec![];
    for number in 1.. {
        let failure = |problem| (At::Line(number), problem);
        let Some(end) = rest.iter().position(|&b| b == b'\n') else {
            let problem = if number == 1 { not_ply(rest) } else { truncated() };
            return Err(failure(problem));
        };
        let (line, after) = (&rest[..end], &rest[end + 1..]);
        rest = after;
        if number == 1 {
            if line.trim_ascii_end() != b"ply" {
                return Err(failure(not_ply(line)));
            }
            continue;
        }
        let line = String::from_utf8_lossy(line);
        let words: Vec<&str> = line.split_ascii_whitespace().collect();
        let expected = |expected| failure(MeshProblem::Expected { expected, found: excerpt(&line) });
        match words[..] {
            [] | ["comment" | "obj_info", ..] => {}
            ["format", name, "1.0"] => {
                encoding = Some(match name {
                    "ascii" => Encoding::Ascii,
                    "binary_little_endian" => Encoding::LittleEndian,
                    "binary_big_endian" => Encoding::BigEndian,
                    _ => return Err(expected(FORMATS)),
                });
            }
            ["format", ..] => return Err(expected(FORMATS)),
            ["element", name, count] => {
                let count = count.parse().map_err(|_| expected("element NAME COUNT"))?;
                check_element(name, &elements).map_err(failure)?;
                if elements.len() == MOST {
                    return Err(expected("at most 1000 elements"));
                }
                elements.push(Element { name: name.to_owned(), count, properties: vec![] });
            }
            ["property", ..] => {
                let element =
                    elements.last_mut().ok_or_else(|| expected("an element before its properties"))?;
                if element.properties.len() == MOST {
                    return Err(expected("at most 1000 properties of an element"));
                }
                let property = property(&words, number).ok_or_else(|| expected(PROPERTY))?;
                if element.properties.iter().any(|p| p.name == property.name) {
                    return Err(expected("each property once"));
                }
                if element.name == "face" && property.is_indices() {
                    if !property.value.is_integer() {
                        return Err(expected("indices of an integer type"));
                    }
                    if element.properties.iter().any(Property::is_indices) {
                        return Err(expected("either vertex_index or vertex_indices"));
                    }
                }
                element.properties.push(property);
            }
            ["end_header"] => {
                let encoding =
                    encoding.ok_or_else(|| failure(MeshProblem::Missing { what: "line \"format …\"" }))?;
                check(&elements).map_err(failure)?;
                return Ok((Header { encoding, elements }, rest, number));
            }
            _ => return Err(expected("comment, format, element, property or end_header")),
        }
    }
    Err((At::Whole, truncated()))
}

const FORMATS: &str = "format ascii, binary_little_endian or binary_big_endian 1.0";
const PROPERTY: &str = "property TYPE NAME or property list INTEGER_TYPE TYPE NAME";

fn not_ply(line: &[u8]) -> MeshProblem {
    MeshProblem::Expected { expected: "\"ply\"", found: excerpt(&String::from_utf8_lossy(line)) }
}

fn truncated() -> MeshProblem {
    MeshProblem::Truncated { what: "end_header".to_owned() }
}

fn property(words: &[&str], line: usize) -> Option<Property> {
    let (list, value, name) = match words[..] {
        ["property", value, name] => (None, Kind::parse(value)?, name),
        ["property", "list", length, value, name] => {
            let length = Kind::parse(length)?;
            (Some(length.is_integer().then_some(length)?), Kind::parse(value)?, name)
        }
        _ => return None,
    };
    Some(Property { name: name.to_owned(), line, list, value })
}

fn check_element(name: &str, before: &[Element]) -> Result<(), MeshProblem> {
    if name == "tristrips" {
        return Err(MeshProblem::Unsupported {
            what: "the element \"tristrips\"".to_owned(),
            instead: "save the mesh with an element \"face\"",
        });
    }
    if before.iter().any(|e| e.name == name) {
        return Err(MeshProblem::Expected { expected: "each element once", found: excerpt(name) });
    }
    Ok(())
}

/// Checks that vertices precede faces, and that faces have corners.
fn check(elements: &[Element]) -> Result<(), MeshProblem> {
    let position = |name| elements.iter().position(|e: &Element| e.name == name);
    let Some(vertex) = position("vertex") else {
        return Err(MeshProblem::Missing { what: "element vertex" });
    };
    let Some(face) = position("face") else { return Err(MeshProblem::Missing { what: "element face" }) };
    if face < vertex {
        return Err(MeshProblem::Expected { expected: "vertices before faces", found: "face".to_owned() });
    }
    if elements[face].properties.iter().any(Property::is_indices) {
        Ok(())
    } else {
        Err(MeshProblem::Missing { what: "list vertex_index or vertex_indices in its element face" })
    }
}
