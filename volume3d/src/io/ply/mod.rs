//! Stanford PLY.
//!
//! A parser of our own: `ply-rs-bw` stores one element for each that the header declares, so that a binary
//! file that declares many without properties exhausts any memory; it allocates once for every face; and it
//! ignores data after the last element.

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
use super::soup::{NONE, Soup};
use super::{At, Error, MemoryError, MeshProblem, Place};
use crate::geometry::{Attribute, Mesh};

pub(super) use self::attribute::{PlyAttribute, read_attribute};
pub use self::write::write_ply;

/// Reads the triangles of a PLY file: ASCII, or binary of either byte order. `path` is for messages.
///
/// The properties x y z, nx ny nz and u v (or s t, or `texture_u` `texture_v`) of the element `vertex` are
/// read, and of `face` the list `vertex_index` or `vertex_indices`, and `texcoord`, MeshLab's texture
/// coordinates of a face's corners, which take precedence over those of vertices; everything else is skipped.
/// Faces with an empty `texcoord` get (0, 0) if others have some. Polygons become fans around their first
/// corner, or, if not convex, triangles inside the polygon. Without nx ny nz the normals are weighted by
/// angles on the file's own vertices, so that duplicated vertices make a crease.
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

/// A problem and its location.
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
    if let Some(uvs) = &mut soup.uvs
        && uvs.triangles.is_empty()
    {
        uvs.triangles.clone_from(&soup.triangles);
    }
    Ok(soup)
}

/// Number of elements to allocate: no more than the rest of the file can hold.
fn room<B: Body + ?Sized>(element: &Element, body: &B) -> usize {
    element.count.min(body.remaining())
}

fn vertices<B: Body + ?Sized>(element: &Element, body: &mut B, soup: &mut Soup) -> Result<(), Failure> {
    /// Slots of the first six of the eight numbers of a vertex.
    const SLOTS: [&str; 6] = ["x", "y", "z", "nx", "ny", "nz"];
    /// Names of the last two, in order of precedence.
    const COORDINATES: [[&str; 2]; 3] = [["u", "v"], ["s", "t"], ["texture_u", "texture_v"]];
    let names = |name: &str| element.properties.iter().any(|p| p.list.is_none() && p.name == name);
    let coordinates = COORDINATES.iter().find(|pair| pair.iter().all(|name| names(name)));
    let alone = COORDINATES.as_flattened().iter().find(|name| names(name));
    if let Some(name) = alone.filter(|_| coordinates.is_none()) {
        soup.notes.push(format!(
            "the vertex property \"{name}\" is ignored, as in Mitsuba: texture coordinates are u and v, s and t, or texture_u \
             and texture_v"
        ));
    }
    let coordinates = coordinates.map_or(&[][..], |pair| pair);
    let slot = |name: &str| SLOTS.iter().chain(coordinates).position(|slot| *slot == name);
    let slots: Vec<Option<usize>> =
        element.properties.iter().map(|p| slot(&p.name).filter(|_| p.list.is_none())).collect();
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
    let has_uvs = has(6);

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
    let memory = |error: MemoryError| (At::Whole, error.into());
    reserve(&mut soup.triangles, count, "the triangles").map_err(memory)?;
    let mut face = Face::default();
    let mut polygons = Polygons::default();
    let mut coordinates =
        element.properties.iter().any(Property::is_coordinates).then(FaceCoordinates::default);
    if let Some(coordinates) = &mut coordinates {
        reserve(&mut coordinates.triangles, count, "the texture coordinates").map_err(memory)?;
    }
    for index in 0..element.count {
        body.begin(&element.name, index);
        face.read(element, body, soup.positions.len())?;
        let Face { corners, .. } = &face;
        if let [a, b, c] = corners[..] {
            soup.triangles.push([a, b, c]);
            if let Some(coordinates) = &mut coordinates {
                coordinates.push(&face, &[[0, 1, 2]]);
            }
            continue;
        }
        let places: Vec<DVec3> = corners.iter().map(|&i| soup.positions[i as usize]).collect();
        let triangles = polygons.triangles(&places);
        soup.triangles.extend(triangles.iter().map(|t| t.map(|i| corners[i])));
        if let Some(coordinates) = &mut coordinates {
            coordinates.push(&face, &triangles);
        }
    }
    soup.notes.extend(polygons.notes());
    if let Some(FaceCoordinates { values, triangles, textures }) = coordinates {
        if textures.len() > 1 {
            let text = "its faces have several textures by texnumber, which are ignored: all have the material of the shape";
            soup.notes.push(text.to_owned());
        }
        soup.set_uvs(values, triangles);
    }
    Ok(())
}

/// One face, reused for all.
#[derive(Default)]
struct Face {
    corners: Vec<u32>,
    /// Two numbers for each corner, or none.
    coordinates: Vec<f64>,
    /// The index of its texture, if it has one.
    texture: Option<i64>,
}

impl Face {
    fn read<B: Body + ?Sized>(
        &mut self,
        element: &Element,
        body: &mut B,
        vertices: usize,
    ) -> Result<(), Failure> {
        self.corners.clear();
        self.coordinates.clear();
        self.texture = None;
        for property in &element.properties {
            if property.is_indices() {
                let length = length(property, body)?;
                for _ in 0..length {
                    self.corners.push(corner(property, body, vertices)?);
                }
                if length < 3 {
                    return Err((body.place(), MeshProblem::Corners { corners: length }));
                }
            } else if property.is_coordinates() {
                for _ in 0..length(property, body)? {
                    self.coordinates.push(body.number(property.value)?);
                }
            } else if property.list.is_none() && property.name == "texnumber" && property.value.is_integer() {
                self.texture = Some(body.integer(property.value)?);
            } else {
                skip_property(property, body)?;
            }
        }
        let (found, corners) = (self.coordinates.len(), self.corners.len());
        if found != 0 && found != 2 * corners {
            return Err((body.place(), MeshProblem::FaceCoordinates { found, corners }));
        }
        Ok(())
    }
}

/// Texture coordinates that faces assign to their corners.
#[derive(Default)]
struct FaceCoordinates {
    values: Vec<DVec2>,
    triangles: Vec<[u32; 3]>,
    /// At most two of the texture indices.
    textures: Vec<i64>,
}

impl FaceCoordinates {
    /// Adds those of a face with these triangles of its corners.
    fn push(&mut self, face: &Face, triangles: &[[usize; 3]]) {
        let first = self.values.len();
        self.values.extend(face.coordinates.chunks_exact(2).map(DVec2::from_slice));
        let is_there = !face.coordinates.is_empty();
        let index = |corner: usize| if is_there { (first + corner) as u32 } else { NONE };
        self.triangles.extend(triangles.iter().map(|t| t.map(index)));
        if let Some(texture) = face.texture.filter(|_| is_there)
            && self.textures.len() < 2
            && !self.textures.contains(&texture)
        {
            self.textures.push(texture);
        }
    }
}

fn corner<B: Body + ?Sized>(property: &Property, body: &mut B, count: usize) -> Result<u32, Failure> {
    let index = body.integer(property.value)?;
    match u32::try_from(index) {
        Ok(i) if (i as usize) < count => Ok(i),
        _ => Err((body.place(), MeshProblem::Index { what: "vertex", index, count })),
    }
}

/// The length of a list, checked against the rest of the file.
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
        // The elements take no bytes, however many there are.
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
