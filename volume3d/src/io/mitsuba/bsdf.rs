//! Materials.

use glam::DVec3;

use super::alpha::Alpha;
use super::element::Element;
use super::metals;
use super::object::Object;
use super::reader::Reader;
use super::support;
use crate::io::{Error, ImageProblem, SceneProblem};
use crate::scene::{Alias, Blend, Bsdf, Material, Reflectance, Relief, Roughness, Value};

/// Mitsuba's default diffuse reflectance.
pub(super) const DEFAULT_REFLECTANCE: f64 = 0.5;
/// Advice for a two-sided part of a mixture.
const AROUND_BOTH: &str = "put it around the blendbsdf, or around both parts";
/// Maximum nesting depth of materials.
const MOST_WITHIN: usize = 16;

/// Materials that transmit light straight or block it.
const FILTERS: [&str; 4] = ["null", "polarizer", "circular", "retarder"];

impl<'a> Reader<'a> {
    /// The index of the material an element describes.
    pub(super) fn material(&mut self, element: &'a Element) -> Result<usize, Error> {
        if let Some(&index) = self.material_of.get(&std::ptr::from_ref(element)) {
            return Ok(index);
        }
        if self.within == MOST_WITHIN {
            let what = "a material within itself, or within more than 16 others";
            return Err(element.unsupported(what, "leave out one of them"));
        }
        self.within += 1;
        let read = self.material_anew(element);
        self.within -= 1;
        read
    }

    fn material_anew(&mut self, element: &'a Element) -> Result<usize, Error> {
        let mut object = Object::new(element, &self.ids)?;
        let (mut two_sided, mut opacity, mut relief) = (false, None, None);
        let (mut blend, mut back) = (None, None);
        let mut within = vec![];
        loop {
            let what = object.plugin;
            let twice = match what {
                "twosided" => std::mem::replace(&mut two_sided, true),
                "mask" => {
                    opacity.replace(self.reflectance(&object, "opacity", DEFAULT_REFLECTANCE)?).is_some()
                }
                "bumpmap" => relief.replace(self.bump_map(&object)?).is_some(),
                "normalmap" => relief.replace(self.normal_map(&object)?).is_some(),
                "blendbsdf" => blend.replace(self.blend_weight(&object)?).is_some(),
                _ => break,
            };
            if twice || (blend.is_some() && !matches!(what, "blendbsdf" | "twosided")) {
                let outer = if twice { what } else { "blendbsdf" };
                let what = format!("{what} within {outer}");
                return Err(object.element.unsupported(what, "leave out one of them"));
            }
            let (inner, second) = parts(&object)?;
            let is_half = |other: usize| second.is_some() || !self.materials[other].two_sided;
            if what == "twosided" && blend.is_some_and(|(_, other)| is_half(other)) {
                return Err(object
                    .element
                    .unsupported("twosided around one part of a blendbsdf", AROUND_BOTH));
            }
            if let Some(second) = second {
                let index = self.material(second)?;
                if what == "twosided" { back = Some(index) } else { blend = blend.map(|(w, _)| (w, index)) }
            }
            object.finish()?;
            object = Object::new(inner, &self.ids)?;
            within.extend(object.element.attribute("id"));
        }
        let passed = passed(&object)?;
        let (bsdf, roughness_textures) = self.bsdf(&object)?;
        if let Some(passed) = passed {
            // The rest of the light is absorbed.
            opacity = Some(Reflectance::Constant(DVec3::splat(1.0 - passed)));
        }
        let blend = blend.map(|(weight, other)| Blend { other, weight });
        let mixed = blend.map(|blend| blend.other);
        let nested = mixed.filter(|&other| self.materials[other].blend.is_some());
        let transmits = |other: usize| self.materials[other].bsdf.transmits();
        let uneven = mixed.into_iter().chain(back).find(|&other| !self.is_plain(other));
        if let Some(other) = nested.or(uneven).or(back.filter(|&back| transmits(back))) {
            let what = format!("`{}` as one of two materials", self.materials[other].id);
            let instead = "give opaque sides, and put masks and maps around both materials";
            return Err(element.unsupported(what, instead));
        }
        let is_null = FILTERS.contains(&object.plugin);
        if blend.is_some() && is_null {
            return Err(element.unsupported("a filter as one of two materials", "put a mask around both"));
        }
        let passes = bsdf.transmits() || mixed.is_some_and(transmits) || is_null;
        if two_sided && (passes || opacity.is_some() && back.is_some()) {
            let what = "twosided around a material that light passes";
            return Err(element.unsupported(what, "leave out twosided: such a material has two sides"));
        }
        if relief.is_some() && (bsdf.transmits() || blend.is_some() || back.is_some()) {
            let what = "a bump or normal map on a material that light passes, or on two";
            return Err(element.unsupported(what, "leave it out"));
        }
        let id = self.name(element, self.materials.len());
        let material = Material::new(&id, bsdf, two_sided);
        self.materials.push(Material { opacity, relief, roughness_textures, blend, back, ..material });
        let material = self.materials.len() - 1;
        self.material_of.insert(std::ptr::from_ref(element), material);
        self.aliases.extend(within.into_iter().map(|id| Alias { id: id.to_owned(), material }));
        Ok(material)
    }

