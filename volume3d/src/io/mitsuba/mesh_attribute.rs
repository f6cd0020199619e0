//! Materials of meshes with attributes.

use glam::{DAffine2, DVec2};

use super::attribute::{ALONE, Attributes, image};
use super::element::Element;
use super::object::Object;
use super::reader::Reader;
use crate::geometry::Attribute;
use crate::io::Error;
use crate::io::ply::{PlyAttribute, read_attribute};
use crate::scene::{Wrap, parts};

impl<'a> Reader<'a> {
    /// The material of a mesh with attributes; its substitute if it is refused. It is read anew for every
    /// mesh.
    pub(super) fn material_of_attributes(
        &mut self,
        bsdf: &'a Element,
        attributes: Option<Attributes>,
    ) -> usize {
        let kept = (std::mem::take(&mut self.material_of), std::mem::take(&mut self.texture_of));
        let before = (self.materials.len(), self.textures.len());
        self.attributes = attributes;
        let material = self.material(bsdf).and_then(|material| {
            let mut parts = parts(&self.materials, material).into_iter().map(|part| &self.materials[part]);
            let is_attribute = |texture| self.attribute_textures.contains(&texture);
            let fits =
                parts.all(|m| m.textures().all(is_attribute) && m.relief.is_none() && !m.is_anisotropic());
            if fits {
                return Ok(material);
            }
            Err(bsdf.unsupported("a mesh_attribute beside an image, a relief or a brushed surface", ALONE))
        });
        self.attributes = None;
        let instead = self.instead(bsdf);
        let journal = self.journal.clone();
        let material = journal.accept(material, bsdf, instead);
        let material = material.unwrap_or_else(|| {
            self.material_of.clear();
            self.take_back(before.0, before.1);
            self.substitute(bsdf)
        });
        (self.material_of, self.texture_of) = kept;
        material
    }

    /// Refuses a material that would show out-of-range texels. Images converted from attributes have such
    /// texels, and only the mesh that they were made for shows none of them.
    pub(super) fn check_seen(
        &self,
        element: &Element,
        material: usize,
        uvs: Option<&Attribute<DVec2>>,
    ) -> Result<(), Error> {
        let parts = parts(&self.materials, material);
        let mut textures = parts.iter().flat_map(|&part| self.materials[part].textures());
        let is_seen = |texture: usize| {
            self.triangle_textures.contains(&texture)
                && !uvs.is_some_and(|uvs| self.textures[texture].shows_triangles_only(uvs))
        };
        if !textures.any(is_seen) {
            return Ok(());
        }
        let what =
            "a texture of a mesh_attribute, with texels outside of 0 to 1, on another mesh than its own";
        Err(element.unsupported(what, "give it that mesh, or an image between 0 and 1"))
    }

    /// The texture of an attribute of the current mesh.
    pub(super) fn mesh_attribute(
        &mut self,
        element: &'a Element,
        object: &Object<'a>,
    ) -> Result<usize, Error> {
        let name = object.string("name")?.ok_or_else(|| object.missing("name"))?;
        let scale = object.float("scale")?.unwrap_or(1.0);
        object.finish()?;
        let Some(Attributes { path, bytes, triangles }) = &self.attributes else {
            return Err(
                element.unsupported("a mesh_attribute of a shape that is not a PLY file", "give a PLY file")
            );
        };
        let attribute = read_attribute(bytes, path, name).map_err(|error| element.referenced(error))?;
        let image = match attribute {
            PlyAttribute::Vertices(values) => {
                let corners = triangles.iter().map(|t| t.map(|i| scale * values[i as usize]));
                image(corners)
            }
            PlyAttribute::Faces(values) => {
                self.journal.note_shape(
                    element,
                    format!("{name} has steps between faces: derivatives by their vertices miss how the steps move"),
                );
                image(values.iter().map(|&value| [scale * value; 3]))
            }
        };
        let index = self.add_texture(element, image, Wrap::Clamp, DAffine2::IDENTITY);
        self.attribute_textures.insert(index);
        Ok(index)
    }
}
