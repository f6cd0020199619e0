//! The one-dimensional image, its derivative term by term, and the derivative by every method.

use flatland::estimator::transport::GradientImage;
use flatland::transport::Terms;
use glam::DVec2;

use super::BAND;
use super::study::{Entry, Study, WARPED};
use super::world::gray;
use crate::figures::common::largest;
use crate::plot::{Align, Axes, Axis, Canvas, Color, Height, Legend, Palette, Pen, Rect, Style, TextStyle};

const STRIP: f64 = 20.0;
/// Names and colours of the terms.
const TERMS: [(&str, Color); 3] =
    [("interior", Palette::GREEN), ("primary", Palette::BLUE), ("secondary", Palette::VERMILION)];

fn pixels(count: usize) -> Axis {
    Axis::linear("pixel").limits(0.0, count as f64)
}

/// Values at the pixels' centres.
fn centred(values: impl IntoIterator<Item = f64>) -> Vec<[f64; 2]> {
    values.into_iter().enumerate().map(|(i, v)| [i as f64 + 0.5, v]).collect()
}

fn band(values: &[f64], errors: &[f64]) -> Vec<[f64; 3]> {
    let one = |(i, (v, e)): (usize, (&f64, &f64))| [i as f64 + 0.5, v - BAND * e, v + BAND * e];
    values.iter().zip(errors).enumerate().map(one).collect()
}

/// The name of a curve beside its point that is farthest from 0.
fn named(axes: &mut Axes, values: &[f64], (name, color): (&str, Color), away: f64) {
    let farthest = values.iter().enumerate().max_by(|a, b| a.1.abs().total_cmp(&b.1.abs()));
    if let Some((index, value)) = farthest {
        axes.note([index as f64 + 0.5, value + away.copysign(*value)], name, color);
    }
}

/// The image as a strip, and as curves over it.
pub(super) fn image(canvas: &mut Canvas, space: Rect, study: &Study) {
    let count = study.exact_image.len();
    let mut axes = Axes::new(pixels(count), Axis::linear("radiance I").limits(0.0, 1.4 * top(study)));
    axes = axes.legend(Legend::None);
    let [once, twice] = study.images.each_ref().map(|i| i.iter().map(|p| p[0]).collect::<Vec<_>>());
    let ochre = Style::new(Palette::ORANGE).width(1.6);
    axes.line(centred(study.exact_image_twice.iter().copied()), &ochre);
    axes.line(centred(study.exact_image.iter().copied()), &Style::new(Color::INK).width(1.6));
    let dots = Style::new(Palette::SKY).radius(1.7);
    axes.scatter(centred(once).into_iter().step_by(2), &dots);
    axes.scatter(centred(twice.iter().copied()).into_iter().step_by(2), &dots);
    // At the right the two are well separated.
    let last = |values: &[f64], part: f64| part * values[count - 1];
    let from = 0.72 * count as f64;
    axes.note([from, last(&study.exact_image_twice, 1.22)], "two bounces", Palette::ORANGE);
    axes.note([from, last(&study.exact_image, 0.72)], "one bounce", Color::INK);
    axes.note([0.02 * count as f64, 1.25 * top(study)], "dots: path traced", Palette::SKY);
    let (strip, below) = space.split_top(STRIP);
    let placed = axes.draw(canvas, below.inset(0.0, 5.0, 0.0, 0.0));
    let width = placed.frame.width / count as f64;
    for (i, value) in twice.iter().enumerate() {
        let cell = Rect::new(placed.frame.x + i as f64 * width, strip.y, width + 0.3, STRIP);
        canvas.fill_rect(cell, gray(value / largest(&twice)));
    }
    canvas.frame(Rect::new(placed.frame.x, strip.y, placed.frame.width, STRIP), &Pen::new(Color::INK, 0.8));
}

fn top(study: &Study) -> f64 {
    study.images[1].iter().map(|p| p[0]).fold(0.0, f64::max)
}

