//! Stanford PLY.
//!
//! Read by hand: `ply-rs-bw` stores one element for each that the header announces, so that a binary file that
//! announces many without properties fills any memory; it allocates once for every face; and it does not see
//! what follows the last element.

mod attribute;
mod body;
mod header;
mod write;

use std::path::Path;

use glam::{DVec2, DVec3};

use self::body::{Ascii, Binary, Body};
use self::header::{Element, Encoding, Header, Property};
use super::memory::{reserve, with_room};
use super::polygon::Polygons;
use super::soup::Soup;
use super::{At, Error, MemoryError, MeshProblem, Place};
use crate::geometry::{Attribute, Mesh};

pub(super) use self::attribute::{PlyAttribute, read_attribute};
pub use self::write::write_ply;

/// Reads the triangles of a PLY file: ASCII, or binary of either byte order. `path` is for messages.
///
/// Of the element `vertex` the properties x y z, nx ny nz and u v (or s t) are read, of `face` the list
/// `vertex_index` or `vertex_indices`; all else is skipped. Polygons become fans around their first corner,
/// and where they have dents triangles that do not leave them. Without nx ny nz the normals are weighted by
/// angles on the file's own vertices, so that vertices the file has twice make a crease.
///
/// # Errors
/// [`Error::Mesh`], with the line or the element.
pub fn read_ply(bytes: &[u8], path: &Path) -> Result<Mesh, Error> {
    let geometry = |e| Error::Mesh { place: Place::new(path, At::Whole), problem: MeshProblem::Geometry(e) };
    parse(bytes, path)?.into_mesh(false).map_err(geometry)
}

pub(super) fn parse(bytes: &[u8], path: &Path) -> Result<Soup, Error> {
    let error = |(at, problem)| Error::Mesh { place: Place::new(path, at), problem };
    let (header, rest, lines) = header::parse(bytes).map_err(error)?;
    match header.encoding {
        Encoding::Ascii => elements(&header, &mut Ascii::new(rest, lines)),
        Encoding::LittleEndian => elements(&header, &mut Binary::<true>::new(rest)),
        Encoding::BigEndian => elements(&header, &mut Binary::<false>::new(rest)),
    }
    .map_err(error)
}

/// A problem and its place.
type Failure = (At, MeshProblem);

fn elements<B: Body + ?Sized>(header: &Header, body: &mut B) -> Result<Soup, Failure> {
    let mut soup = Soup::default();
    for element in &header.elements {
        match element.name.as_str() {
            "vertex" => vertices(element, body, &mut soup)?,
            "face" => faces(element, body, &mut soup)?,
            _ => skip(element, body)?,
        }
    }
    body.finish()?;
    if soup.triangles.is_empty() {
        let problem = MeshProblem::Faceless { vertices: soup.positions.len() };
        soup.notes.push(problem.to_string());
    }
    if let Some(normals) = &mut soup.normals {
        normals.triangles.clone_from(&soup.triangles);
    }
    if let Some(uvs) = &mut soup.uvs {
        uvs.triangles.clone_from(&soup.triangles);
    }
    Ok(soup)
}

/// How many elements to make room for: no more than the rest of the file can hold.
fn room<B: Body + ?Sized>(element: &Element, body: &B) -> usize {
    element.count.min(body.remaining())
}

