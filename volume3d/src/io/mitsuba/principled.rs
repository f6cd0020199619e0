//! The principled materials.

use super::bsdf;
use super::object::Object;
use super::reader::Reader;
use crate::io::Error;
use crate::scene::{Bsdf, Principled, PrincipledThin};

/// Mitsuba's roughness, and its `specular` where neither that nor `eta` is given.
const DEFAULT_ROUGHNESS: f64 = 0.5;
const DEFAULT_SPECULAR: f64 = 0.5;
/// Mitsuba's index of refraction of a sheet.
const DEFAULT_SHEET_ETA: f64 = 1.5;

impl<'a> Reader<'a> {
    pub(super) fn principled(&mut self, object: &Object<'a>) -> Result<Bsdf, Error> {
        isotropic(object)?;
        for rate in
            ["diffuse_reflectance_sampling_rate", "main_specular_sampling_rate", "clearcoat_sampling_rate"]
        {
            // Changes noise only.
            object.float(rate)?;
        }
        let spec_trans = weight(object, "spec_trans")?;
        Ok(Bsdf::Principled(Principled {
            base_color: self.reflectance(object, "base_color", bsdf::DEFAULT_REFLECTANCE)?,
            roughness: roughness(object)?,
            metallic: weight(object, "metallic")?,
            eta: index(object, spec_trans > 0.0)?,
            spec_tint: weight(object, "spec_tint")?,
            spec_trans,
            sheen: weight(object, "sheen")?,
            sheen_tint: weight(object, "sheen_tint")?,
            flatness: weight(object, "flatness")?,
            clearcoat: weight(object, "clearcoat")?,
            clearcoat_gloss: weight(object, "clearcoat_gloss")?,
        }))
    }

    pub(super) fn principled_thin(&mut self, object: &Object<'a>) -> Result<Bsdf, Error> {
        isotropic(object)?;
        for rate in [
            "diffuse_reflectance_sampling_rate",
            "diffuse_transmittance_sampling_rate",
            "specular_reflectance_sampling_rate",
            "specular_transmittance_sampling_rate",
        ] {
            // Changes noise only.
            object.float(rate)?;
        }
        let diff_trans =
            object.float_where("diff_trans", "a number between 0 and 2", |x| (0.0..=2.0).contains(&x))?;
        Ok(Bsdf::PrincipledThin(PrincipledThin {
            base_color: self.reflectance(object, "base_color", bsdf::DEFAULT_REFLECTANCE)?,
            roughness: roughness(object)?,
            eta: proper_index(object, object.positive("eta")?.unwrap_or(DEFAULT_SHEET_ETA))?,
            spec_tint: weight(object, "spec_tint")?,
            spec_trans: weight(object, "spec_trans")?,
            diff_trans: diff_trans.unwrap_or(0.0),
            sheen: weight(object, "sheen")?,
            sheen_tint: weight(object, "sheen_tint")?,
            flatness: weight(object, "flatness")?,
        }))
    }
}

/// That facets are the same in all directions.
fn isotropic(object: &Object<'_>) -> Result<(), Error> {
    let what = "an anisotropic principled material";
    match object.parameter("anisotropic").map(|element| element.tag == "texture") {
        Some(true) => Err(object.element.unsupported(what, "leave out anisotropic")),
        _ if weight(object, "anisotropic")? != 0.0 => {
            Err(object.element.unsupported(what, "leave out anisotropic"))
        }
        _ => Ok(()),
    }
}

fn weight(object: &Object<'_>, name: &'static str) -> Result<f64, Error> {
    let given = object.float_where(name, "a number between 0 and 1", |x| (0.0..=1.0).contains(&x))?;
    Ok(given.unwrap_or(0.0))
}

/// Positive, so that the lobe has a width; α is at least 10⁻³ anyhow.
fn roughness(object: &Object<'_>) -> Result<f64, Error> {
    let given =
        object.float_where("roughness", "a number between 0.0001 and 1", |x| (1e-4..=1.0).contains(&x))?;
    Ok(given.unwrap_or(DEFAULT_ROUGHNESS))
}

/// The index of refraction, by itself or by `specular`: η = 2/(1 − √(0.08 s)) − 1.
fn index(object: &Object<'_>, passes: bool) -> Result<f64, Error> {
    let specular =
        object.float_where("specular", "a number between 0 and 1", |x| (0.0..=1.0).contains(&x))?;
    match (object.positive("eta")?, specular) {
        (Some(_), Some(_)) => Err(object.conflict("eta", "specular")),
        // As in Mitsuba, a boundary that refracts has to be one.
        (Some(eta), None) if eta == 1.0 && passes => Ok(1.001),
        (Some(eta), None) => proper_index(object, eta),
        (None, specular) => {
            let specular = specular.unwrap_or(DEFAULT_SPECULAR);
            let specular = if specular == 0.0 { 1e-3 } else { specular };
            Ok(2.0 / (1.0 - (0.08 * specular).sqrt()) - 1.0)
        }
    }
}

fn proper_index(object: &Object<'_>, eta: f64) -> Result<f64, Error> {
    if eta == 1.0 {
        return Err(object.element.bad_value("eta", "1", "a number other than 1"));
    }
    Ok(eta)
}
