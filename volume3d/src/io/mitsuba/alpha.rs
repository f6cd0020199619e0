//! Microfacet roughness α: a number, or textures, along u and across it.
//!
//! α = 0 is the ideal (specular) boundary, and so is α between 0 and 10⁻⁴, as in Mitsuba.

use super::object::Object;
use super::reader::Reader;
use crate::io::Error;
use crate::scene::{Microfacets, Roughness};

/// Mitsuba's default roughness.
const DEFAULT_ALPHA: f64 = 0.1;
/// Minimum α of microfacets, as in Mitsuba.
const LEAST_ALPHA: f64 = 1e-4;

/// Microfacets of a material, and texture factors of their α along u and across it.
#[derive(Default)]
pub(super) struct Alpha {
    /// `None` for an ideal boundary.
    pub(super) facets: Option<Roughness>,
    pub(super) textures: [Option<usize>; 2],
}

/// The value given for one α.
#[derive(Clone, Copy, PartialEq)]
enum Given {
    Number(f64),
    Texture(usize),
}

impl Given {
    /// The factor on a texture, or the number.
    fn number(self) -> f64 {
        match self {
            Self::Number(alpha) => alpha,
            Self::Texture(_) => 1.0,
        }
    }

    fn texture(self) -> Option<usize> {
        match self {
            Self::Number(_) => None,
            Self::Texture(texture) => Some(texture),
        }
    }
}

impl<'a> Reader<'a> {
    pub(super) fn alpha(&mut self, object: &Object<'a>) -> Result<Alpha, Error> {
        // Affects noise only.
        object.boolean("sample_visible")?;
        let distribution = match object.choice("distribution", &["beckmann", "ggx"], "beckmann or ggx")? {
            Some(1) => Microfacets::Ggx,
            _ => Microfacets::Beckmann,
        };
        let mut given = [None; 3];
        for (name, given) in ["alpha", "alpha_u", "alpha_v"].into_iter().zip(&mut given) {
            *given = self.given(object, name)?;
        }
        let both = match given {
            [alpha, None, None] => [alpha.unwrap_or(Given::Number(DEFAULT_ALPHA)); 2],
            [None, Some(along), Some(across)] => [along, across],
            [None, None, _] => return Err(object.missing("alpha_u beside alpha_v")),
            [None, _, None] => return Err(object.missing("alpha_v beside alpha_u")),
            [Some(_), _, _] => return Err(object.conflict("alpha", "alpha_u and alpha_v")),
        };
        if both == [Given::Number(0.0); 2] {
            if object.plugin != "pplastic" {
                object.note(format!("{} of alpha 0 is the smooth material", object.plugin));
            }
            return Ok(Alpha::default());
        }
        let textures = both.map(Given::texture);
        let [along, across] = both.map(Given::number);
        if along.min(across) < LEAST_ALPHA {
            object.note("an alpha below 0.0001 is read as that, as in Mitsuba");
        }
        let [alpha, across] = [along.max(LEAST_ALPHA), across.max(LEAST_ALPHA)];
        let stretch = if alpha == across { 1.0 } else { across / alpha };
        if stretch != 1.0 && object.plugin == "roughplastic" {
            return Err(object.element.unsupported("an alpha_u other than alpha_v", "give one alpha"));
        }
        Ok(Alpha { facets: Some(Roughness { distribution, alpha, stretch }), textures })
    }

    fn given(&mut self, object: &Object<'a>, name: &'static str) -> Result<Option<Given>, Error> {
        let Some(element) = object.parameter(name).filter(|element| element.tag == "texture") else {
            let expected = "a number of at least 0";
            return Ok(object.number_where(name, expected, |alpha| alpha >= 0.0)?.map(Given::Number));
        };
        // The transmittance of its coating is computed for one α.
        if object.plugin == "roughplastic" {
            let what = format!("a textured {name} of {}", object.plugin);
            return Err(element.unsupported(what, "give a number; Mitsuba takes no texture there either"));
        }
        let index = self.number_texture(element)?;
        self.check_texels(element, index, 1.0)?;
        Ok(Some(Given::Texture(index)))
    }
}
