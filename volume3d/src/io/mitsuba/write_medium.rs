//! Medium export.

use super::write::{Writer, escaped};
use crate::scene::{Description, Medium};

impl Writer<'_> {
    pub(super) fn media(&mut self, scene: &Description) {
        for (index, Medium { extinction, albedo, asymmetry, .. }) in scene.media.iter().enumerate() {
            let id = self.ids.media[index].clone();
            self.open("medium", "homogeneous", &id);
            // Mitsuba allows sigma_t above 1 only by its scale, here a power of two, so that no digit is
            // lost.
            let most = extinction.max_element();
            let scale = if most > 1.0 { most.log2().ceil().exp2() } else { 1.0 };
            self.colour("sigma_t", *extinction / scale);
            self.value("float", "scale", scale);
            self.colour("albedo", *albedo);
            self.line("<phase type=\"hg\">");
            self.value("float", "g", asymmetry);
            self.line("</phase>");
            self.line("</medium>");
        }
    }

    /// Writes a reference to the medium of a sensor or of a side of a shape.
    pub(super) fn medium_reference(&mut self, name: &str, medium: Option<usize>) {
        if let Some(index) = medium {
            let id = escaped(&self.ids.media[index]);
            self.line(&format!("<ref name=\"{name}\" id=\"{id}\"/>"));
        }
    }
}
