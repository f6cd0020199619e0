//! Mitsuba's `serialized` meshes: several in a file, each compressed by deflate.
//!
//! A mesh is a header of two 16-bit numbers, 0x041C and the version, 3 or 4, and a zlib stream: flags (32
//! bits), in version 4 a name that ends in a zero byte, the numbers of vertices and triangles (64 bits each),
//! positions, normals, texture coordinates and colours as the flags say, in single or double precision, and
//! three indices a triangle. The file ends with the offsets of all meshes (32 bits each in version 3, 64 in
//! version 4) and their number (32 bits). All numbers are little-endian.

use std::io::Read;
use std::path::Path;

use flate2::read::ZlibDecoder;
use glam::{DVec2, DVec3};

use super::error::excerpt;
use super::files::MAX_INFLATED;
use super::soup::Soup;
use super::{At, Error, MeshProblem, Place};
use crate::geometry::{Attribute, Mesh};

const HEADER: u16 = 0x041C;

const HAS_NORMALS: u32 = 0x0001;
const HAS_UVS: u32 = 0x0002;
const HAS_COLOURS: u32 = 0x0008;
const FACE_NORMALS: u32 = 0x0010;
const DOUBLE: u32 = 0x2000;

/// Maximum length of a mesh's name, in bytes.
const LONGEST_NAME: usize = 1 << 12;

/// Maximum decompression ratio of deflate.
const MOST_INFLATION: u64 = 1032;

/// Reads a mesh of a file, by its index from 0. `path` is for messages. Colours are not read.
///
/// # Errors
/// [`Error::Mesh`], with the missing part, or the triangle whose index is out of range.
pub fn parse_serialized(bytes: &[u8], path: &Path, index: usize) -> Result<Mesh, Error> {
    let (soup, face_normals) = parse(bytes, path, index)?;
    soup.into_mesh(face_normals).map_err(|error| failure(path, MeshProblem::Geometry(error)))
}

fn failure(path: &Path, problem: MeshProblem) -> Error {
    Error::Mesh { place: Place::new(path, At::Whole), problem }
}

/// The mesh as stored in the file, and whether its flags ask for face normals.
pub(super) fn parse(bytes: &[u8], path: &Path, index: usize) -> Result<(Soup, bool), Error> {
    stream(bytes, index).and_then(mesh).map_err(|problem| failure(path, problem))
}

/// Decompressed content of a mesh, read on demand.
struct Stream<'a> {
    version: u16,
    inflated: std::io::Take<ZlibDecoder<&'a [u8]>>,
    /// Upper bound on the number of remaining bytes.
    room: u64,
}

fn truncated(what: &str) -> MeshProblem {
    MeshProblem::Truncated { what: what.to_owned() }
}

/// Finds a mesh in a file.
fn stream(bytes: &[u8], index: usize) -> Result<Stream<'_>, MeshProblem> {
    let version = header(bytes)?;
    let offset = if index == 0 { 0 } else { offset(bytes, version, index)? };
    let begin = bytes.get(offset..).ok_or_else(|| truncated("the mesh that its list of offsets names"))?;
    let deflated = begin.get(4..).ok_or_else(|| truncated("the header of the mesh"))?;
    // The mesh has its own header, whose version may differ.
    let version = header(begin)?;
    let room = (deflated.len() as u64).saturating_mul(MOST_INFLATION).min(MAX_INFLATED);
    Ok(Stream { version, inflated: ZlibDecoder::new(deflated).take(room), room })
}

/// The version in a header.
fn header(bytes: &[u8]) -> Result<u16, MeshProblem> {
    let &[a, b, c, d, ..] = bytes else { return Err(truncated("the end of its header")) };
    let (format, version) = (u16::from_le_bytes([a, b]), u16::from_le_bytes([c, d]));
    if format != HEADER || !matches!(version, 3 | 4) {
        let expected = "a serialized mesh (0x041C) of version 3 or 4";
        let found = format!("{format:#06x}, version {version}");
        return Err(MeshProblem::Expected { expected, found: excerpt(&found) });
    }
    Ok(version)
}

/// The offset of a mesh, from the list at the end of the file.
fn offset(bytes: &[u8], version: u16, index: usize) -> Result<usize, MeshProblem> {
    let missing = || truncated("its list of offsets");
    let (rest, count) = bytes.split_last_chunk::<4>().ok_or_else(missing)?;
    let count = u32::from_le_bytes(*count) as usize;
    if index >= count {
        let what = format!("mesh {index} of a file of {count} (from 0)");
        return Err(MeshProblem::Unsupported { what, instead: "give a shape_index that there is" });
    }
    let width = if version == 3 { 4 } else { 8 };
    let back = (count - index).checked_mul(width).filter(|&back| back <= rest.len()).ok_or_else(missing)?;
    let entry = &rest[rest.len() - back..][..width];
    let mut wide = [0; 8];
    wide[..width].copy_from_slice(entry);
    usize::try_from(u64::from_le_bytes(wide)).map_err(|_| missing())
}

