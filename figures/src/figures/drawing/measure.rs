//! Gradient images of a view by every method, and their errors against the exact one.

use std::time::Instant;

use flatland::estimator::{EdgeSampling, Exact, FiniteDifference, GradientImage, Method, WarpedArea};
use flatland::plane::exact::Arrangement;
use flatland::plane::{Film, Image, Motion, Scene};

use crate::figures::common::{self, Agreement, largest};

/// The channel shown and judged: green tells the drawing's gold from its red.
pub(super) const CHANNEL: usize = 1;
/// Side of the blocks of pixels in which heavy tails are averaged.
pub(super) const BLOCK: usize = 12;

/// A drawing and its rotating part.
pub(super) struct Subject<'a> {
    pub(super) scene: &'a Scene,
    pub(super) motion: Motion,
    /// The largest distance of a moving vertex from the centre.
    pub(super) radius: f64,
}

/// One film's images and estimates.
pub(super) struct View {
    pub(super) film: Film,
    pub(super) primal: Image,
    pub(super) exact: Image,
    /// Seconds for the exact gradient, its arrangement included.
    pub(super) exact_seconds: f64,
    pub(super) warped: Estimate,
    /// Estimate with as many rays as `warped`.
    pub(super) differences: Estimate,
    /// Estimate with as many rays as `warped`.
    pub(super) edges: Estimate,
    /// The step of `differences`, in radians.
    pub(super) step: f64,
}

/// A method's estimate, in one channel.
pub(super) struct Estimate {
    pub(super) samples: usize,
    pub(super) rays: u64,
    pub(super) seconds: f64,
    pub(super) mean: Vec<f64>,
    pub(super) standard_error: Vec<f64>,
    /// Agreement with the exact gradient.
    pub(super) agreement: Agreement,
    /// (estimate − exact)/standard error of every pixel, and of the sums over blocks of pixels; NaN where
    /// nothing varies.
    pub(super) z: [Vec<f64>; 2],
}

/// The largest of many |z|.
pub(super) struct Worst {
    pub(super) z: f64,
    pub(super) count: usize,
    /// The median of the maximum of as many normal deviates.
    pub(super) expected: f64,
}

/// The channel of an image.
pub(super) fn channel(image: &Image) -> Vec<f64> {
    common::channel(image, CHANNEL)
}

impl View {
    /// All methods on one film, warped area with `samples` a pixel.
    pub(super) fn new(subject: &Subject<'_>, film: Film, samples: usize, seed: u64) -> anyhow::Result<Self> {
        let Subject { scene, motion, radius } = subject;
        let primal = Arrangement::new(scene, &film)?.primal(&film);
        let start = Instant::now();
        let exact = Exact.forward(scene, motion, &film)?.mean;
        let exact_seconds = start.elapsed().as_secs_f64();
        let estimate = |method: &dyn Method, samples: usize| -> anyhow::Result<Estimate> {
            let start = Instant::now();
            let image = method.forward(scene, motion, &film)?;
            Ok(Estimate::new(&image, &exact, samples, start.elapsed().as_secs_f64()))
        };
        let warped = estimate(&WarpedArea { samples, seed, ..WarpedArea::default() }, samples)?;
        let equal = |rays: u64| (warped.rays / (rays * (film.width() * film.height()) as u64)) as usize;
        // Half a pixel at the rim.
        let step = 0.5 * film.pixel() / radius;
        let samples = equal(2);
        let differences = estimate(&FiniteDifference { samples, step, seed }, samples)?;
        let samples = equal(3);
        let edges = estimate(&EdgeSampling { samples, seed }, samples)?;
        Ok(Self { film, primal, exact, exact_seconds, warped, differences, edges, step })
    }

    /// Width and height.
    pub(super) fn size(&self) -> (usize, usize) {
        (self.film.width(), self.film.height())
    }
}

impl Estimate {
    fn new(image: &GradientImage, exact: &Image, samples: usize, seconds: f64) -> Self {
        let (mean, standard_error) = (channel(&image.mean), channel(&image.standard_error));
        let (width, exact) = (exact.width(), channel(exact));
        let agreement = Agreement::new(&mean, &standard_error, &exact);
        let z = [1, BLOCK].map(|block| scores(&mean, &standard_error, &exact, width, block));
        Self { samples, rays: image.rays, seconds, mean, standard_error, agreement, z }
    }

    /// The largest |z| over pixels, and over blocks of pixels.
    pub(super) fn worst(&self) -> [Worst; 2] {
        self.z.each_ref().map(|all| {
            let finite = all.iter().filter(|z| z.is_finite());
            let (count, z) = finite.fold((0, 0.0_f64), |(count, worst), z| (count + 1, worst.max(z.abs())));
            Worst { z, count, expected: expected_worst(count) }
        })
    }
}

/// Part of the largest gradient up to which standard errors are rounding.
const ROUNDING: f64 = 1e-9;

/// The sums of (estimate − exact) over squares of pixels, in standard errors.
fn scores(mean: &[f64], error: &[f64], exact: &[f64], width: usize, block: usize) -> Vec<f64> {
    let least = ROUNDING * largest(exact);
    let (columns, rows) = (width.div_ceil(block), (exact.len() / width).div_ceil(block));
    let mut sums = vec![(0.0, 0.0); columns * rows];
    for i in 0..exact.len() {
        let sum = &mut sums[i / width / block * columns + i % width / block];
        sum.0 += mean[i] - exact[i];
        sum.1 += error[i] * error[i];
    }
    sums.into_iter().map(|(d, v)| if v.sqrt() > least { d / v.sqrt() } else { f64::NAN }).collect()
}

/// The z with count · P(|Z| > z) = ln 2, by bisection: the median of the largest of `count` normal deviates.
fn expected_worst(count: usize) -> f64 {
    // P(|Z| > z) by Laplace's continued fraction.
    let tail = |z: f64| {
        let fraction = (1..=80).rev().fold(z, |below, k| z + f64::from(k) / below);
        2.0 * (-0.5 * z * z).exp() / std::f64::consts::TAU.sqrt() / fraction
    };
    let (mut low, mut high) = (0.5, 40.0);
    for _ in 0..60 {
        let middle = 0.5 * (low + high);
        if count as f64 * tail(middle) > std::f64::consts::LN_2 { low = middle } else { high = middle }
    }
    low
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_worst_of_many_grows_slowly() {
        // P(|Z| > 1.95996) = 0.05, P(|Z| > 3.8906) = 10⁻⁴, P(|Z| > 4.8916) = 10⁻⁶.
        assert!((expected_worst(14) - 1.95996).abs() < 1e-2);
        assert!((expected_worst(6931) - 3.8906).abs() < 2e-3);
        assert!((expected_worst(693_147) - 4.8916).abs() < 1e-3);
    }
}
