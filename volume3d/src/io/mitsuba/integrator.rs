//! Integrators: all light-transport integrators are accepted.

use super::element::Element;
use super::object::{Ids, Object};
use super::support;
use crate::io::Error;
use crate::scene::Integrator;

/// Default `max_depth` of Mitsuba's differentiating integrators.
const DEFAULT_PRB_DEPTH: usize = 6;

/// Integrators that wrap another one and show its image.
const AROUND: [&str; 6] = ["moment", "aov", "stokes", "transientstokes", "adaptive", "irrcache"];

/// Maximum nesting depth of integrators.
const MOST_WITHIN: usize = 16;

/// Integrators that ignore media.
const SEE_SURFACES: [&str; 10] = [
    "path",
    "direct",
    "prb",
    "prb_basic",
    "prb_reparam",
    "prb_projective",
    "direct_reparam",
    "direct_projective",
    "transient_path",
    "transientpath",
];

/// Why media are ignored.
pub(super) const NO_MEDIA: &str = "the integrator sees surfaces only";

/// Whether an integrator, or one within it, may see media.
pub(super) fn sees_media(element: &Element) -> bool {
    let plugin = element.attribute("type").unwrap_or_default();
    let mut within = element.children.iter().filter(|child| child.tag == "integrator");
    match within.next() {
        Some(inner) if AROUND.contains(&plugin) => sees_media(inner),
        _ => !SEE_SURFACES.contains(&plugin),
    }
}

/// The integrator, and whether it hides emitters from the camera.
pub(super) fn integrator<'a>(object: &Object<'a>, ids: &Ids<'a>) -> Result<(Integrator, bool), Error> {
    integrator_within(object, ids, MOST_WITHIN)
}

fn integrator_within<'a>(
    object: &Object<'a>,
    ids: &Ids<'a>,
    depth: usize,
) -> Result<(Integrator, bool), Error> {
    if AROUND.contains(&object.plugin)
        && let Some(inner) = object.at_most_one("<integrator>")?
    {
        object.note(format!("of integrator \"{}\" the image of the one within is rendered", object.plugin));
        if object.plugin == "aov" {
            object.string("aovs")?;
        }
        if depth == 0 {
            let what = "an integrator within itself, or within more than 16 others";
            return Err(inner.unsupported(what, "give the one whose image is to be rendered"));
        }
        let inner = integrator_within(&Object::new(inner, ids)?, ids, depth - 1)?;
        object.finish()?;
        return Ok(inner);
    }
    let integrator = match object.plugin {
        "path" => depths(object, None)?,
        "prb" | "prb_basic" | "prb_reparam" | "prb_projective" => depths(object, Some(DEFAULT_PRB_DEPTH))?,
        "direct" | "direct_reparam" | "direct_projective" => {
            for name in ["emitter_samples", "bsdf_samples", "shading_samples", "luminaire_samples"] {
                if object.integer_in(name, 0..=i64::from(u32::MAX), "a whole number of at least 0")?
                    == Some(0)
                {
                    object.note(format!(
                        "{name} of 0 is not heeded: all strategies are used, with the same mean"
                    ));
                }
            }
            Integrator { max_depth: Some(2), ..Integrator::default() }
        }
        "volpath" | "volpathmis" | "prbvolpath" | "volpath_simple" | "ptracer" | "bdpt" | "mlt"
        | "pssmlt" | "erpt" => {
            object.note(format!(
                "integrator \"{}\" is read as path: it computes the same image",
                object.plugin
            ));
            depths(object, None)?
        }
        "transient_path" | "transientpath" => {
            object.note(format!(
                "integrator \"{}\" is read as path: the image is of light at all times",
                object.plugin
            ));
            depths(object, None)?
        }
        "aov" => {
            object.string("aovs")?;
            object
                .note("integrator \"aov\" without another one shows no light: in its place path is rendered");
            depths(object, None)?
        }
        "photonmapper" | "ppm" | "sppm" | "vpl" => {
            object
                .note(format!("integrator \"{}\" is read as path, whose image it approaches", object.plugin));
            depths(object, None)?
        }
        _ if object.journal.is_lenient => {
            object.note(format!("integrator \"{}\" is read as path", object.plugin));
            depths(object, None)?
        }
        _ => return Err(object.unknown_plugin("integrator", support::INTEGRATORS)),
    };
    let hide_emitters = object.boolean("hide_emitters")? == Some(true);
    if object.boolean("strict_normals")? == Some(true) {
        object
            .note("strict_normals is ignored: light may leak where shading normals turn away from a surface");
    }
    object.finish()?;
    Ok((integrator, hide_emitters))
}

fn depths(object: &Object<'_>, default: Option<usize>) -> Result<Integrator, Error> {
    let limit = i64::from(u32::MAX);
    let depth = object.integer_in("max_depth", -1..=limit, "−1 or a whole number of at least 1")?;
    let max_depth = match depth {
        None => default,
        Some(-1) => None,
        Some(0) => {
            let expected = "−1 or a whole number of at least 1 (0 is a black image)";
            return Err(object.element.bad_value("max_depth", "0", expected));
        }
        Some(depth) => Some(depth as usize),
    };
    let rr_depth = object.integer_in("rr_depth", 1..=limit, "a whole number of at least 1")?;
    let rr_depth = rr_depth.map_or(Integrator::default().rr_depth, |depth| depth as usize);
    Ok(Integrator { max_depth, rr_depth })
}
