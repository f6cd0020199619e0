//! Dielectric materials and named indices of refraction.

use glam::DVec3;

use super::bsdf;
use super::object::Object;
use super::reader::Reader;
use crate::io::Error;
use crate::scene::{Bsdf, Dielectric, Plastic, Roughness, Scattering};

/// Mitsuba's names, with indices at 589 nm and room temperature (Hecht, Optics).
const INDICES: [(&str, f64); 23] = [
    ("vacuum", 1.0),
    ("helium", 1.000_036),
    ("hydrogen", 1.000_132),
    ("air", 1.000_277),
    ("carbon dioxide", 1.000_45),
    ("water", 1.333),
    ("acetone", 1.36),
    ("ethanol", 1.361),
    ("carbon tetrachloride", 1.461),
    ("glycerol", 1.4729),
    ("benzene", 1.501),
    ("silicone oil", 1.520_45),
    ("bromine", 1.661),
    ("water ice", 1.31),
    ("fused quartz", 1.458),
    ("pyrex", 1.47),
    ("acrylic glass", 1.49),
    ("polypropylene", 1.49),
    ("bk7", 1.5046),
    ("sodium chloride", 1.544),
    ("amber", 1.55),
    ("pet", 1.575),
    ("diamond", 2.419),
];

/// Accepted forms of an index.
const EXPECTED: &str = "a number, or vacuum, helium, hydrogen, air, carbon dioxide, water, acetone, ethanol, carbon tetrachloride, glycerol, benzene, silicone oil, bromine, water ice, fused quartz, pyrex, acrylic glass, polypropylene, bk7, sodium chloride, amber, pet or diamond";

/// Default interior index of glass and of plastic.
pub(super) const GLASS: f64 = 1.5046;
const PLASTIC: f64 = 1.49;

impl<'a> Reader<'a> {
    /// Plastic with single or multiple internal scattering; without a boundary, its base.
    pub(super) fn plastic(
        &mut self,
        object: &Object<'a>,
        facets: Option<Roughness>,
        once: bool,
    ) -> Result<Bsdf, Error> {
        let eta = relative_index(object, PLASTIC)?;
        let diffuse_reflectance =
            self.reflectance(object, "diffuse_reflectance", bsdf::DEFAULT_REFLECTANCE)?;
        let specular_reflectance = specular(object)?;
        let nonlinear = !once && object.boolean("nonlinear")? == Some(true);
        if eta == 1.0 {
            object.note("int_ior is ext_ior: there is no coating, and the material is diffuse");
            return Ok(Bsdf::Diffuse { reflectance: diffuse_reflectance });
        }
        let scattering = match (once, nonlinear) {
            (true, _) => Scattering::Once,
            (_, true) => Scattering::Nonlinear,
            _ => Scattering::Linear,
        };
        Ok(Bsdf::Plastic(Plastic { eta, facets, diffuse_reflectance, specular_reflectance, scattering }))
    }

    pub(super) fn dielectric(
        &mut self,
        object: &Object<'a>,
        facets: Option<Roughness>,
    ) -> Result<Dielectric, Error> {
        let eta = relative_index(object, GLASS)?;
        let specular_reflectance = specular(object)?;
        let specular_transmittance = self.reflectance(object, "specular_transmittance", 1.0)?;
        if eta == 1.0 && facets.is_some() {
            object.note("int_ior is ext_ior: there is no boundary, and light passes in a straight line");
        }
        // Microfacets do not refract without a change of index.
        let facets = facets.filter(|_| eta != 1.0);
        Ok(Dielectric { eta, facets, specular_reflectance, specular_transmittance })
    }
}

/// A constant factor of the specular reflection.
fn specular(object: &Object<'_>) -> Result<DVec3, Error> {
    let colour = object.colour("specular_reflectance")?.unwrap_or(DVec3::ONE);
    if colour.min_element() >= 0.0 && colour.max_element() <= 1.0 {
        return Ok(colour);
    }
    Err(object.element.bad_value("specular_reflectance", &colour.to_string(), "numbers between 0 and 1"))
}

/// `int_ior` over `ext_ior`, by number or name; the exterior defaults to air.
pub(super) fn relative_index(object: &Object<'_>, inside: f64) -> Result<f64, Error> {
    let inside = index(object, "int_ior")?.unwrap_or(inside);
    let outside = index(object, "ext_ior")?.unwrap_or(1.000_277);
    Ok(inside / outside)
}

fn index(object: &Object<'_>, name: &'static str) -> Result<Option<f64>, Error> {
    let Some(element) = object.parameter(name).filter(|element| element.tag == "string") else {
        return object.positive(name);
    };
    let given = object.string(name)?.unwrap_or_default();
    let found = INDICES.iter().find(|(name, _)| name.eq_ignore_ascii_case(given.trim()));
    found.map(|(_, index)| Some(*index)).ok_or_else(|| element.bad_value(name, given, EXPECTED))
}
