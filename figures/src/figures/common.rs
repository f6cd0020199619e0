//! What several figures need.

use flatland::plane::Image;
use flatland::random::{open01, stream};
use glam::{DVec2, DVec3};

use crate::plot::{Canvas, Color, Pen, Raster, number};
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
    let pixel = Raster::new(1, 1, vec![linear.as_vec3().to_array()]).encoded();
    Color::from_rgb(pixel.pixels()[0])
}

/// The root of the mean square; 0 for nothing.
pub(crate) fn root_mean_square(values: &[f64]) -> f64 {
    (values.iter().map(|value| value * value).sum::<f64>() / values.len().max(1) as f64).sqrt()
}

/// The largest magnitude; 0 for nothing.
pub(crate) fn largest(values: &[f64]) -> f64 {
    values.iter().fold(0.0, |largest, value| largest.max(value.abs()))
}

/// Draws an arrow along a turn: a white line with a dark rim through `at` of angles, and the tip at the last of the stations.
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

/// "12.3 %".
pub(crate) fn percent(part: f64) -> String {
    format!("{} %", number(100.0 * part))
}

/// A seed for the part of the study that the words name: 52 bits of their stream.
pub(crate) fn seed_of(seed: u64, words: &[u64]) -> u64 {
    (open01(&mut stream(seed, words)) * 2f64.powi(52)) as u64
}

/// The relative standard error of a variance above which it is not known.
pub(crate) const KNOWN: f64 = 0.5;
/// Standard errors by which an unbiased mean may be off. If it is farther, the run has likely missed samples
/// so large that they decide the variance. With the 7 degrees of freedom of 8 runs one healthy run in 25 is
/// farther as well: too few runs are believed rather than too many.
pub(crate) const SETTLED: f64 = 2.5;
