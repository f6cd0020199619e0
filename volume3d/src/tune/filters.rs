//! The noise under other pixel filters.

use super::TuneError;
use super::statistics::Images;
use super::study::{Reference, Study};
use crate::check::TOLERATED;
use crate::gradient::GradientError;
use crate::scene::{Filter, Scene};

/// The filters of Mitsuba 3 with their default parameters.
const FILTERS: [(&str, Filter); 6] = [
    ("box", Filter::Box),
    ("tent", Filter::Tent { radius: 1.0 }),
    ("gaussian", Filter::Gaussian { deviation: 0.5 }),
    ("mitchell", Filter::Cubic { b: 1.0 / 3.0, c: 1.0 / 3.0 }),
    ("catmullrom", Filter::Cubic { b: 0.0, c: 0.5 }),
    ("lanczos", Filter::Lanczos { lobes: 3 }),
];

/// The noise of the reference's method under one filter.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct FilterNoise {
    /// Name of the filter.
    pub name: &'static str,
    /// Whether it is that of the scene.
    pub is_own: bool,
    /// Noise relative to the gradient under this filter, divided by the same ratio for the scene's own
    /// filter, at equal samples. Gradients under different filters are different quantities, so this does not
    /// compare errors of one number.
    pub ratio: f64,
}

/// The noise under all filters that the budget allows; none if noise hides the gradient.
pub(super) fn compared(study: &Study<'_>, reference: &Reference) -> Result<Vec<FilterNoise>, TuneError> {
    let own = study.scene.description().film.filter;
    let mut found = vec![];
    for (i, (name, filter)) in FILTERS.into_iter().enumerate() {
        let is_own = std::mem::discriminant(&filter) == std::mem::discriminant(&own);
        let mut description = study.scene.description().clone();
        description.film.filter = if is_own { own } else { filter };
        match study.elsewhere(&Scene::new(description)?, i, reference) {
            Ok(images) => found.extend(images.and_then(|images| noise(&images)).map(|n| (name, is_own, n))),
            Err(stopped @ GradientError::Stopped(_)) => return Err(stopped.into()),
            Err(_) => {}
        }
    }
    let scale = found.iter().find(|(_, is_own, _)| *is_own).map(|(.., noise)| *noise);
    let Some(scale) = scale.filter(|scale| *scale > 0.0) else { return Ok(vec![]) };
    let ratio = |(name, is_own, noise)| FilterNoise { name, is_own, ratio: noise / scale };
    Ok(found.into_iter().map(ratio).collect())
}

/// The noise relative to the gradient; nothing if noise hides the gradient.
fn noise(images: &Images) -> Option<f64> {
    let power = images.power();
    let relative = images.variance().value.max(0.0) / power.value;
    (power.value > TOLERATED * power.error).then(|| relative.sqrt())
}
