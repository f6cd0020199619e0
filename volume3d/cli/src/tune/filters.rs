//! The noise under other pixel filters.

use volume3d::gradient::GradientError;
use volume3d::scene::{Filter, Scene};

use super::statistics::Images;
use super::study::{Reference, Study};
use crate::comparison::TOLERATED;

/// The filters of Mitsuba 3 with their default parameters.
const FILTERS: [(&str, Filter); 6] = [
    ("box", Filter::Box),
    ("tent", Filter::Tent { radius: 1.0 }),
    ("gaussian", Filter::Gaussian { deviation: 0.5 }),
    ("mitchell", Filter::Cubic { b: 1.0 / 3.0, c: 1.0 / 3.0 }),
    ("catmullrom", Filter::Cubic { b: 0.0, c: 0.5 }),
    ("lanczos", Filter::Lanczos { lobes: 3 }),
];

/// A line with the noise of the reference's method under each filter: relative to the gradient under that
/// filter, and divided by the same ratio for the scene's own filter, at equal samples. Gradients under
/// different filters are different quantities, so this does not compare errors of one number.
pub(super) fn compared(study: &Study<'_>, reference: &Reference) -> anyhow::Result<String> {
    let own = study.scene.description().film.filter;
    let mut found = vec![];
    for (i, (name, filter)) in FILTERS.into_iter().enumerate() {
        let is_own = std::mem::discriminant(&filter) == std::mem::discriminant(&own);
        let mut description = study.scene.description().clone();
        description.film.filter = if is_own { own } else { filter };
        match study.elsewhere(&Scene::new(description)?, i, reference) {
            Ok(images) => found.extend(images.and_then(|images| noise(&images)).map(|n| (name, is_own, n))),
            Err(GradientError::Stopped(stopped)) => return Err(stopped.into()),
            Err(_) => {}
        }
    }
    let scale = found.iter().find(|(_, is_own, _)| *is_own).map(|(.., noise)| *noise);
    let Some(scale) = scale.filter(|scale| *scale > 0.0) else { return Ok(String::new()) };
    let words = found.iter().map(|(name, is_own, noise)| {
        let whose = if *is_own { " (the scene's)" } else { "" };
        format!("{name} {:.2}{whose}", noise / scale)
    });
    let (method, words) = (&reference.setting.options, words.collect::<Vec<_>>().join(", "));
    Ok(format!("noise by pixel filter, at equal samples of {method}: {words}\n\n"))
}

/// The noise relative to the gradient; nothing if noise hides the gradient.
fn noise(images: &Images) -> Option<f64> {
    let power = images.power();
    let relative = images.variance().value.max(0.0) / power.value;
    (power.value > TOLERATED * power.error).then(|| relative.sqrt())
}
