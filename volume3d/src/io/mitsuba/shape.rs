//! Shapes.

use super::element::Element;
use super::object::Object;
use super::reader::Reader;
use super::{emitter, transform};
use crate::geometry::Mesh;
use crate::io::soup::Soup;
use crate::io::{At, Error, MeshFormat, MeshProblem, Place};
use crate::scene::Shape;

impl<'a> Reader<'a> {
    pub(super) fn shape(&mut self, element: &'a Element) -> Result<(), Error> {
        let object = Object::new(element, &self.ids)?;
        let mesh = match object.plugin {
            "obj" => self.mesh_file(&object, MeshFormat::Obj)?,
            "ply" => self.mesh_file(&object, MeshFormat::Ply)?,
            "rectangle" => built_in(&object, Mesh::rectangle())?,
            "cube" => built_in(&object, Mesh::cube())?,
            "sdfgrid" => return self.sdf_grid(element, &object),
            "sdfnetwork" => return self.sdf_network(element, &object),
            "sphere" | "disk" | "cylinder" => {
                let what = format!("the curved shape \"{}\"", object.plugin);
                let instead = "it is not turned into triangles behind your back: save it as ply or obj";
                return Err(element.unsupported(what, instead));
            }
            _ => return Err(object.unknown_plugin("shape", "obj, ply, rectangle, cube, sdfgrid, sdfnetwork")),
        };
        let mesh = match object.transform("to_world")? {
            Some(element) => mesh.transformed(&transform::invertible(element)?),
            None => mesh,
        };
        let radiance = match object.at_most_one("<emitter>")? {
            Some(emitter) => Some(emitter::area(&Object::new(emitter, &self.ids)?)?),
            None => None,
        };
        let material = match object.at_most_one("<bsdf>")? {
            Some(bsdf) => self.material(bsdf)?,
            None => self.default_material(radiance.is_some()),
        };
        object.finish()?;
        let id = self.name(element, self.shapes.len());
        self.shapes.push(Shape { id, mesh, material, radiance });
        Ok(())
    }

    fn mesh_file(&self, object: &Object<'a>, format: MeshFormat) -> Result<Mesh, Error> {
        let element = object.element;
        let name = object.string("filename")?.ok_or_else(|| object.missing("filename"))?;
        let path = element.beside(name);
        let bytes = element.open(&path, self.open)?;
        let mut soup = format.parse(&bytes, &path).map_err(|error| element.referenced(error))?;
        // Mitsuba's first row of a texture is at v = 0; most OBJ files mean v = 1.
        if object.boolean("flip_tex_coords")?.unwrap_or(format == MeshFormat::Obj) {
            soup.flip_texture_coordinates();
        }
        if object.boolean("flip_normals")? == Some(true) {
            soup.flip_normals();
        }
        soup.into_mesh(object.boolean("face_normals")?.unwrap_or(false)).map_err(|error| {
            let problem = MeshProblem::Geometry(error);
            element.referenced(Error::Mesh { place: Place::new(&path, At::Whole), problem })
        })
    }
}

/// A shape with flat faces, whose normals are those of its faces however they are asked for.
fn built_in(object: &Object<'_>, mesh: Mesh) -> Result<Mesh, Error> {
    object.boolean("face_normals")?;
    if object.boolean("flip_normals")? != Some(true) {
        return Ok(mesh);
    }
    let mut soup = Soup::from_faces(&mesh);
    soup.flip_normals();
    soup.into_mesh(true).map_err(|error| {
        let place = object.element.place();
        Error::Mesh { place, problem: MeshProblem::Geometry(error) }
    })
}