    /// Whether a material may be part of a blend.
    fn is_plain(&self, index: usize) -> bool {
        let Material { opacity, relief, back, .. } = &self.materials[index];
        opacity.is_none() && relief.is_none() && back.is_none()
    }

    /// The weight of the second material of a blend. The order of the materials is not yet known here.
    fn blend_weight(&mut self, object: &Object<'a>) -> Result<(Value, usize), Error> {
        let weight = match object.parameter("weight") {
            None => return Err(object.missing("weight")),
            Some(element) if element.tag == "texture" => {
                let index = self.number_texture(element)?;
                self.check_texels(element, index, 1.0)?;
                Value::Texture(index)
            }
            Some(_) => {
                let within = |x| (0.0..=1.0).contains(&x);
                let weight = object.number_where("weight", "a number between 0 and 1", within)?;
                Value::Constant(weight.unwrap_or_default())
            }
        };
        Ok((weight, 0))
    }

    /// The default material of a shape, as in Mitsuba: one-sided grey, or black if the shape emits.
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

    /// The BSDF, and textures of its roughness.
    fn bsdf(&mut self, object: &Object<'a>) -> Result<(Bsdf, [Option<usize>; 2]), Error> {
        let alpha = match object.plugin {
            "roughconductor" | "roughdielectric" | "roughplastic" | "pplastic" => self.alpha(object)?,
            _ => Alpha::default(),
        };
        let bsdf = match object.plugin {
            plugin if FILTERS.contains(&plugin) => {
                Bsdf::Diffuse { reflectance: Reflectance::Constant(DVec3::ZERO) }
            }
            "diffuse" => {
                Bsdf::Diffuse { reflectance: self.reflectance(object, "reflectance", DEFAULT_REFLECTANCE)? }
            }
            "conductor" | "roughconductor" => {
                let (eta, k) = index_of_refraction(object)?;
                let specular_reflectance = self.reflectance(object, "specular_reflectance", 1.0)?;
                match alpha.facets {
                    Some(Roughness { distribution, alpha, stretch }) => {
                        Bsdf::RoughConductor { distribution, alpha, stretch, eta, k, specular_reflectance }
                    }
                    None => Bsdf::Conductor { eta, k, specular_reflectance },
                }
            }
            "plastic" | "roughplastic" => self.plastic(object, alpha.facets, false)?,
            "pplastic" => {
                object.note("light is unpolarised");
                self.plastic(object, alpha.facets, true)?
            }
            "dielectric" | "roughdielectric" => Bsdf::Dielectric(self.dielectric(object, alpha.facets)?),
            "thindielectric" => Bsdf::ThinDielectric(self.dielectric(object, None)?),
            "principled" => self.principled(object)?,
            "principledthin" => self.principled_thin(object)?,
            _ => return Err(object.unknown_plugin("bsdf", support::BSDFS)),
        };
        object.finish()?;
        // A BSDF without a boundary has no microfacets.
        let textures = if bsdf.facets().is_some() { alpha.textures } else { [None; 2] };
        Ok((bsdf, textures))
    }

    fn bump_map(&mut self, object: &Object<'a>) -> Result<Relief, Error> {
        let scale = object.float("scale")?.unwrap_or(1.0);
        let texture = nested_texture(object)?.ok_or_else(|| object.missing("a nested <texture>"))?;
        Ok(Relief::Bump { texture: self.texture(texture)?, scale })
    }

    fn normal_map(&mut self, object: &Object<'a>) -> Result<Relief, Error> {
        let texture = nested_texture(object)?.ok_or_else(|| object.missing("normalmap"))?;
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
        let index = if name == "opacity" { self.number_texture(element)? } else { self.texture(element)? };
        self.check_texels(element, index, 1.0)?;
        Ok(Reflectance::Texture(index))
    }

