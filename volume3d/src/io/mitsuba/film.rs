//! Films and reconstruction filters.

use super::object::{Ids, Object};
use super::support;
use crate::io::Error;
use crate::scene::{Crop, Film, Filter};

/// Maximum number of columns and of rows, so that their product does not overflow.
const MAX_SIDE: i64 = 1 << 16;
/// Mitsuba's default film size.
pub(super) const DEFAULT_SIZE: (usize, usize) = (768, 576);

pub(super) fn film_of_size((width, height): (usize, usize)) -> Film {
    Film { width, height, crop: None, sample_border: false, filter: Filter::Gaussian { deviation: 0.5 } }
}

/// Reads a film, optionally with another size.
pub(super) fn film<'a>(
    object: &Object<'a>,
    ids: &Ids<'a>,
    size: Option<(usize, usize)>,
) -> Result<Film, Error> {
    match object.plugin {
        "hdrfilm" => {}
        "ldrfilm" | "mfilm" => {
            object.note(format!("film \"{}\" is read as hdrfilm: pixels are linear", object.plugin));
        }
        "transient_hdr_film" | "streakhdrfilm" => {
            object.note(format!(
                "film \"{}\" is read as hdrfilm: the image is of light at all times",
                object.plugin
            ));
        }
        _ if object.journal.is_lenient => {
            object.note(format!("film \"{}\" is read as hdrfilm", object.plugin));
        }
        _ => return Err(object.unknown_plugin("film", support::FILMS)),
    }
    let side = |name, default: usize| {
        let value = object.integer_in(name, 1..=MAX_SIDE, "a whole number from 1 to 65536")?;
        Ok::<_, Error>(value.unwrap_or(default as i64))
    };
    let (width, height) = (side("width", DEFAULT_SIZE.0)?, side("height", DEFAULT_SIZE.1)?);
    let mut film = film_of_size(size.unwrap_or((width as usize, height as usize)));
    film.crop = crop(object, width, height)?;
    if size.is_some() && film.crop.is_some() {
        let instead = "leave out the size, or the crop";
        return Err(object.element.unsupported("another size of a film that is cropped", instead));
    }
    // Colours are rendered whatever the pixel format.
    if let Some(format) = object.string("pixel_format")?
        && !matches!(format, "rgb" | "rgba")
    {
        object.note(format!("pixel_format \"{format}\" is read as rgb"));
    }
    let mut filters = object.nested("<rfilter>");
    // A temporal filter does not change the steady-state image.
    filters.retain(|element| element.attribute("name") != Some("tfilter"));
    match filters[..] {
        [] => {}
        [element] => film.filter = filter(&Object::new(element, ids)?)?,
        [..] => {
            object.at_most_one("<rfilter>")?;
        }
    }
    // The older name is that of versions before 3.
    for name in ["high_quality_edges", "sample_border"] {
        film.sample_border |= object.boolean(name)?.unwrap_or(false);
    }
    object.finish()?;
    Ok(film)
}

fn crop(object: &Object<'_>, width: i64, height: i64) -> Result<Option<Crop>, Error> {
    let offset = |name, side| {
        let value = object.integer_in(name, 0..=side - 1, "a whole number within the film")?;
        Ok::<_, Error>(value)
    };
    let (x, y) = (offset("crop_offset_x", width)?, offset("crop_offset_y", height)?);
    let (left, top) = (x.unwrap_or(0), y.unwrap_or(0));
    let side = |name, rest| object.integer_in(name, 1..=rest, "a whole number that ends within the film");
    let (w, h) = (side("crop_width", width - left)?, side("crop_height", height - top)?);
    if [x, y, w, h].iter().all(Option::is_none) {
        return Ok(None);
    }
    Ok(Some(Crop {
        x: left as usize,
        y: top as usize,
        width: w.unwrap_or(width - left) as usize,
        height: h.unwrap_or(height - top) as usize,
    }))
}

fn filter(object: &Object<'_>) -> Result<Filter, Error> {
    let filter = match object.plugin {
        "box" => {
            object.float_where("radius", "0.5, the only box that is supported", |r| r == 0.5)?;
            Filter::Box
        }
        "tent" => Filter::Tent { radius: object.positive("radius")?.unwrap_or(1.0) },
        "gaussian" => Filter::Gaussian { deviation: object.positive("stddev")?.unwrap_or(0.5) },
        "mitchell" => {
            let part = |name| {
                let value = object.float_where(name, "a number from 0 to 1", |x| (0.0..=1.0).contains(&x))?;
                Ok::<_, Error>(value.unwrap_or(1.0 / 3.0))
            };
            Filter::Cubic { b: part("B")?, c: part("C")? }
        }
        "catmullrom" => Filter::Cubic { b: 0.0, c: 0.5 },
        "lanczos" => {
            let lobes = object.integer_in("lobes", 1..=16, "a whole number from 1 to 16")?;
            Filter::Lanczos { lobes: lobes.unwrap_or(3) as u32 }
        }
        _ => return Err(object.unknown_plugin("rfilter", support::FILTERS)),
    };
    object.finish()?;
    Ok(filter)
}
