//! Emitters.

use glam::{DAffine2, DMat3, DVec3};

use super::element::Element;
use super::object::Object;
use super::power::radiant;
use super::reader::Reader;
use super::support;
use super::{spot, transform};
use crate::io::{Error, ImageProblem, SceneProblem};
use crate::scene::{Environment, Light, Wrap};

/// The radiance of a shape's emitter, and its texture factor.
pub(super) fn area<'a>(
    reader: &mut Reader<'a>,
    object: &Object<'a>,
) -> Result<(DVec3, Option<usize>), Error> {
    if object.plugin != "area" {
        return Err(object.unknown_plugin("emitter", "area, within a shape"));
    }
    let radiance = match object.parameter("radiance").filter(|element| element.tag == "texture") {
        Some(element) => (DVec3::ONE, Some(spot::slide(reader, element)?)),
        None => (radiant(object, "radiance")?, None),
    };
    object.finish()?;
    Ok(radiance)
}

/// An emitter without a shape.
pub(super) fn light<'a>(reader: &mut Reader<'a>, element: &'a Element) -> Result<(), Error> {
    let object = Object::new(element, &reader.ids)?;
    let count = reader.lights.len() + usize::from(reader.environment.is_some());
    let id = reader.name(element, count);
    match object.plugin {
        "constant" => {
            reader.check_no_environment(element)?;
            let radiance = radiant(&object, "radiance")?;
            reader.environment = Some(Environment::Constant { id, radiance });
        }
        "envmap" => {
            reader.check_no_environment(element)?;
            reader.environment = Some(map(reader, &object, id)?);
        }
        "directional" => reader.lights.push(directional(&object, id)?),
        "point" => reader.lights.push(point(&object, id)?),
        "spot" => {
            let light = spot::spot(reader, &object, id)?;
            reader.lights.push(light);
        }
        "projector" => {
            let light = spot::projector(reader, &object, id)?;
            reader.lights.push(light);
        }
        "sky" | "sunsky" if reader.journal.is_lenient => {
            reader.check_no_environment(element)?;
            object.note(format!("emitter \"{}\" is read as a constant sky of radiance 1", object.plugin));
            reader.environment = Some(Environment::Constant { id, radiance: DVec3::ONE });
            return Ok(());
        }
        "area" => {
            let instead = "put it inside the <shape> that emits";
            return Err(element.unsupported("an area emitter without a shape", instead));
        }
        _ => {
            return Err(object.unknown_plugin("emitter", support::EMITTERS));
        }
    }
    object.ignore("medium", None, "what surfaces and the sensor say of media tells where it stands");
    object.finish()
}

fn map<'a>(reader: &mut Reader<'a>, object: &Object<'a>, id: String) -> Result<Environment, Error> {
    let scale = object.float_where("scale", "a number of at least 0", |x| x >= 0.0)?.unwrap_or(1.0);
    // Affects noise only.
    object.boolean("mis_compensation")?;
    let to_world = match object.affine("to_world")? {
        Some((element, map)) => transform::orthogonal(element, &map)?,
        None => DMat3::IDENTITY,
    };
    let image = reader.image(object, false)?;
    if let Some(i) = image.pixels.iter().position(|c| c.min_element() < 0.0) {
        let path = object.element.beside(object.element.value_of("filename").unwrap_or_default());
        let problem = ImageProblem::Negative { x: i % image.width, y: i / image.width };
        return Err(object.element.referenced(Error::Image { path, problem }));
    }
    let texture = reader.add_texture(object.element, image, Wrap::Repeat, DAffine2::IDENTITY);
    Ok(Environment::Map { id, texture, scale, to_world })
}

fn directional(object: &Object<'_>, id: String) -> Result<Light, Error> {
    // The transform applies to the unit vector z, and its scale does not change the irradiance, as in
    // Mitsuba.
    let (direction, scale) = match (object.vector("direction")?, object.affine("to_world")?) {
        (Some(_), Some(_)) => return Err(object.conflict("direction", "to_world")),
        (Some(direction), None) => (direction, 1.0),
        (None, Some((_, map))) => (map.matrix3.z_axis, map.matrix3.z_axis.length()),
        (None, None) => (DVec3::Z, 1.0),
    };
    let direction = direction.try_normalize().ok_or_else(|| {
        object.element.bad_value("direction", &direction.to_string(), "a vector other than 0")
    })?;
    let irradiance = radiant(object, "irradiance")? * scale;
    let kappa = object.positive("kappa")?.unwrap_or(f64::INFINITY);
    Ok(Light::Directional { id, direction, irradiance, kappa })
}

fn point(object: &Object<'_>, id: String) -> Result<Light, Error> {
    let position = match (object.vector("position")?, object.affine("to_world")?) {
        (Some(_), Some(_)) => return Err(object.conflict("position", "to_world")),
        (Some(position), None) => position,
        (None, Some((_, map))) => map.translation,
        (None, None) => {
            let (plugin, name) = (object.describe(), "position or to_world".to_owned());
            return Err(object.element.error(SceneProblem::Missing { plugin, name }));
        }
    };
    Ok(Light::Point { id, position, intensity: radiant(object, "intensity")? })
}