/// The three terms, exact and by the warp.
pub(super) fn terms(canvas: &mut Canvas, space: Rect, study: &Study) {
    let Some(entry) = study.entry(WARPED) else { return };
    let limit = study.exact.iter().flat_map(|t| t.to_array()).fold(0.0_f64, |a, b| a.max(b.abs()));
    let y = Axis::linear("∂_{θ}I (1/rad), by term").limits(-1.25 * limit, 1.6 * limit);
    let mut axes = Axes::new(pixels(study.exact.len()), y).legend(Legend::None);
    for (k, (name, color)) in TERMS.into_iter().enumerate() {
        let pick = |terms: &[Terms<f64>]| terms.iter().map(|t| t.to_array()[k]).collect::<Vec<_>>();
        let (mean, error) = (pick(&entry.image.mean), pick(&entry.image.standard_error.by_term));
        axes.band(band(&mean, &error), &Style::new(color));
        axes.line(centred(mean), &Style::new(color).width(2.4));
        let exact = pick(&study.exact);
        axes.line(centred(exact.iter().copied()), &Style::new(Color::INK).width(0.9));
        named(&mut axes, &exact, (name, color), 0.12 * limit);
    }
    axes.draw(canvas, space);
}

/// One method beside the exact curve.
pub(super) fn method(canvas: &mut Canvas, space: Rect, study: &Study, entry: &Entry, edges: [bool; 2]) {
    let exact = study.total();
    let found = entry.agreement;
    let mut axes = methods_axes(&exact, edges);
    estimate(&mut axes, &entry.image, entry.looks.color);
    axes.line(centred(exact.iter().copied()), &Style::new(Color::INK).width(1.0));
    let placed = axes.draw(canvas, space);
    let slope = format!("slope {}", found.slope.shown());
    let noise = format!("noise {:.1}%", 100.0 * found.noise);
    corner(canvas, placed.frame, &[(slope, Color::INK), (noise, Color::INK)]);
}

/// Lines of text in the top right corner of a frame.
fn corner(canvas: &mut Canvas, frame: Rect, lines: &[(String, Color)]) {
    let mut at = DVec2::new(frame.right() - 5.0, frame.y + 6.0);
    for (text, color) in lines {
        let style = TextStyle::new(10.0, *color).anchored(Align::Right, Height::Top).halo(Color::WHITE);
        canvas.text(text, at, &style);
        at.y += 13.0;
    }
}

/// Light scattered twice, by three methods without bias.
pub(super) fn twice(canvas: &mut Canvas, space: Rect, study: &Study, edges: [bool; 2]) {
    let mut axes = methods_axes(&study.exact_twice, edges);
    for entry in study.twice.iter().rev() {
        estimate(&mut axes, &entry.image, entry.looks.color);
    }
    axes.line(centred(study.exact_twice.iter().copied()), &Style::new(Color::INK).width(1.0));
    let placed = axes.draw(canvas, space);
    let line = |e: &Entry| (format!("{} {}", e.looks.name, e.agreement.slope.shown()), e.looks.color);
    corner(canvas, placed.frame, &study.twice.each_ref().map(line));
}

fn methods_axes(exact: &[f64], [left, bottom]: [bool; 2]) -> Axes {
    let (low, high) = exact.iter().fold((0.0_f64, 0.0_f64), |(l, h), e| (l.min(*e), h.max(*e)));
    let room = high - low;
    let y =
        Axis::linear(if left { "∂_{θ}I (1/rad)" } else { "" }).limits(low - 0.2 * room, high + 0.34 * room);
    let x = Axis::linear(if bottom { "pixel" } else { "" }).limits(0.0, exact.len() as f64);
    Axes::new(x, y).legend(Legend::None)
}

fn estimate(axes: &mut Axes, image: &GradientImage, color: Color) {
    let mean = image.total();
    axes.band(band(&mean, &image.standard_error.total), &Style::new(color));
    axes.line(centred(mean), &Style::new(color).width(1.8));
}
