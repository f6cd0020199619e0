//! Spot and projector lights.

use glam::{DMat3, DVec3};

use super::element::Element;
use super::object::Object;
use super::power::radiant;
use super::reader::Reader;
use super::sensor::field_of_view;
use super::transform;
use crate::io::{Error, ImageProblem};
use crate::scene::Light;

/// Mitsuba's default cutoff angle in degrees, and the default beam width relative to it.
const DEFAULT_CUTOFF: f64 = 20.0;
const DEFAULT_BEAM: f64 = 0.75;

pub(super) fn spot<'a>(reader: &mut Reader<'a>, object: &Object<'a>, id: String) -> Result<Light, Error> {
    let (position, to_world) = place(object)?;
    let acute = |x: f64| x > 0.0 && x < 90.0;
    let cutoff =
        object.float_where("cutoff_angle", "an angle between 0 and 90", acute)?.unwrap_or(DEFAULT_CUTOFF);
    let beam = object.float_where("beam_width", "an angle between 0 and the cutoff angle", |x| {
        (0.0..=cutoff).contains(&x)
    })?;
    let texture = match object.parameter("texture") {
        Some(element) => Some(slide(reader, element)?),
        None => None,
    };
    Ok(Light::Spot {
        id,
        position,
        to_world,
        intensity: radiant(object, "intensity")?,
        cutoff: cutoff.to_radians(),
        beam: beam.unwrap_or(DEFAULT_BEAM * cutoff).to_radians(),
        texture,
    })
}

pub(super) fn projector<'a>(
    reader: &mut Reader<'a>,
    object: &Object<'a>,
    id: String,
) -> Result<Light, Error> {
    let (position, to_world) = place(object)?;
    let scale = object.float_where("scale", "a number of at least 0", |x| x >= 0.0)?.unwrap_or(1.0);
    let (texture, colour) = match object.parameter("irradiance") {
        None => return Err(object.missing("irradiance")),
        Some(element) if element.tag == "texture" => (Some(slide(reader, element)?), DVec3::ONE),
        Some(_) => (None, radiant(object, "irradiance")?),
    };
    let aspect = texture.map_or(1.0, |index| {
        let texture = &reader.textures[index];
        texture.width as f64 / texture.height as f64
    });
    // As for a sensor, with its defaults.
    let field_of_view = field_of_view(object, aspect)?;
    Ok(Light::Projector { id, position, to_world, intensity: colour * scale, field_of_view, aspect, texture })
}

/// The position and rotation of the light.
fn place(object: &Object<'_>) -> Result<(DVec3, DMat3), Error> {
    match object.affine("to_world")? {
        Some((element, map)) => Ok((map.translation, transform::orthogonal(element, &map)?)),
        None => Ok((DVec3::ZERO, DMat3::IDENTITY)),
    }
}

/// A non-negative texture.
pub(super) fn slide<'a>(reader: &mut Reader<'a>, element: &'a Element) -> Result<usize, Error> {
    if reader.asks(element) {
        let what = "a mesh_attribute as what an emitter sends out";
        return Err(element.unsupported(what, "give an image or a colour"));
    }
    let index = reader.texture(element)?;
    let texture = &reader.textures[index];
    match texture.texels.iter().position(|c| c.min_element() < 0.0) {
        None => Ok(index),
        Some(i) => {
            let path = element.beside(element.value_of("filename").unwrap_or_default());
            let problem = ImageProblem::Negative { x: i % texture.width, y: i / texture.width };
            Err(element.referenced(Error::Image { path, problem }))
        }
    }
}
