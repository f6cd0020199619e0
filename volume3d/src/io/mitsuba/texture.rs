//! Textures.

use glam::{DAffine2, DVec2};

use super::element::Element;
use super::object::Object;
use super::reader::Reader;
use super::transform;
use crate::Image;
use crate::io::Error;
use crate::io::image::read_image;
use crate::scene::{Texture, Wrap};

impl<'a> Reader<'a> {
    /// The index of the texture an element describes.
    pub(super) fn texture(&mut self, element: &'a Element) -> Result<usize, Error> {
        if let Some(&index) = self.texture_of.get(&std::ptr::from_ref(element)) {
            return Ok(index);
        }
        let object = Object::new(element, &self.ids)?;
        if object.plugin != "bitmap" {
            return Err(object.unknown_plugin("texture", "bitmap"));
        }
        let filter = object.choice("filter_type", &["bilinear", "nearest"], "bilinear")?;
        if filter == Some(1) {
            return Err(element.unsupported("filter_type \"nearest\"", "use bilinear"));
        }
        let wraps = ["repeat", "mirror", "clamp"];
        let wrap = match object.choice("wrap_mode", &wraps, "repeat, mirror or clamp")? {
            Some(1) => Wrap::Mirror,
            Some(2) => Wrap::Clamp,
            _ => Wrap::Repeat,
        };
        // These change storage only.
        object.choice("format", &["auto", "variant", "fp16"], "auto, variant or fp16")?;
        object.boolean("accel")?;
        let raw = object.boolean("raw")?.unwrap_or(false);
        let to_uv = match object.transform("to_uv")? {
            Some(element) => to_uv(element)?,
            None => DAffine2::IDENTITY,
        };
        let image = self.image(&object, raw)?;
        object.finish()?;
        // Mitsuba's first row is at v = 0, that of a texture here at v = 1.
        let flip = DAffine2::from_scale_angle_translation(DVec2::new(1.0, -1.0), 0.0, DVec2::Y);
        Ok(self.add_texture(element, image, wrap, flip * to_uv))
    }

    /// The image in an object's parameter `filename`.
    pub(super) fn image(&self, object: &Object<'a>, raw: bool) -> Result<Image, Error> {
        let element = object.element;
        let name = object.string("filename")?.ok_or_else(|| object.missing("filename"))?;
        let path = element.beside(name);
        let bytes = element.open(&path, self.open)?;
        read_image(&bytes, &path, raw).map_err(|error| element.referenced(error))
    }

    pub(super) fn add_texture(
        &mut self,
        element: &'a Element,
        image: Image,
        wrap: Wrap,
        to_uv: DAffine2,
    ) -> usize {
        let id = self.name(element, self.textures.len());
        let Image { width, height, pixels: texels } = image;
        self.textures.push(Texture { id, width, height, texels, wrap, to_uv });
        let index = self.textures.len() - 1;
        self.texture_of.insert(std::ptr::from_ref(element), index);
        index
    }
}

/// The upper left 3×3 part of a matrix, as a map of (u, v, 1). Mitsuba leaves out the last column, where
/// `<translate>` writes; that is refused.
fn to_uv(element: &Element) -> Result<DAffine2, Error> {
    let m = transform::matrix(element)?;
    if m.w_axis.x != 0.0 || m.w_axis.y != 0.0 {
        return Err(element.unsupported(
            "a translation in to_uv, which Mitsuba ignores,",
            "write <matrix value=\"1 0 DU  0 1 DV  0 0 1\"/>",
        ));
    }
    let column = |c: glam::DVec4| DVec2::new(c.x, c.y);
    Ok(DAffine2::from_cols(column(m.x_axis), column(m.y_axis), column(m.z_axis)))
}
