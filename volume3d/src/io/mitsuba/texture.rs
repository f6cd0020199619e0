//! Textures.

use glam::{DAffine2, DVec2, DVec3};

use super::element::Element;
use super::object::Object;
use super::reader::Reader;
use super::spectrum::{self, Meaning};
use super::{steps, support, transform};
use crate::Image;
use crate::io::Error;
use crate::io::image::read_image;
use crate::scene::{Texture, Wrap};

/// Mitsuba's default colours of a checkerboard.
const DEFAULT_COLOURS: [f64; 2] = [0.4, 0.2];

impl<'a> Reader<'a> {
    /// The index of the texture an element describes.
    pub(super) fn texture(&mut self, element: &'a Element) -> Result<usize, Error> {
        self.texture_of(element, false)
    }

    /// Like [`texture`](Self::texture), for a texture of numbers: Mitsuba 3.9 exchanges the two numbers of a
    /// checkerboard.
    pub(super) fn number_texture(&mut self, element: &'a Element) -> Result<usize, Error> {
        self.texture_of(element, element.attribute("type") == Some("checkerboard"))
    }

    fn texture_of(&mut self, element: &'a Element, swaps: bool) -> Result<usize, Error> {
        if let Some(&index) = self.texture_of.get(&(std::ptr::from_ref(element), swaps)) {
            return Ok(index);
        }
        let index = self.texture_anew(element, swaps)?;
        self.texture_of.insert((std::ptr::from_ref(element), swaps), index);
        Ok(index)
    }

    fn texture_anew(&mut self, element: &'a Element, swaps: bool) -> Result<usize, Error> {
        if element.tag == "spectrum" {
            let pixels = vec![spectrum::colour(element, Meaning::Reflectance)?.rgb];
            let image = Image { width: 1, height: 1, pixels };
            return Ok(self.add_texture(element, image, Wrap::Repeat, DAffine2::IDENTITY));
        }
        let object = Object::new(element, &self.ids)?;
        if object.plugin == "mesh_attribute" {
            return self.mesh_attribute(element, &object);
        }
        let to_uv = match object.transform("to_uv")? {
            Some(element) => to_uv(element, &object)?,
            None => DAffine2::IDENTITY,
        };
        let (image, wrap) = match object.plugin {
            "bitmap" => self.bitmap(&object)?,
            "checkerboard" => (checkerboard(&object, swaps)?, Wrap::Repeat),
            _ => return Err(object.unknown_plugin("texture", support::TEXTURES)),
        };
        object.finish()?;
        // Mitsuba's first row is at v = 0, that of a texture here at v = 1.
        let flip = DAffine2::from_scale_angle_translation(DVec2::new(1.0, -1.0), 0.0, DVec2::Y);
        Ok(self.add_texture(element, image, wrap, flip * to_uv))
    }

    fn bitmap(&self, object: &Object<'a>) -> Result<(Image, Wrap), Error> {
        let filters = ["bilinear", "nearest", "ewa", "trilinear"];
        let filter = object.choice("filter_type", &filters, "bilinear or nearest")?.unwrap_or(0);
        if filter > 1 {
            object.note(format!(
                "filter_type {} is read as bilinear: the image itself has no levels",
                filters[filter]
            ));
        }
        let wraps = ["repeat", "mirror", "clamp"];
        let wrap = match object.choice("wrap_mode", &wraps, "repeat, mirror or clamp")? {
            Some(1) => Wrap::Mirror,
            Some(2) => Wrap::Clamp,
            _ => Wrap::Repeat,
        };
        let raw = object.boolean("raw")?.unwrap_or(false);
        if object.float("gamma")?.is_some_and(|gamma| gamma != -1.0) {
            object.note("gamma is ignored: integers are sRGB, unless raw is true");
        }
        let image = self.image(object, raw)?;
        if filter != 1 {
            return Ok((image, wrap));
        }
        let (image, note) = steps::nearest(image);
        object.note(note);
        Ok((image, wrap))
    }

    /// The image in an object's parameter `filename`.
    pub(super) fn image(&self, object: &Object<'a>, raw: bool) -> Result<Image, Error> {
        let element = object.element;
        let name = object.string("filename")?.ok_or_else(|| object.missing("filename"))?;
        let (path, bytes) = self.file(element, name)?;
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
        self.textures.len() - 1
    }
}

/// Advice for a checkerboard of textures.
const INSTEAD: &str = "give two colours, or a blendbsdf of two materials with the textures, whose weight is a checkerboard of 0 and 1";

fn checkerboard(object: &Object<'_>, swaps: bool) -> Result<Image, Error> {
    let colour = |name, default| {
        if let Some(texture) = object.parameter(name).filter(|element| element.tag == "texture") {
            return Err(texture.unsupported("a texture within a checkerboard", INSTEAD));
        }
        Ok(object.colour(name)?.unwrap_or(DVec3::splat(default)))
    };
    let [first, second] = DEFAULT_COLOURS;
    let mut colours = [colour("color0", first)?, colour("color1", second)?];
    if swaps {
        colours.reverse();
        object.note("color0 and color1 give a number, and are in each other's places, as in Mitsuba 3.9");
    }
    object.note(steps::CHECKERBOARD_NOTE);
    Ok(steps::checkerboard(colours))
}

/// The affine map of (u, v, 1) given by a transform of space: its part for x, y and translations. Mitsuba
/// before version 3.9 took the upper left 3×3 part instead; this is assumed if only that part has a
/// translation.
fn to_uv(element: &Element, object: &Object<'_>) -> Result<DAffine2, Error> {
    let m = transform::matrix(element)?;
    let column = |c: glam::DVec4| DVec2::new(c.x, c.y);
    let (old, new) = (column(m.z_axis), column(m.w_axis));
    let translation = if new == DVec2::ZERO { old } else { new };
    if old != DVec2::ZERO && old != translation {
        return Err(
            element.unsupported("a to_uv that mixes u and v with a third coordinate", "leave z alone")
        );
    }
    if old != DVec2::ZERO && new == DVec2::ZERO {
        object.note("the third column of to_uv is its translation, as before version 3.9 of Mitsuba, which ignores it since");
    }
    Ok(DAffine2::from_cols(column(m.x_axis), column(m.y_axis), translation))
}
