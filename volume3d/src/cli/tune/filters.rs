//! What another pixel filter would do to the noise.

use volume3d::gradient::GradientError;
use volume3d::scene::{Filter, Scene};

use super::statistics::Images;
use super::study::{Reference, Study};
use crate::cli::comparison::TOLERATED;

/// The filters that are tried, as Mitsuba 3 has them.
const FILTERS: [(&str, Filter); 3] = [
    ("box", Filter::Box),
    ("tent", Filter::Tent { radius: 1.0 }),
    ("gaussian", Filter::Gaussian { deviation: 0.5 }),
];

/// A line about all of them: the noise of the reference's method, relative to the gradient under each filter, at equal
/// samples. The gradient is another one under another filter: this is no comparison of errors of one number.
pub(super) fn compared(study: &Study<'_>, reference: &Reference) -> anyhow::Result<String> {
    let own = study.scene.description().film.filter;
    let Some(scale) = noise(&reference.images, reference.samples).filter(|scale| *scale > 0.0) else {
        return Ok(String::new());
    };
    let mut words = vec![];
    for (i, (name, filter)) in FILTERS.into_iter().enumerate() {
        if std::mem::discriminant(&filter) == std::mem::discriminant(&own) {
            words.push(format!("{name} 1 (the scene's)"));
            continue;
        }
        let mut description = study.scene.description().clone();
        description.film.filter = filter;
        let scene = Scene::new(description)?;
        let (images, samples) = match study.elsewhere(&scene, i, reference) {
            Ok(found) => found,
            Err(GradientError::Stopped(stopped)) => return Err(stopped.into()),
            Err(_) => continue,
        };
        words.extend(noise(&images, samples).map(|noise| format!("{name} {:.2}", noise / scale)));
    }
    let (method, words) = (&reference.setting.options, words.join(", "));
    Ok(format!("noise by pixel filter, at equal samples of {method}: {words}\n\n"))
}

/// The noise of one sample a pixel, relative to the gradient; nothing if that is lost in it.
fn noise(images: &Images, samples: usize) -> Option<f64> {
    let power = images.power();
    let relative = images.variance().value.max(0.0) * samples as f64 / power.value;
    (power.value > TOLERATED * power.error).then(|| relative.sqrt())
}