    /// Checks that all texels of a texture are between 0 and a maximum.
    pub(super) fn check_texels(&mut self, element: &Element, index: usize, most: f64) -> Result<(), Error> {
        let within = |c: DVec3| c.min_element() >= 0.0 && c.max_element() <= most;
        let texture = &self.textures[index];
        let mut bad = (0..texture.texels.len()).filter(|&i| !within(texture.texels[i])).peekable();
        let is_of_attribute = self.attribute_textures.contains(&index);
        let is_of_triangles = bad.peek().is_some() && !is_of_attribute && texture.is_of_triangles();
        let Some(i) = bad.find(|&i| !(is_of_attribute || is_of_triangles) || !texture.is_fourth(i)) else {
            if is_of_triangles {
                self.triangle_textures.insert(index);
            }
            return Ok(());
        };
        let Some(filename) = element.value_of("filename") else {
            let expected = if most > 1.0 { "numbers between 0 and 2" } else { "numbers between 0 and 1" };
            return Err(element.bad_value("a colour", &texture.texels[i].to_string(), expected));
        };
        let problem = ImageProblem::Range { x: i % texture.width, y: i / texture.width, most };
        Err(element.referenced(Error::Image { path: element.beside(filename), problem }))
    }
}

/// The transmittance of one of [`FILTERS`]; `None` for other materials. Light is unpolarised: a polariser
/// halves it, and a retarder does not change it.
fn passed(object: &Object<'_>) -> Result<Option<f64>, Error> {
    let most = match object.plugin {
        "null" => return Ok(Some(1.0)),
        "polarizer" | "circular" => 0.5,
        "retarder" => 1.0,
        _ => return Ok(None),
    };
    object.note("light is unpolarised");
    object.colour("theta")?;
    match object.plugin {
        "polarizer" => drop(object.boolean("polarizing")?),
        "circular" => drop(object.boolean("left_handed")?),
        _ => drop(object.colour("delta")?),
    }
    let transmittance = object.colour("transmittance")?.unwrap_or(DVec3::ONE);
    if transmittance != DVec3::splat(transmittance.x) || !(0.0..=1.0).contains(&transmittance.x) {
        let value = transmittance.to_string();
        return Err(object.element.bad_value("transmittance", &value, "one number between 0 and 1"));
    }
    Ok(Some(most * transmittance.x))
}

/// The nested material, and the second one of a plugin with two.
fn parts<'a>(object: &Object<'a>) -> Result<(&'a Element, Option<&'a Element>), Error> {
    let expected =
        if object.plugin == "blendbsdf" { 2..=2 } else { 1..=1 + usize::from(object.plugin == "twosided") };
    let found = object.nested("<bsdf>");
    match found[..] {
        [] => Err(object.missing("a nested <bsdf>")),
        [first, ref rest @ ..] if expected.contains(&found.len()) => Ok((first, rest.first().copied())),
        [.., last] => Err(last.error(SceneProblem::Count {
            what: "<bsdf>".to_owned(),
            parent: object.describe(),
            found: found.len(),
            expected: if object.plugin == "blendbsdf" { "two" } else { "at most one" },
        })),
    }
}

/// The texture nested in a bump or normal map, which may be constant.
fn nested_texture<'a>(object: &Object<'a>) -> Result<Option<&'a Element>, Error> {
    match object.at_most_one("<texture>")? {
        Some(texture) => Ok(Some(texture)),
        None => object.at_most_one("<spectrum>"),
    }
}

/// η and k; the default, 0 and 1, reflects everything.
pub(super) fn index_of_refraction(object: &Object<'_>) -> Result<(DVec3, DVec3), Error> {
    let material = object.string("material")?;
    let (eta, k) = (object.colour("eta")?, object.colour("k")?);
    // Versions before 2 give the exterior index.
    let outside = object.positive("ext_eta")?.unwrap_or(1.0);
    if let Some(name) = material.filter(|name| !name.trim().eq_ignore_ascii_case("none")) {
        if eta.is_some() || k.is_some() {
            return Err(object.conflict("material", "eta and k"));
        }
        return metals::of(object, name).map(|(eta, k)| (eta / outside, k / outside));
    }
    let (eta, k) = (eta.unwrap_or(DVec3::ZERO), k.unwrap_or(DVec3::ONE));
    if eta.min_element() < 0.0 || k.min_element() < 0.0 {
        let value = format!("{eta}, {k}");
        return Err(object.element.bad_value("eta, k", &value, "numbers of at least 0"));
    }
    Ok((eta / outside, k / outside))
}
