//! Helpers shared by several figures.

use std::time::{Duration, Instant};

use flatland::plane::Image;
use glam::{DVec2, DVec3};

use crate::output::{Cell, Table};
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

/// A method's bias and price: its relative error after t seconds is √(bias² + cost/t).
#[derive(Clone, Debug)]
pub(crate) struct Priced {
    pub(crate) name: String,
    /// The relative bias; 0 if there is none, or none is found.
    pub(crate) bias: f64,
    /// Variance × seconds of a sample.
    pub(crate) cost: f64,
}

impl Priced {
    /// The seconds to a relative error, if it is ever reached.
    fn seconds_to(&self, error: f64) -> Option<f64> {
        let left = error * error - self.bias * self.bias;
        (left > 0.0).then(|| self.cost / left)
    }
}

/// A table in Markdown: the bias of every method, and the times to relative errors of 10 % and 1 %.
pub(crate) fn times(methods: &[Priced]) -> String {
    let mut table = Table { header: vec!["method".into(), "bias".into()], rows: vec![] };
    table.header.extend(["seconds to 10 %".into(), "seconds to 1 %".into()]);
    for method in methods {
        let bias = if method.bias > 0.0 { percent(method.bias) } else { "none".to_owned() };
        let time = |error: f64| method.seconds_to(error).map_or_else(|| "never".into(), Cell::from);
        table.row([method.name.as_str().into(), bias.as_str().into(), time(0.1), time(0.01)]);
    }
    table.markdown()
}

/// "A at an error of 5 % (after 0.3 s)": where an unbiased method overtakes cheaper ones that are biased.
pub(crate) fn crossovers(methods: &[Priced], unbiased: &Priced) -> String {
    let cheaper = methods.iter().filter(|m| m.bias > 0.0);
    let words = cheaper.map(|m| {
        let seconds = (unbiased.cost - m.cost) / (m.bias * m.bias);
        if seconds > 0.0 {
            let error = (unbiased.cost / seconds).sqrt();
            format!("{} at an error of {} (after {} s)", m.name, percent(error), number(seconds))
        } else {
            format!("{} always", m.name)
        }
    });
    let words = listed(words);
    if words.is_empty() { "nothing: no bias was found".to_owned() } else { words }
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

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn biased_methods_are_overtaken_where_their_bias_shows() {
        let method = |name: &str, bias, cost| Priced { name: name.to_owned(), bias, cost };
        let methods = [method("quick", 0.06, 1e-4), method("right", 0.0, 0.0037), method("bad", 0.5, 1.0)];
        // 0.06² t = 0.0037 − 0.0001 at t = 1, where √0.0037 is 6.08 %.
        let words = crossovers(&methods, &methods[1]);
        assert_eq!(words, "quick at an error of 6.08 % (after 1 s); bad always");
        assert_eq!(methods[0].seconds_to(0.05), None);
        assert!((methods[0].seconds_to(0.1).unwrap() - 1e-4 / 0.0064).abs() < 1e-12);
        let table = times(&methods);
        assert!(
            table.contains("| bad | 50 % | never | never |") && table.contains("| right | none |"),
            "{table}"
        );
    }
}
