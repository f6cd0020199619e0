//! Principled materials.

use super::bsdf;
use super::object::Object;
use super::reader::Reader;
use crate::io::Error;
use crate::scene::{Bsdf, Principled, PrincipledThin, Value};

/// Mitsuba's default roughness, and its default `specular` if `eta` is not given either.
const DEFAULT_ROUGHNESS: f64 = 0.5;
const DEFAULT_SPECULAR: f64 = 0.5;
/// Mitsuba's default index of refraction of a thin sheet.
const DEFAULT_SHEET_ETA: f64 = 1.5;

impl<'a> Reader<'a> {
    pub(super) fn principled(&mut self, object: &Object<'a>) -> Result<Bsdf, Error> {
        for rate in
            ["diffuse_reflectance_sampling_rate", "main_specular_sampling_rate", "clearcoat_sampling_rate"]
        {
            // Affects noise only.
            object.float(rate)?;
        }
        let spec_trans = self.weight(object, "spec_trans")?;
        Ok(Bsdf::Principled(Principled {
            base_color: self.reflectance(object, "base_color", bsdf::DEFAULT_REFLECTANCE)?,
            roughness: self.value(object, "roughness", DEFAULT_ROUGHNESS, 1.0)?,
            anisotropic: self.weight(object, "anisotropic")?,
            metallic: self.weight(object, "metallic")?,
            eta: index(object, spec_trans.may_differ_from(0.0))?,
            spec_tint: self.weight(object, "spec_tint")?,
            spec_trans,
            sheen: self.weight(object, "sheen")?,
            sheen_tint: self.weight(object, "sheen_tint")?,
            flatness: self.weight(object, "flatness")?,
            clearcoat: self.weight(object, "clearcoat")?,
            clearcoat_gloss: self.weight(object, "clearcoat_gloss")?,
        }))
    }

    pub(super) fn principled_thin(&mut self, object: &Object<'a>) -> Result<Bsdf, Error> {
        for rate in [
            "diffuse_reflectance_sampling_rate",
            "diffuse_transmittance_sampling_rate",
            "specular_reflectance_sampling_rate",
            "specular_transmittance_sampling_rate",
        ] {
            // Affects noise only.
            object.float(rate)?;
        }
        Ok(Bsdf::PrincipledThin(PrincipledThin {
            base_color: self.reflectance(object, "base_color", bsdf::DEFAULT_REFLECTANCE)?,
            roughness: self.value(object, "roughness", DEFAULT_ROUGHNESS, 1.0)?,
            anisotropic: self.weight(object, "anisotropic")?,
            eta: object.positive("eta")?.unwrap_or(DEFAULT_SHEET_ETA),
            spec_tint: self.weight(object, "spec_tint")?,
            spec_trans: self.weight(object, "spec_trans")?,
            diff_trans: self.value(object, "diff_trans", 0.0, 2.0)?,
            sheen: self.weight(object, "sheen")?,
            sheen_tint: self.weight(object, "sheen_tint")?,
            flatness: self.weight(object, "flatness")?,
        }))
    }

    fn weight(&mut self, object: &Object<'a>, name: &'static str) -> Result<Value, Error> {
        self.value(object, name, 0.0, 1.0)
    }

    /// A number between 0 and a maximum, or a texture of such numbers.
    fn value(
        &mut self,
        object: &Object<'a>,
        name: &'static str,
        default: f64,
        most: f64,
    ) -> Result<Value, Error> {
        let Some(element) = object.parameter(name).filter(|element| element.tag == "texture") else {
            return Ok(value_in(object, name, most)?.unwrap_or(default).into());
        };
        let index = self.number_texture(element)?;
        self.check_texels(element, index, most)?;
        Ok(Value::Texture(index))
    }
}

fn value_in(object: &Object<'_>, name: &'static str, most: f64) -> Result<Option<f64>, Error> {
    let expected = if most > 1.0 { "a number between 0 and 2" } else { "a number between 0 and 1" };
    object.number_where(name, expected, |x| (0.0..=most).contains(&x))
}

/// The index of refraction, given directly or by `specular`: η = 2/(1 − √(0.08 s)) − 1.
fn index(object: &Object<'_>, passes: bool) -> Result<f64, Error> {
    let specular =
        object.float_where("specular", "a number between 0 and 1", |x| (0.0..=1.0).contains(&x))?;
    match (object.positive("eta")?, specular) {
        (Some(_), Some(_)) => Err(object.conflict("eta", "specular")),
        // As in Mitsuba, a refracting boundary needs η ≠ 1.
        (Some(eta), None) if eta == 1.0 && passes => Ok(1.001),
        (Some(eta), None) => Ok(eta),
        (None, specular) => {
            let specular = specular.unwrap_or(DEFAULT_SPECULAR);
            let specular = if specular == 0.0 { 1e-3 } else { specular };
            Ok(2.0 / (1.0 - (0.08 * specular).sqrt()) - 1.0)
        }
    }
}
