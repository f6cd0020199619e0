//! Texture export.

use glam::{DAffine2, DVec2, DVec3};

use super::write::{Writer, spaced};
use crate::Image;
use crate::io::{Error, write_exr};
use crate::scene::{Description, Texture, Wrap};

impl Writer<'_> {
    /// The file of a texture, relative to the scene.
    pub(super) fn texels(&self, index: usize, texture: &Texture) -> Result<String, Error> {
        let file = self.file("texture", index, &texture.id, "exr");
        let Texture { width, height, texels, .. } = texture;
        let image = Image { width: *width, height: *height, pixels: texels.clone() };
        write_exr(&self.place(&file)?, &image)?;
        Ok(file)
    }

    pub(super) fn texture(&mut self, index: usize, texture: &Texture, file: &str) {
        self.open("texture", "bitmap", &self.ids.textures[index]);
        self.texture_parameters(texture, file);
    }

    /// Writes a texture times a factor. The format has no such factor: unless it is 1, the product is written
    /// to a file with a unique number.
    pub(super) fn scaled_texture(
        &mut self,
        name: &str,
        (scene, texture): (&Description, usize),
        number: usize,
        factor: DVec3,
    ) -> Result<(), Error> {
        if factor == DVec3::ONE {
            self.texture_reference(name, texture);
            return Ok(());
        }
        let mut scaled = scene.textures[texture].clone();
        scaled.texels.iter_mut().for_each(|texel| *texel *= factor);
        let file = self.texels(number, &scaled)?;
        self.line(&format!("<texture type=\"bitmap\" name=\"{name}\">"));
        self.texture_parameters(&scaled, &file);
        Ok(())
    }

    /// Writes the parameters of a texture, and closes its element.
    fn texture_parameters(&mut self, texture: &Texture, file: &str) {
        self.value("string", "filename", file);
        let wrap = match texture.wrap {
            Wrap::Repeat => "repeat",
            Wrap::Mirror => "mirror",
            Wrap::Clamp => "clamp",
        };
        self.value("string", "wrap_mode", wrap);
        // Mitsuba's first row is at v = 0, that of a texture here at v = 1.
        let flip = DAffine2::from_scale_angle_translation(DVec2::new(1.0, -1.0), 0.0, DVec2::Y);
        let to_uv = flip * texture.to_uv;
        if to_uv != DAffine2::IDENTITY {
            let (x, y, t) = (to_uv.matrix2.x_axis, to_uv.matrix2.y_axis, to_uv.translation);
            // Mitsuba takes the translation from the last column since version 3.9, and from the third
            // before.
            let rows =
                [[x.x, y.x, t.x, t.x], [x.y, y.y, t.y, t.y], [0.0, 0.0, 1.0, 0.0], [0.0, 0.0, 0.0, 1.0]];
            self.line("<transform name=\"to_uv\">");
            self.line(&format!("<matrix value=\"{}\"/>", spaced(rows.as_flattened())));
            self.line("</transform>");
        }
        self.line("</texture>");
    }
}