fn vertices<B: Body + ?Sized>(element: &Element, body: &mut B, soup: &mut Soup) -> Result<(), Failure> {
    /// Where each of the eight numbers goes.
    const SLOTS: [&[&str]; 8] = [&["x"], &["y"], &["z"], &["nx"], &["ny"], &["nz"], &["u", "s"], &["v", "t"]];
    let slots: Vec<Option<usize>> = element
        .properties
        .iter()
        .map(|p| SLOTS.iter().position(|names| p.list.is_none() && names.contains(&p.name.as_str())))
        .collect();
    let has = |slot: usize| slots.contains(&Some(slot));
    let all = |range: std::ops::Range<usize>, what| match range.clone().filter(|&s| has(s)).count() {
        0 => Ok(false),
        n if n == range.len() => Ok(true),
        _ => Err((At::Whole, MeshProblem::Missing { what })),
    };
    if !all(0..3, "vertex properties x, y and z")? {
        return Err((At::Whole, MeshProblem::Missing { what: "vertex properties x, y and z" }));
    }
    let has_normals = all(3..6, "vertex properties nx, ny and nz (all or none)")?;
    let has_uvs = all(6..8, "vertex properties u and v (both or none)")?;

    let count = room(element, body);
    let memory = |error: MemoryError| (At::Whole, error.into());
    let mut normals = with_room(if has_normals { count } else { 0 }, "the normals").map_err(memory)?;
    let mut uvs = with_room(if has_uvs { count } else { 0 }, "the texture coordinates").map_err(memory)?;
    reserve(&mut soup.positions, count, "the vertices").map_err(memory)?;
    for index in 0..element.count {
        let mut values = [0.0; 8];
        body.begin(&element.name, index);
        for (property, slot) in element.properties.iter().zip(&slots) {
            match slot {
                Some(slot) => values[*slot] = body.number(property.value)?,
                None => skip_property(property, body)?,
            }
        }
        let [x, y, z, nx, ny, nz, u, v] = values;
        soup.positions.push(DVec3::new(x, y, z));
        if has_normals {
            normals.push(DVec3::new(nx, ny, nz));
        }
        if has_uvs {
            uvs.push(DVec2::new(u, v));
        }
    }
    soup.normals = has_normals.then_some(Attribute { values: normals, triangles: vec![] });
    soup.uvs = has_uvs.then_some(Attribute { values: uvs, triangles: vec![] });
    Ok(())
}

fn faces<B: Body + ?Sized>(element: &Element, body: &mut B, soup: &mut Soup) -> Result<(), Failure> {
    // A face has at least a length of one byte and three indices of one byte.
    let count = element.count.min(body.remaining() / 4);
    reserve(&mut soup.triangles, count, "the triangles").map_err(|error| (At::Whole, error.into()))?;
    let (mut corners, mut places, mut polygons) = (vec![], vec![], Polygons::default());
    for index in 0..element.count {
        body.begin(&element.name, index);
        for property in &element.properties {
            if !property.is_indices() {
                skip_property(property, body)?;
                continue;
            }
            let length = length(property, body)?;
            corners.clear();
            for _ in 0..length {
                corners.push(corner(property, body, soup.positions.len())?);
            }
            if length < 3 {
                return Err((body.place(), MeshProblem::Corners { corners: length }));
            }
            if let [a, b, c] = corners[..] {
                soup.triangles.push([a, b, c]);
                continue;
            }
            places.clear();
            places.extend(corners.iter().map(|&i| soup.positions[i as usize]));
            soup.triangles.extend(polygons.triangles(&places).into_iter().map(|t| t.map(|i| corners[i])));
        }
    }
    soup.notes.extend(polygons.notes());
    Ok(())
}

fn corner<B: Body + ?Sized>(property: &Property, body: &mut B, count: usize) -> Result<u32, Failure> {
    let index = body.integer(property.value)?;
    match u32::try_from(index) {
        Ok(i) if (i as usize) < count => Ok(i),
        _ => Err((body.place(), MeshProblem::Index { what: "vertex", index, count })),
    }
}

/// The length of a list, which the rest of the file has room for.
fn length<B: Body + ?Sized>(property: &Property, body: &mut B) -> Result<usize, Failure> {
    let Some(kind) = property.list else { return Ok(0) };
    let length = body.integer(kind)?;
    match usize::try_from(length) {
        Ok(n) if n <= body.remaining() => Ok(n),
        Ok(n) => Err((
            body.place(),
            MeshProblem::Truncated { what: format!("the {n} values of the list \"{}\"", property.name) },
        )),
        Err(_) => Err((
            body.place(),
            MeshProblem::Expected { expected: "the length of a list", found: length.to_string() },
        )),
    }
}

fn skip<B: Body + ?Sized>(element: &Element, body: &mut B) -> Result<(), Failure> {
    if element.properties.is_empty() {
        // Nothing stands in the file, however many there are.
        return Ok(());
    }
    for index in 0..element.count {
        body.begin(&element.name, index);
        for property in &element.properties {
            skip_property(property, body)?;
        }
    }
    Ok(())
}

fn skip_property<B: Body + ?Sized>(property: &Property, body: &mut B) -> Result<(), Failure> {
    let count = if property.list.is_some() { length(property, body)? } else { 1 };
    for _ in 0..count {
        body.number(property.value)?;
    }
    Ok(())
}
