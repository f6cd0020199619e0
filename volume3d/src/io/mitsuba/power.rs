//! Radiant quantities of emitters.

use glam::DVec3;

use super::object::Object;
use crate::io::Error;

/// A colour of at least 0; the default is 1, as in Mitsuba.
pub(super) fn radiant(object: &Object<'_>, name: &'static str) -> Result<DVec3, Error> {
    if let Some(texture) = object.parameter(name).filter(|element| element.tag == "texture") {
        let what = format!("a textured {name}");
        return Err(texture.unsupported(what, "give the same value everywhere"));
    }
    let colour = object.colour(name)?.unwrap_or(DVec3::ONE);
    if colour.min_element() >= 0.0 {
        Ok(colour)
    } else {
        Err(object.element.bad_value(name, &colour.to_string(), "numbers of at least 0"))
    }
}
