//! Substitutes for unsupported materials in lenient mode: metal for metal, glass for glass, and otherwise
//! grey. All readable parameters are kept.

use glam::DVec3;

use super::bsdf::index_of_refraction;
use super::dielectric::{GLASS, relative_index};
use super::element::Element;
use super::object::Object;
use super::reader::Reader;
use super::{support, values};
use crate::scene::{Bsdf, Dielectric, Material, Microfacets, Principled, Reflectance, Roughness, Value};

/// α of microfacets if it cannot be read.
const ALPHA: f64 = 0.1;
/// Maximum number of materials searched within a refused one.
const MOST: usize = 64;

/// The class of a material, which determines its substitute.
#[derive(Clone, Copy, PartialEq)]
enum Kind {
    Metal { rough: bool },
    Glass { thin: bool, rough: bool },
    Principled,
    Other,
}

impl Kind {
    fn of(element: &Element) -> Self {
        let plugin = element.attribute("type").unwrap_or_default();
        match support::spelling(&element.tag, plugin).unwrap_or(plugin) {
            "conductor" => Self::Metal { rough: false },
            "roughconductor" => Self::Metal { rough: true },
            "dielectric" => Self::Glass { thin: false, rough: false },
            "roughdielectric" => Self::Glass { thin: false, rough: true },
            "thindielectric" => Self::Glass { thin: true, rough: false },
            "principled" => Self::Principled,
            _ => Self::Other,
        }
    }
}

impl<'a> Reader<'a> {
    /// Note on the substitute.
    pub(super) fn instead(&self, element: &'a Element) -> &'static str {
        match Kind::of(self.core(element)) {
            Kind::Metal { .. } => "the material is the metal alone, as far as it can be read, on both sides",
            Kind::Glass { .. } => "the material is the glass alone, as far as it can be read",
            Kind::Principled => "the material has those constants of it that can be read, on both sides",
            Kind::Other => "the material is a grey diffuse one on both sides",
        }
    }

    /// Creates the substitute of a refused material.
    pub(super) fn substitute(&mut self, element: &'a Element) -> usize {
        if let Some(&index) = self.material_of.get(&std::ptr::from_ref(element)) {
            return index;
        }
        let core = self.core(element);
        let bsdf = match (Kind::of(core), Object::new(core, &self.ids)) {
            (Kind::Metal { rough }, Ok(object)) => metal(&object, rough),
            (Kind::Glass { thin, rough }, Ok(object)) => glass(&object, thin, rough),
            (Kind::Principled, Ok(object)) => principled(&object),
            _ => Bsdf::Diffuse { reflectance: grey(element) },
        };
        let two_sided = !bsdf.transmits();
        let id = self.name(element, self.materials.len());
        self.materials.push(Material::new(&id, bsdf, two_sided));
        self.material_of.insert(std::ptr::from_ref(element), self.materials.len() - 1);
        self.materials.len() - 1
    }

    /// The first non-diffuse material within one, itself included; or itself.
    fn core(&self, element: &'a Element) -> &'a Element {
        let (mut left, mut seen) = (vec![element], 0);
        while let Some(next) = left.pop() {
            if Kind::of(next) != Kind::Other {
                return next;
            }
            seen += 1;
            if seen == MOST {
                break;
            }
            let inner = next.children.iter().rev().filter_map(|child| match child.attribute("id") {
                Some(id) if child.tag == "ref" => self.ids.get(id),
                _ => Some(child),
            });
            left.extend(inner.filter(|inner| inner.tag == "bsdf"));
        }
        element
    }
}

/// A colour within [0, 1], if it is one.
fn colour(element: &Element, names: &[&str]) -> Option<DVec3> {
    names.iter().find_map(|name| {
        let child = element.children.iter().find(|c| c.attribute("name") == Some(name))?;
        values::colour(child).ok().filter(|c| c.min_element() >= 0.0 && c.max_element() <= 1.0)
    })
}

fn grey(element: &Element) -> Reflectance {
    let names = ["reflectance", "diffuse_reflectance", "base_color"];
    Reflectance::Constant(colour(element, &names).unwrap_or(DVec3::splat(0.5)))
}

/// A readable number within [0, 1].
fn number(object: &Object<'_>, name: &'static str) -> Option<f64> {
    let within = |x| (0.0..=1.0).contains(&x);
    object.number_where(name, "a number between 0 and 1", within).ok().flatten()
}

/// Microfacets with the readable α; `None` if that is 0.
fn facets(object: &Object<'_>) -> Option<Roughness> {
    let alpha = number(object, "alpha").or_else(|| number(object, "alpha_u")).unwrap_or(ALPHA);
    let is_ggx = object.choice("distribution", &["ggx"], "").is_ok_and(|choice| choice == Some(0));
    let distribution = if is_ggx { Microfacets::Ggx } else { Microfacets::Beckmann };
    (alpha > 0.0).then(|| Roughness::new(distribution, alpha.max(1e-4)))
}

/// A metal; it reflects all light if the indices of refraction are unknown.
fn metal(object: &Object<'_>, rough: bool) -> Bsdf {
    let (eta, k) = index_of_refraction(object).unwrap_or((DVec3::ZERO, DVec3::ONE));
    let factor = colour(object.element, &["specular_reflectance"]).unwrap_or(DVec3::ONE);
    let specular_reflectance = Reflectance::Constant(factor);
    match facets(object).filter(|_| rough) {
        None => Bsdf::Conductor { eta, k, specular_reflectance },
        Some(Roughness { distribution, alpha, stretch }) => {
            Bsdf::RoughConductor { distribution, alpha, stretch, eta, k, specular_reflectance }
        }
    }
}

fn glass(object: &Object<'_>, thin: bool, rough: bool) -> Bsdf {
    let eta = relative_index(object, GLASS).unwrap_or(GLASS);
    let factor = |name: &str| colour(object.element, &[name]).unwrap_or(DVec3::ONE);
    let dielectric = Dielectric {
        eta,
        facets: facets(object).filter(|_| rough && eta != 1.0),
        specular_reflectance: factor("specular_reflectance"),
        specular_transmittance: Reflectance::Constant(factor("specular_transmittance")),
    };
    if thin { Bsdf::ThinDielectric(dielectric) } else { Bsdf::Dielectric(dielectric) }
}

/// A metal if `metallic` cannot be read.
fn principled(object: &Object<'_>) -> Bsdf {
    let value = |name, other| match object.parameter(name) {
        None => 0.0,
        Some(_) => number(object, name).unwrap_or(other),
    };
    let numbers = Principled {
        base_color: grey(object.element),
        roughness: number(object, "roughness").unwrap_or(0.5),
        anisotropic: 0.0,
        metallic: value("metallic", 1.0),
        eta: 1.5,
        spec_tint: value("spec_tint", 0.0),
        spec_trans: value("spec_trans", 0.0),
        sheen: 0.0,
        sheen_tint: 0.0,
        flatness: 0.0,
        clearcoat: 0.0,
        clearcoat_gloss: 0.0,
    };
    Bsdf::Principled(numbers.map(Value::Constant))
}
