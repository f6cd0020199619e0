//! Wavefront OBJ.
//!
//! A parser of our own: the crate `tobj` splits a file at its groups, which tears shared vertices apart, and
//! its errors do not state the line.

mod write;

use std::borrow::Cow;
use std::collections::BTreeSet;
use std::path::Path;

use glam::{DVec2, DVec3};

pub use self::write::write_obj;

use super::error::excerpt;
use super::polygon::Polygons;
use super::soup::{NONE, Soup};
use super::{At, Error, MeshProblem, Place};
use crate::geometry::Mesh;

/// Reads the triangles of an OBJ file. `path` is for messages.
///
/// `v`, `vt`, `vn` and `f` are read, with indices from the end (−1 is the last so far) and polygons, which
/// become fans around their first corner, or, if not convex, triangles inside the polygon. Positions, texture
/// coordinates and normals keep their own indices. Without `vn` the normals are weighted by angles on the
/// file's `v`. If only some corners have texture coordinates or normals, the others get (0, 0), and the
/// normals of their triangles.
///
/// Groups, objects, smoothing groups, materials and vertex colours are skipped; points and lines (`p`, `l`)
/// too, as they have no area. Free-form geometry is refused.
///
/// # Errors
/// [`Error::Mesh`] with the line.
pub fn read_obj(bytes: &[u8], path: &Path) -> Result<Mesh, Error> {
    let geometry = |e| Error::Mesh { place: Place::new(path, At::Whole), problem: MeshProblem::Geometry(e) };
    parse(bytes, path)?.into_mesh(false).map_err(geometry)
}

pub(super) fn parse(bytes: &[u8], path: &Path) -> Result<Soup, Error> {
    let mut reader = Reader::default();
    let mut lines = bytes.split(|&b| b == b'\n').enumerate();
    while let Some((index, line)) = lines.next() {
        let mut line = Cow::Borrowed(strip(line));
        // A backslash continues the line.
        while line.last() == Some(&b'\\') {
            let joined = line.to_mut();
            joined.pop();
            joined.push(b' ');
            let Some((_, next)) = lines.next() else { break };
            joined.extend_from_slice(strip(next));
        }
        reader
            .line(&line)
            .map_err(|problem| Error::Mesh { place: Place::new(path, At::Line(index + 1)), problem })?;
    }
    let vertices = reader.positions.len();
    if reader.triangles.is_empty() {
        return Err(Error::Mesh {
            place: Place::new(path, At::Whole),
            problem: MeshProblem::Faceless { vertices },
        });
    }
    Ok(reader.finish())
}

/// A line without its comment and surrounding spaces.
fn strip(line: &[u8]) -> &[u8] {
    line.split(|&b| b == b'#').next().unwrap_or_default().trim_ascii()
}

/// Maximum number of material names in a note.
const SHOWN_MATERIALS: usize = 8;

/// Indices of a corner, from 0.
#[derive(Clone, Copy)]
struct Corner {
    position: u32,
    /// [`NONE`] if it has no texture coordinates.
    uv: u32,
    /// [`NONE`] if it has no normal.
    normal: u32,
}

#[derive(Default)]
struct Reader {
    positions: Vec<DVec3>,
    uvs: Vec<DVec2>,
    normals: Vec<DVec3>,
    triangles: Vec<[u32; 3]>,
    uv_triangles: Vec<[u32; 3]>,
    normal_triangles: Vec<[u32; 3]>,
    corners: Vec<Corner>,
    places: Vec<DVec3>,
    polygons: Polygons,
    /// Names of the materials used by faces.
    materials: BTreeSet<String>,
    material: Option<String>,
}

impl Reader {
    fn line(&mut self, line: &[u8]) -> Result<(), MeshProblem> {
        if line.is_empty() {
            return Ok(());
        }
        let keyword = line.split(u8::is_ascii_whitespace).next().unwrap_or_default();
        match keyword {
            b"v" => {
                let [x, y, z] = numbers(line, "v x y z")?;
                self.positions.push(DVec3::new(x, y, z));
            }
            b"vn" => {
                let [x, y, z] = numbers(line, "vn x y z")?;
                self.normals.push(DVec3::new(x, y, z));
            }
            b"vt" => {
                let [u, v] = texture_coordinates(line)?;
                self.uvs.push(DVec2::new(u, v));
            }
            b"f" => self.face(text(line)?)?,
            b"usemtl" => {
                let name = String::from_utf8_lossy(&line[keyword.len()..]);
                self.material = Some(excerpt(name.trim()));
            }
            // No effect on the surface.
            b"g" | b"o" | b"s" | b"mtllib" | b"p" | b"l" => {}
            _ => {
                let what = format!("the keyword \"{}\"", excerpt(&String::from_utf8_lossy(keyword)));
                let instead = "supported: v, vt, vn, f, and without effect g, o, s, usemtl, mtllib, p, l";
                return Err(MeshProblem::Unsupported { what, instead });
            }
        }
        Ok(())
    }

