//! Whether a fit has reached its pictures: compares its residual with the noise.

use std::fmt::Write as _;

use flatland::random::stream;
use rand::Rng as _;
use volume3d::Image;
use volume3d::optimize::{Fit, View};
use volume3d::scene::Scene;

use super::config::Config;
use super::pictures::{PICTURE, looked_at};

/// Samples per pixel of the renderings that a fit is judged by.
pub(super) const JUDGED: usize = 4 * PICTURE;

/// The largest ratio of residual to noise at which a fit has reached its pictures; the optimum has 1. These
/// renderings have many more samples than those of steps, so the scatter of the last steps, which is of the
/// size of their noise, makes the ratio a few times larger. A wrong optimum has tens to thousands.
const REACHED: f64 = 10.0;

/// Key of random streams, distinct from that of pictures.
const NOISE: u64 = 1 << 34;

/// The losses of one view at the result.
#[derive(Clone, Debug, PartialEq)]
pub(super) struct Judged {
    pub(super) view: String,
    /// The loss of a rendering against the target.
    pub(super) residual: f64,
    /// The loss of the same rendering against another rendering with as much noise as the target.
    pub(super) noise: f64,
}

/// Judges a view of the scene in its current state by `image`, a rendering of it with [`JUDGED`] samples.
///
/// The noise is the loss against a second, independent rendering: with as many samples as a rendered target,
/// or with the noise estimated from differences of neighbouring pixels of a target picture.
pub(super) fn judged(
    config: &Config,
    fit: &Fit,
    scene: &mut Scene,
    view: usize,
    image: &Image,
) -> anyhow::Result<Judged> {
    let (objective, parameters) = (fit.objective(), fit.parameters());
    let View { name, target, .. } = &objective.views[view];
    let has_picture = config.is_photographed() || config.views.get(view).is_some_and(|v| v.target.is_some());
    let samples = config.reference.as_ref().filter(|_| !has_picture).map(|reference| reference.spp);
    let mut other = looked_at(fit, scene, view, samples.unwrap_or(JUDGED), NOISE)?;
    if samples.is_none() {
        add_noise(&mut other, deviation(target), NOISE ^ view as u64);
    }
    let residual = objective.loss_between(scene, parameters, view, [image, target])?;
    let noise = objective.loss_between(scene, parameters, view, [image, &other])?;
    Ok(Judged { view: name.clone(), residual, noise })
}

/// Adds Gaussian noise with a standard deviation.
fn add_noise(image: &mut Image, deviation: f64, seed: u64) {
    let mut random = stream(seed, &[NOISE]);
    let mut uniform = || (random.next_u64() >> 11) as f64 / (1u64 << 53) as f64;
    for pixel in &mut image.pixels {
        // Box–Muller transform.
        *pixel = pixel.map(|x| {
            let radius = (-2.0 * (1.0 - uniform()).ln()).sqrt();
            x + deviation * radius * (std::f64::consts::TAU * uniform()).cos()
        });
    }
}

/// The standard deviation of noise in a picture, from the median absolute value of second differences in x of
/// second differences in y. These are 0 for quadratic images, and for white noise their deviation is 6 times
/// that of the noise (Immerkær 1996).
fn deviation(image: &Image) -> f64 {
    const MASK: [[f64; 3]; 3] = [[1.0, -2.0, 1.0], [-2.0, 4.0, -2.0], [1.0, -2.0, 1.0]];
    let (width, height) = image.size();
    let mut found = vec![];
    for y in 1..height.saturating_sub(1) {
        for x in 1..width.saturating_sub(1) {
            let at = |i: usize, j: usize| MASK[j][i] * image.pixels[(y + j - 1) * width + x + i - 1];
            let sum: glam::DVec3 = (0..9).map(|k| at(k % 3, k / 3)).sum();
            found.extend(sum.to_array().map(f64::abs));
        }
    }
    if found.is_empty() {
        return 0.0;
    }
    let middle = found.len() / 2;
    // The median of |x| is 0.6745 standard deviations of a Gaussian.
    *found.select_nth_unstable_by(middle, f64::total_cmp).1 / (6.0 * 0.6745)
}

