//! Materials.

use glam::DVec3;

use super::element::Element;
use super::metals;
use super::object::Object;
use super::reader::Reader;
use super::support;
use crate::io::{Error, ImageProblem};
use crate::scene::{Bsdf, Material, Microfacets, Reflectance, Relief};

/// Mitsuba's diffuse reflectance where none is given.
pub(super) const DEFAULT_REFLECTANCE: f64 = 0.5;
/// Mitsuba's roughness where none is given.
const DEFAULT_ALPHA: f64 = 0.1;

impl<'a> Reader<'a> {
    /// The index of the material an element describes.
    pub(super) fn material(&mut self, element: &'a Element) -> Result<usize, Error> {
        if let Some(&index) = self.material_of.get(&std::ptr::from_ref(element)) {
            return Ok(index);
        }
        let mut object = Object::new(element, &self.ids)?;
        let (mut two_sided, mut opacity, mut relief) = (false, None, None);
        loop {
            let twice = match object.plugin {
                "twosided" => std::mem::replace(&mut two_sided, true),
                "mask" => {
                    opacity.replace(self.reflectance(&object, "opacity", DEFAULT_REFLECTANCE)?).is_some()
                }
                "bumpmap" => relief.replace(self.bump_map(&object)?).is_some(),
                "normalmap" => relief.replace(self.normal_map(&object)?).is_some(),
                _ => break,
            };
            if twice {
                let what = format!("{0} within {0}", object.plugin);
                return Err(object.element.unsupported(what, "leave out one of them"));
            }
            let inner = object.at_most_one("<bsdf>")?.ok_or_else(|| object.missing("a nested <bsdf>"))?;
            object.finish()?;
            object = Object::new(inner, &self.ids)?;
        }
        let bsdf = self.bsdf(&object)?;
        if two_sided && bsdf.transmits() {
            let what = "twosided around a material that light passes";
            return Err(element.unsupported(what, "leave out twosided: such a material has two sides"));
        }
        if relief.is_some() && bsdf.transmits() {
            let what = "a bump or normal map on a material that light passes";
            return Err(element.unsupported(what, "leave it out"));
        }
        let id = self.name(element, self.materials.len());
        self.materials.push(Material { opacity, relief, ..Material::new(&id, bsdf, two_sided) });
        self.material_of.insert(std::ptr::from_ref(element), self.materials.len() - 1);
        Ok(self.materials.len() - 1)
    }

    /// The material of a shape without one, as in Mitsuba: grey on one side, or black if the shape emits.
    pub(super) fn default_material(&mut self, emits: bool) -> usize {
        if let Some(index) = self.default_materials[usize::from(emits)] {
            return index;
        }
        let mut id = if emits { "default_emitter" } else { "default" }.to_owned();
        while self.ids.contains_key(id.as_str()) {
            id.push('_');
        }
        let reflectance = DVec3::splat(if emits { 0.0 } else { DEFAULT_REFLECTANCE });
        self.materials.push(Material { two_sided: false, ..Material::diffuse(&id, reflectance) });
        *self.default_materials[usize::from(emits)].insert(self.materials.len() - 1)
    }

    fn bsdf(&mut self, object: &Object<'a>) -> Result<Bsdf, Error> {
        let bsdf = match object.plugin {
            "diffuse" => {
                Bsdf::Diffuse { reflectance: self.reflectance(object, "reflectance", DEFAULT_REFLECTANCE)? }
            }
            "conductor" => {
                let (eta, k) = index_of_refraction(object)?;
                let specular_reflectance = self.reflectance(object, "specular_reflectance", 1.0)?;
                Bsdf::Conductor { eta, k, specular_reflectance }
            }
            "roughconductor" => {
                let (eta, k) = index_of_refraction(object)?;
                // Changes noise only.
                object.boolean("sample_visible")?;
                let [alpha, across] = roughnesses(object)?;
                Bsdf::RoughConductor {
                    distribution: distribution(object)?,
                    alpha,
                    stretch: across / alpha,
                    eta,
                    k,
                    specular_reflectance: self.reflectance(object, "specular_reflectance", 1.0)?,
                }
            }
            "plastic" => self.plastic(object, false)?,
            "roughplastic" => self.plastic(object, true)?,
            "dielectric" => Bsdf::Dielectric(self.dielectric(object, false)?),
            "thindielectric" => Bsdf::ThinDielectric(self.dielectric(object, false)?),
            "roughdielectric" => Bsdf::Dielectric(self.dielectric(object, true)?),
            "principled" => self.principled(object)?,
            "principledthin" => self.principled_thin(object)?,
            _ => return Err(object.unknown_plugin("bsdf", support::BSDFS)),
        };
        object.finish()?;
        Ok(bsdf)
    }