    fn face(&mut self, line: &str) -> Result<(), MeshProblem> {
        self.corners.clear();
        for word in line.split_ascii_whitespace().skip(1) {
            let corner = self.corner(word)?;
            self.corners.push(corner);
        }
        let corners = &self.corners;
        if corners.len() < 3 {
            return Err(MeshProblem::Corners { corners: corners.len() });
        }
        let triangles = if let [_, _, _] = corners[..] {
            vec![[0, 1, 2]]
        } else {
            self.places.clear();
            self.places.extend(corners.iter().map(|c| self.positions[c.position as usize]));
            self.polygons.triangles(&self.places)
        };
        for t in triangles {
            let t = t.map(|i| corners[i]);
            self.triangles.push(t.map(|c| c.position));
            self.uv_triangles.push(t.map(|c| c.uv));
            self.normal_triangles.push(t.map(|c| c.normal));
        }
        if let Some(material) = self.material.take()
            && self.materials.len() < SHOWN_MATERIALS
        {
            self.materials.insert(material);
        }
        Ok(())
    }

    fn corner(&self, word: &str) -> Result<Corner, MeshProblem> {
        let expected = "a corner v, v/vt, v//vn or v/vt/vn of whole numbers";
        let error = || MeshProblem::Expected { expected, found: excerpt(word) };
        let mut parts = word.split('/');
        let position = parts.next().unwrap_or_default();
        let (uv, normal) = (parts.next(), parts.next());
        if parts.next().is_some() {
            return Err(error());
        }
        let index = |what, text: &str, count: usize| {
            let index: i64 = text.parse().map_err(|_| error())?;
            let from_start = if index < 0 { index + count as i64 } else { index - 1 };
            match usize::try_from(from_start) {
                Ok(i) if i < count => u32::try_from(i).map_err(|_| error()),
                _ => Err(MeshProblem::Index { what, index, count }),
            }
        };
        Ok(Corner {
            position: index("vertex", position, self.positions.len())?,
            uv: match uv {
                Some("") | None => NONE,
                Some(uv) => index("texture coordinate", uv, self.uvs.len())?,
            },
            normal: match normal {
                Some("") | None => NONE,
                Some(normal) => index("normal", normal, self.normals.len())?,
            },
        })
    }

    fn finish(self) -> Soup {
        let mut notes = self.polygons.notes();
        if self.materials.len() > 1 {
            let more = if self.materials.len() < SHOWN_MATERIALS { "" } else { ", …" };
            let names: Vec<_> = self.materials.iter().map(|name| format!("\"{name}\"")).collect();
            let names = names.join(", ") + more;
            notes.push(format!(
                "its faces have several materials by usemtl ({names}), which are ignored: the whole file has the material of its \
                 shape; make a file of each"
            ));
        }
        let (positions, triangles) = (self.positions, self.triangles);
        let mut soup = Soup { notes, positions, triangles, ..Soup::default() };
        soup.set_uvs(self.uvs, self.uv_triangles);
        soup.set_normals(self.normals, self.normal_triangles);
        soup
    }
}

fn text(line: &[u8]) -> Result<&str, MeshProblem> {
    str::from_utf8(line).map_err(|_| MeshProblem::Expected {
        expected: "UTF-8 text",
        found: excerpt(&String::from_utf8_lossy(line)),
    })
}

/// The first three numbers of a line. A fourth is a weight, three or four more are a colour.
fn numbers(line: &[u8], expected: &'static str) -> Result<[f64; 3], MeshProblem> {
    let line = text(line)?;
    let error = || MeshProblem::Expected { expected, found: excerpt(line) };
    let mut words = line.split_ascii_whitespace().skip(1);
    let mut number =
        || words.next().and_then(|w| w.parse().ok()).filter(|x: &f64| x.is_finite()).ok_or_else(error);
    let values = [number()?, number()?, number()?];
    let rest = words.map(|w| w.parse::<f64>().map_err(|_| error())).collect::<Result<Vec<_>, _>>()?;
    match (expected, rest.as_slice()) {
        (_, []) => Ok(values),
        ("v x y z", [1.0] | [_, _, _] | [_, _, _, _]) => Ok(values),
        ("v x y z", [_]) => Err(MeshProblem::Unsupported {
            what: "a vertex of weight other than 1".to_owned(),
            instead: "divide x, y and z by it",
        }),
        _ => Err(error()),
    }
}

/// One, two or three numbers; the third is skipped.
fn texture_coordinates(line: &[u8]) -> Result<[f64; 2], MeshProblem> {
    let line = text(line)?;
    let error = || MeshProblem::Expected { expected: "vt u v", found: excerpt(line) };
    let words = line.split_ascii_whitespace().skip(1);
    let values = words
        .map(|w| w.parse().ok().filter(|x: &f64| x.is_finite()).ok_or_else(error))
        .collect::<Result<Vec<_>, _>>()?;
    match values[..] {
        [u] => Ok([u, 0.0]),
        [u, v] | [u, v, _] => Ok([u, v]),
        _ => Err(error()),
    }
}