impl Stream<'_> {
    fn bytes<const N: usize>(&mut self, what: &str) -> Result<[u8; N], MeshProblem> {
        let mut bytes = [0; N];
        self.inflated.read_exact(&mut bytes).map_err(|error| broken(&error, what))?;
        self.room = self.room.saturating_sub(N as u64);
        Ok(bytes)
    }

    /// Skips a name up to its zero byte.
    fn skip_name(&mut self) -> Result<(), MeshProblem> {
        let mut name = vec![];
        while name.len() <= LONGEST_NAME {
            match self.bytes::<1>("name")? {
                [0] => return Ok(()),
                [byte] => name.push(byte),
            }
        }
        let expected = "a name of at most 4096 bytes and a zero byte";
        Err(MeshProblem::Expected { expected, found: excerpt(&String::from_utf8_lossy(&name)) })
    }

    /// A block of `count` values of `width` bytes each; it is allocated only if the file can hold it.
    fn block(&mut self, count: u64, width: u64, what: &str) -> Result<Vec<u8>, MeshProblem> {
        let size = count.checked_mul(width).filter(|&size| size <= self.room);
        let size = size.ok_or_else(|| truncated(&format!("the end of its {count} {what}")))?;
        let mut bytes = super::memory::with_room(size as usize, "a serialized mesh")?;
        self.inflated.by_ref().take(size).read_to_end(&mut bytes).map_err(|error| broken(&error, what))?;
        if (bytes.len() as u64) < size {
            return Err(truncated(&format!("the end of its {count} {what}")));
        }
        self.room -= size;
        Ok(bytes)
    }

    /// Rows of `N` floating-point numbers.
    fn rows<const N: usize>(
        &mut self,
        count: u64,
        is_double: bool,
        what: &str,
    ) -> Result<Vec<[f64; N]>, MeshProblem> {
        let width = if is_double { 8 } else { 4 };
        let bytes = self.block(count, N as u64 * width, what)?;
        let mut rows = super::memory::with_room(count as usize, "a serialized mesh")?;
        rows.extend(bytes.chunks_exact(N * width as usize).map(|row| {
            let mut numbers = row.chunks_exact(width as usize).map(|number| match *number {
                [a, b, c, d] => f64::from(f32::from_le_bytes([a, b, c, d])),
                [a, b, c, d, e, f, g, h] => f64::from_le_bytes([a, b, c, d, e, f, g, h]),
                _ => f64::NAN,
            });
            std::array::from_fn(|_| numbers.next().unwrap_or(f64::NAN))
        }));
        Ok(rows)
    }
}

fn broken(error: &std::io::Error, what: &str) -> MeshProblem {
    match error.kind() {
        std::io::ErrorKind::UnexpectedEof => truncated(&format!("the end of its {what}")),
        _ => MeshProblem::Expected { expected: "a zlib stream", found: excerpt(&error.to_string()) },
    }
}

fn mesh(mut stream: Stream<'_>) -> Result<(Soup, bool), MeshProblem> {
    let flags = u32::from_le_bytes(stream.bytes("flags")?);
    if stream.version == 4 {
        stream.skip_name()?;
    }
    let vertices = u64::from_le_bytes(stream.bytes("number of vertices")?);
    let triangles = u64::from_le_bytes(stream.bytes("number of triangles")?);
    let is_double = flags & DOUBLE != 0;

    let positions = stream.rows::<3>(vertices, is_double, "positions")?;
    let has = |flag| flags & flag != 0;
    let normals = has(HAS_NORMALS).then(|| stream.rows::<3>(vertices, is_double, "normals")).transpose()?;
    let uvs =
        has(HAS_UVS).then(|| stream.rows::<2>(vertices, is_double, "texture coordinates")).transpose()?;
    if has(HAS_COLOURS) {
        stream.rows::<3>(vertices, is_double, "colours")?;
    }
    // Indices have 64 bits if there are too many vertices for 32: memory does not suffice for so many.
    let bytes = stream.block(triangles, 12, "triangles")?;
    let mut corners: Vec<[u32; 3]> = super::memory::with_room(triangles as usize, "a serialized mesh")?;
    for row in bytes.chunks_exact(12) {
        let index =
            |k: usize| u32::from_le_bytes([row[4 * k], row[4 * k + 1], row[4 * k + 2], row[4 * k + 3]]);
        let triangle = [index(0), index(1), index(2)];
        if let Some(&index) = triangle.iter().find(|&&index| u64::from(index) >= vertices) {
            let (index, count) = (i64::from(index), positions.len());
            return Err(MeshProblem::Index { what: "vertex", index, count });
        }
        corners.push(triangle);
    }
    let soup = Soup {
        absent: None,
        notes: vec![],
        positions: positions.into_iter().map(DVec3::from_array).collect(),
        normals: normals.map(|rows| Attribute {
            values: rows.into_iter().map(DVec3::from_array).collect(),
            triangles: corners.clone(),
        }),
        uvs: uvs.map(|rows| Attribute {
            values: rows.into_iter().map(DVec2::from_array).collect(),
            triangles: corners.clone(),
        }),
        triangles: corners,
    };
    Ok((soup, has(FACE_NORMALS)))
}