/// The judgement over all views.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Quality {
    /// The mean residual of all views, and their mean noise.
    pub(super) residual: f64,
    pub(super) noise: f64,
}

impl Quality {
    pub(super) fn of(views: &[Judged]) -> Self {
        let mean =
            |number: fn(&Judged) -> f64| views.iter().map(number).sum::<f64>() / views.len().max(1) as f64;
        Self { residual: mean(|v| v.residual), noise: mean(|v| v.noise) }
    }

    /// Residual divided by noise, at least 1.
    pub(super) fn ratio(self) -> f64 {
        if self.residual <= self.noise { 1.0 } else { self.residual / self.noise }
    }

    pub(super) fn is_reached(self) -> bool {
        self.ratio() <= REACHED
    }

    /// A sentence for the report.
    pub(super) fn words(self) -> String {
        let Self { residual, noise } = self;
        if self.is_reached() {
            format!(
                "The fit has reached its pictures: its residual, {residual:.2e}, is {} times the noise, {noise:.2e}.",
                times(self.ratio())
            )
        } else {
            format!(
                "The fit has not reached its pictures: its residual, {residual:.2e}, is {} times the noise, {noise:.2e}.",
                times(self.ratio())
            )
        }
    }

    /// The warning of a fit that has not reached its pictures, or nothing.
    pub(super) fn warning(self, views: &[Judged], config: &Config) -> String {
        if self.is_reached() {
            return String::new();
        }
        let mut text = format!(
            "WARNING: the fit has not reached its pictures: residual {} times the noise ({:.2e}, {:.2e})",
            times(self.ratio()),
            self.residual,
            self.noise
        );
        let ratio = |v: &Judged| v.residual / v.noise;
        if let Some(worst) =
            views.iter().max_by(|a, b| ratio(a).total_cmp(&ratio(b))).filter(|_| views.len() > 1)
        {
            let _ = write!(text, ", worst in view `{}`", worst.view);
        }
        text += ". It may be a wrong optimum: see report.html, and try a closer start, or starts = 8";
        text +=
            if config.steps < 200 { "; or too few steps: raise steps and run the same command" } else { "" };
        if config.reference.is_none() {
            text += "; or the scene cannot match the pictures, because its materials, lights or background differ";
        }
        text + "\n"
    }
}

/// A ratio, with a decimal if it is below 10.
fn times(ratio: f64) -> String {
    if ratio < 10.0 { format!("{ratio:.1}") } else { format!("{ratio:.0}") }
}

#[cfg(test)]
mod tests {
    use glam::DVec3;

    use super::*;

    #[test]
    fn noise_of_a_picture_is_found_beside_its_edges() {
        let edge = |i: usize| DVec3::splat(if i % 64 < 30 { 0.2 } else { 0.8 } + 0.001 * (i / 64) as f64);
        let mut image = Image { width: 64, height: 64, pixels: (0..64 * 64).map(edge).collect() };
        assert!(deviation(&image) < 1e-12, "{}", deviation(&image));
        add_noise(&mut image, 0.05, 1);
        // 12,000 second differences, with correlations: a few per cent; the edge adds the rest.
        assert!((deviation(&image) / 0.05 - 1.0).abs() < 0.1, "{}", deviation(&image));
        assert_eq!(deviation(&Image::constant(2, 2, DVec3::ONE)), 0.0);
    }

    #[test]
    fn a_residual_is_judged_by_noise() {
        let quality = |residual, noise| Quality { residual, noise };
        assert!(quality(1.0, 2.0).is_reached() && quality(9.0, 1.0).is_reached());
        assert!(!quality(11.0, 1.0).is_reached() && !quality(1.0, 0.0).is_reached());
        assert!(quality(0.0, 0.0).is_reached());
        assert!(quality(37.0, 1.0).words().contains("37 times"));
    }
}