    fn bump_map(&mut self, object: &Object<'a>) -> Result<Relief, Error> {
        let scale = object.float("scale")?.unwrap_or(1.0);
        let texture = object.at_most_one("<texture>")?.ok_or_else(|| object.missing("a nested <texture>"))?;
        Ok(Relief::Bump { texture: self.texture(texture)?, scale })
    }

    fn normal_map(&mut self, object: &Object<'a>) -> Result<Relief, Error> {
        let texture = object.at_most_one("<texture>")?.ok_or_else(|| object.missing("normalmap"))?;
        Ok(Relief::Normals { texture: self.texture(texture)? })
    }

    /// A colour or a texture within [0, 1].
    pub(super) fn reflectance(
        &mut self,
        object: &Object<'a>,
        name: &'static str,
        default: f64,
    ) -> Result<Reflectance, Error> {
        let within = |c: DVec3| c.min_element() >= 0.0 && c.max_element() <= 1.0;
        let Some(element) = object.parameter(name) else {
            return Ok(Reflectance::Constant(DVec3::splat(default)));
        };
        if element.tag != "texture" {
            let colour = object.colour(name)?.unwrap_or(DVec3::splat(default));
            if within(colour) {
                return Ok(Reflectance::Constant(colour));
            }
            return Err(element.bad_value(name, &colour.to_string(), "numbers between 0 and 1"));
        }
        let index = self.texture(element)?;
        self.check_texels(element, index, 1.0)?;
        Ok(Reflectance::Texture(index))
    }

    /// That all texels of a texture are between 0 and some number.
    pub(super) fn check_texels(&self, element: &Element, index: usize, most: f64) -> Result<(), Error> {
        let within = |c: DVec3| c.min_element() >= 0.0 && c.max_element() <= most;
        let texture = &self.textures[index];
        let Some(i) = texture.texels.iter().position(|&c| !within(c)) else { return Ok(()) };
        let Some(filename) = element.value_of("filename") else {
            let expected = if most > 1.0 { "numbers between 0 and 2" } else { "numbers between 0 and 1" };
            return Err(element.bad_value("a colour", &texture.texels[i].to_string(), expected));
        };
        let problem = ImageProblem::Range { x: i % texture.width, y: i / texture.width, most };
        Err(element.referenced(Error::Image { path: element.beside(filename), problem }))
    }
}

pub(super) fn distribution(object: &Object<'_>) -> Result<Microfacets, Error> {
    let names = ["beckmann", "ggx"];
    let choice = object.choice("distribution", &names, "beckmann or ggx")?;
    Ok(if choice == Some(1) { Microfacets::Ggx } else { Microfacets::Beckmann })
}

/// α of facets that are the same in all directions.
pub(super) fn roughness(object: &Object<'_>) -> Result<f64, Error> {
    let [u, v] = roughnesses(object)?;
    if u != v {
        return Err(object.element.unsupported("an alpha_u other than alpha_v", "give one alpha"));
    }
    Ok(u)
}

/// α along u, the first texture coordinate, and across it.
fn roughnesses(object: &Object<'_>) -> Result<[f64; 2], Error> {
    let (u, v) = (object.positive("alpha_u")?, object.positive("alpha_v")?);
    let alpha = object.positive("alpha")?;
    match (alpha, u, v) {
        (alpha, None, None) => Ok([alpha.unwrap_or(DEFAULT_ALPHA); 2]),
        (None, Some(u), Some(v)) => Ok([u, v]),
        (None, None, _) => Err(object.missing("alpha_u beside alpha_v")),
        (None, _, None) => Err(object.missing("alpha_v beside alpha_u")),
        (Some(_), _, _) => Err(object.conflict("alpha", "alpha_u and alpha_v")),
    }
}

/// η and k; 0 and 1, which reflect everything, unless given.
fn index_of_refraction(object: &Object<'_>) -> Result<(DVec3, DVec3), Error> {
    let material = object.string("material")?;
    let (eta, k) = (object.colour("eta")?, object.colour("k")?);
    if let Some(name) = material.filter(|name| !name.trim().eq_ignore_ascii_case("none")) {
        if eta.is_some() || k.is_some() {
            return Err(object.conflict("material", "eta and k"));
        }
        return metals::of(object, name);
    }
    let (eta, k) = (eta.unwrap_or(DVec3::ZERO), k.unwrap_or(DVec3::ONE));
    if eta.min_element() < 0.0 || k.min_element() < 0.0 {
        let value = format!("{eta}, {k}");
        return Err(object.element.bad_value("eta, k", &value, "numbers of at least 0"));
    }
    Ok((eta, k))
}
