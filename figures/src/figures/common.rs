//! Helpers shared by several figures.

use std::time::{Duration, Instant};

use flatland::plane::Image;
use glam::{DVec2, DVec3};

use crate::plot::{Canvas, Color, Pen, Raster, number};
use crate::ratio::Ratio;
use crate::space::picture::radiance;

/// One channel of an image, row by row.
pub(crate) fn channel(image: &Image, channel: usize) -> Vec<f64> {
    image.pixels().iter().map(|pixel| pixel[channel]).collect()
}

/// An image of linear radiance as a picture.
pub(crate) fn picture(image: &Image) -> Raster {
    radiance(image.pixels(), image.width())
}

/// The display colour of a linear one.
pub(crate) fn display(linear: DVec3) -> Color {
    let pixel = Raster::new(1, vec![linear.as_vec3().to_array()]).encoded();
    Color::from_rgb(pixel.pixels()[0])
}

/// The root of the mean square; 0 for an empty slice.
pub(crate) fn root_mean_square(values: &[f64]) -> f64 {
    (values.iter().map(|value| value * value).sum::<f64>() / values.len().max(1) as f64).sqrt()
}

/// The largest magnitude; 0 for an empty slice.
pub(crate) fn largest(values: &[f64]) -> f64 {
    values.iter().fold(0.0, |largest, value| largest.max(value.abs()))
}

/// Draws an arrow along a turn: a white line with a dark rim through `at` of angles, and the tip at the last
/// of the stations.
pub(crate) fn draw_turn(
    canvas: &mut Canvas,
    at: impl Fn(f64) -> DVec2,
    [start, end, foot, tip]: [f64; 4],
    widths: [f64; 2],
) {
    let arc: Vec<DVec2> = (0..=24).map(|i| at(start + (end - start) * f64::from(i) / 24.0)).collect();
    for (color, width) in [Color::INK, Color::WHITE].into_iter().zip(widths) {
        let pen = Pen::new(color, width);
        canvas.polyline(&arc, &pen);
        canvas.arrow(at(foot), at(tip), &pen);
    }
}

/// Agreement of an estimate with the exact derivative.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Agreement {
    /// The slope of the estimate on the exact derivative: 1 if unbiased.
    pub(crate) slope: Ratio,
    /// ‖standard error‖/‖exact‖.
    pub(crate) noise: f64,
    /// ‖estimate − exact‖/‖exact‖.
    pub(crate) error: f64,
}

impl Agreement {
    pub(crate) fn new(estimate: &[f64], standard_error: &[f64], exact: &[f64]) -> Self {
        let norm = dot(exact, exact);
        let of_slope: Vec<f64> = exact.iter().zip(standard_error).map(|(e, s)| e * s).collect();
        let off: Vec<f64> = estimate.iter().zip(exact).map(|(a, e)| a - e).collect();
        Self {
            slope: Ratio {
                value: dot(estimate, exact) / norm,
                error: dot(&of_slope, &of_slope).sqrt() / norm,
            },
            noise: (dot(standard_error, standard_error) / norm).sqrt(),
            error: (dot(&off, &off) / norm).sqrt(),
        }
    }
}

pub(crate) fn dot(a: &[f64], b: &[f64]) -> f64 {
    a.iter().zip(b).map(|(a, b)| a * b).sum()
}

pub(crate) fn median(values: &[f64]) -> f64 {
    let mut sorted = values.to_vec();
    sorted.sort_by(f64::total_cmp);
    0.5 * (sorted[(sorted.len() - 1) / 2] + sorted[sorted.len() / 2])
}

/// Seconds of the fastest of a few single-threaded runs, because other programs can only slow one down: at
/// least two runs, and up to twelve short ones.
pub(crate) fn seconds<T: Send>(run: impl Fn() -> anyhow::Result<T> + Send + Sync) -> anyhow::Result<f64> {
    let pool = rayon::ThreadPoolBuilder::new().num_threads(1).build()?;
    let start = Instant::now();
    let mut least = f64::INFINITY;
    for count in 1..=12 {
        let before = Instant::now();
        pool.install(&run)?;
        least = least.min(before.elapsed().as_secs_f64());
        let enough = Duration::from_millis(if count < 6 { 200 } else { 15 });
        if count > 1 && start.elapsed() > enough {
            break;
        }
    }
    Ok(least)
}

/// The words of a list: "a; b; c".
pub(crate) fn listed(words: impl IntoIterator<Item = String>) -> String {
    words.into_iter().collect::<Vec<_>>().join("; ")
}

/// "12.3 %".
pub(crate) fn percent(part: f64) -> String {
    format!("{} %", number(100.0 * part))
}

/// Relative standard error above which a variance counts as unknown.
pub(crate) const KNOWN: f64 = 0.5;
/// Tolerance on an unbiased mean, in standard errors. Beyond it the run has likely missed samples so large
/// that they dominate the variance. With the 7 degrees of freedom of 8 runs one healthy run in 25 exceeds it
/// as well: the test prefers to accept too few runs rather than too many.
pub(crate) const SETTLED: f64 = 2.5;
