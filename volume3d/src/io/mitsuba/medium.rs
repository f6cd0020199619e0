//! Media.

use glam::DVec3;

use super::element::Element;
use super::object::Object;
use super::reader::Reader;
use super::{integrator, support};
use crate::io::Error;
use crate::scene::{Boundary, Medium};

/// Mitsuba's default parameters.
const DEFAULT_EXTINCTION: f64 = 1.0;
const DEFAULT_ALBEDO: f64 = 0.75;
const DEFAULT_ASYMMETRY: f64 = 0.8;

impl<'a> Reader<'a> {
    /// The media on both sides of a shape with a material, if it has any that are visible.
    pub(super) fn boundary(
        &mut self,
        object: &Object<'a>,
        material: usize,
    ) -> Result<Option<Boundary>, Error> {
        if !self.sees_media {
            object.ignore("medium", None, integrator::NO_MEDIA);
            return Ok(None);
        }
        if self.is_opaque(material) {
            object.ignore("medium", Some("interior"), "no light passes the surface");
        }
        let is_seen = |element: &&Element| element.tag == "medium";
        let side = |name| object.parameter(name).filter(is_seen);
        let (interior, exterior) = (side("interior").filter(|_| !self.is_opaque(material)), side("exterior"));
        if interior.is_none() && exterior.is_none() {
            return Ok(None);
        }
        let mut medium = |element: Option<&'a Element>| {
            let element = element?;
            let read = self.medium(element);
            self.journal.accept(read, element, "the medium is left out")
        };
        Ok(Some(Boundary { interior: medium(interior), exterior: medium(exterior) }))
    }

    /// The index of the medium that an element describes.
    pub(super) fn medium(&mut self, element: &'a Element) -> Result<usize, Error> {
        if let Some(&index) = self.medium_of.get(&std::ptr::from_ref(element)) {
            return Ok(index);
        }
        let object = Object::new(element, &self.ids)?;
        if object.plugin != "homogeneous" {
            return Err(object.unknown_plugin("medium", support::MEDIA));
        }
        let (extinction, albedo) = self.coefficients(&object)?;
        let asymmetry = match object.at_most_one("<phase>")? {
            Some(element) => asymmetry(&Object::new(element, &self.ids)?)?,
            None => 0.0,
        };
        object.finish()?;
        let id = self.name(element, self.media.len());
        self.media.push(Medium { id, extinction, albedo, asymmetry });
        self.medium_of.insert(std::ptr::from_ref(element), self.media.len() - 1);
        Ok(self.media.len() - 1)
    }

    /// Extinction σ and albedo, given directly or by scattering and absorption coefficients.
    fn coefficients(&self, object: &Object<'a>) -> Result<(DVec3, DVec3), Error> {
        let scale = object.float_where("scale", "a number of at least 0", |s| s >= 0.0)?.unwrap_or(1.0);
        let any = f64::INFINITY;
        let sigma_t = self.uniform(object, "sigma_t", any)?;
        let albedo = self.uniform(object, "albedo", 1.0)?;
        let parts = [self.uniform(object, "sigma_s", any)?, self.uniform(object, "sigma_a", any)?];
        match (parts, sigma_t.or(albedo)) {
            ([None, None], _) => {
                let sigma_t = sigma_t.unwrap_or(DVec3::splat(DEFAULT_EXTINCTION));
                Ok((scale * sigma_t, albedo.unwrap_or(DVec3::splat(DEFAULT_ALBEDO))))
            }
            ([Some(scattered), Some(absorbed)], None) => {
                let sum = scattered + absorbed;
                // Without extinction the albedo has no effect.
                let albedo = scattered / sum.map(|s| if s > 0.0 { s } else { 1.0 });
                Ok((scale * sum, albedo))
            }
            (_, Some(_)) => Err(object.conflict("sigma_t and albedo", "sigma_s and sigma_a")),
            ([None, _], _) => Err(object.missing("sigma_s beside sigma_a")),
            ([_, None], _) => Err(object.missing("sigma_a beside sigma_s")),
        }
    }

    /// A uniform colour from 0 to `most`, given directly or as a `<volume>`.
    fn uniform(&self, object: &Object<'a>, name: &'static str, most: f64) -> Result<Option<DVec3>, Error> {
        let Some(element) = object.parameter(name) else { return Ok(None) };
        let colour = if element.tag == "volume" {
            let volume = Object::new(element, &self.ids)?;
            if volume.plugin != "constvolume" {
                return Err(volume.unknown_plugin("volume", "constvolume"));
            }
            let colour = volume.colour("value")?.ok_or_else(|| volume.missing("value"))?;
            volume.finish()?;
            colour
        } else {
            object.colour(name)?.unwrap_or(DVec3::ZERO)
        };
        if colour.min_element() >= 0.0 && colour.max_element() <= most {
            return Ok(Some(colour));
        }
        let expected = if most == 1.0 { "numbers between 0 and 1" } else { "numbers of at least 0" };
        Err(element.bad_value(name, &colour.to_string(), expected))
    }
}

/// The mean cosine g of a phase function.
fn asymmetry(object: &Object<'_>) -> Result<f64, Error> {
    let g = match object.plugin {
        "isotropic" => 0.0,
        "hg" => {
            let within = |g: f64| g.abs() < 1.0;
            object
                .float_where("g", "a number between −1 and 1, without these", within)?
                .unwrap_or(DEFAULT_ASYMMETRY)
        }
        _ => return Err(object.unknown_plugin("phase", support::PHASES)),
    };
    object.finish()?;
    Ok(g)
}
