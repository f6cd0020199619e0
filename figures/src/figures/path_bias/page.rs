//! The picture: each world with its biases and prices.

use glam::DVec2;

use super::study::Study;
use super::worlds::OCCLUDER;
use crate::figures::flat::{draw_camera, draw_motion, draw_world};
use crate::plot::{
    Align, Axes, Axis, Canvas, Color, Figure, GUTTER, Height, Legend, Marker, Pen, Rect, Style, TextStyle,
    Upward, View,
};

/// Both worlds.
pub(super) fn draw(studies: &[Study], caption: &str) -> Figure {
    let title = "Bias and price of debiasing along paths";
    let mut figure = Figure::new(960.0, 600.0, title, caption);
    let rows = figure.body.rows(&vec![1.0; studies.len()], GUTTER);
    for (i, (study, row)) in studies.iter().zip(rows).enumerate() {
        let cells = row.columns(&[0.78, 0.9, 1.42], GUTTER);
        let space = figure.panel(cells[0], 3 * i, study.setting.name);
        figure.canvas.clipped(space, |canvas| draw_setting(canvas, study, space));
        let space = figure.panel(cells[1], 3 * i + 1, "bias against the number of auxiliary rays");
        let legend = if i == 0 { Legend::TopRight } else { Legend::None };
        bias_axes(study).legend(legend).draw(&mut figure.canvas, space);
        let space = figure.panel(cells[2], 3 * i + 2, "variance × rays of a sample");
        draw_prices(&mut figure.canvas, study, space);
    }
    figure
}

fn draw_setting(canvas: &mut Canvas, study: &Study, space: Rect) {
    let setting = &study.setting;
    let [low, high] = setting.window;
    let view = View::fit(low, high, space, Upward::Yes);
    draw_camera(canvas, &view, &setting.camera, 1.3);
    draw_world(canvas, &view, &setting.world);
    draw_motion(canvas, &view, &setting.world, (OCCLUDER, &setting.change), 0.42);
}

/// The missing part of curves, and of unbiased schemes at their mean number of rays.
fn bias_axes(study: &Study) -> Axes {
    let ticks = [1, 2, 4, 8, 16, 32, 64, 128].map(|n| (f64::from(n), n.to_string()));
    let last = study.curves.iter().flat_map(|c| c.points.last()).fold(1.0, |m: f64, p| m.max(p.0));
    let first = study.curves.iter().flat_map(|c| c.points.first()).fold(last, |m: f64, p| m.min(p.0));
    let x = Axis::log("auxiliary rays N′").ticks(ticks).limits(0.8 * first, 2.1 * last);
    let mut axes = Axes::new(x, Axis::linear("missing part, 1 − slope").limits(-1.15, 1.3));
    axes.horizontal(0.0, "", &Style::new(Color::MUTED).width(1.0));
    for curve in &study.curves {
        let style = Style::new(curve.series.color);
        let bars =
            curve.points.iter().map(|(n, b)| [*n, b.missing, b.missing - b.error, b.missing + b.error]);
        axes.error_bars(bars, &style);
        let style = style.marker(curve.series.marker).labelled(curve.series.name);
        axes.line(curve.points.iter().map(|(n, b)| [*n, b.missing]), &style);
    }
    for scheme in study.schemes.iter().filter(|s| s.field.is_unbiased()) {
        let Some(rays) = scheme.field.auxiliary_rays() else { continue };
        let bias = scheme.measured.bias;
        let style = Style::new(scheme.field.color());
        axes.error_bars([[rays, bias.missing, bias.missing - bias.error, bias.missing + bias.error]], &style);
        axes.scatter([[rays, bias.missing]], &style.marker(scheme.field.marker()).radius(4.0));
    }
    axes.scatter([], &Style::new(Color::MUTED).marker(Marker::Square).labelled("debiased, at its mean rays"));
    axes
}

/// Length on the page of the arrow that says “at least”.
const AT_LEAST: f64 = 20.0;

/// Rows of variance × rays with error bars, or with an arrow where it is a lower bound, and what each misses.
fn draw_prices(canvas: &mut Canvas, study: &Study, space: Rect) {
    let space = space.inset(158.0, 14.0, 92.0, 0.0);
    let row = |index: usize| (study.schemes.len() - 1 - index) as f64;
    let none: [(f64, String); 0] = [];
    let y = Axis::linear("").ticks(none).limits(-0.6, study.schemes.len() as f64 - 0.4);
    let ticks = [(10.0, "10"), (100.0, "100"), (1e3, "1000"), (1e4, "10⁴"), (1e5, "10⁵"), (1e6, "10⁶")];
    let costs = || study.schemes.iter().map(|s| s.measured.cost());
    let least = costs().map(|c| c.value - c.error).filter(|c| *c > 0.0).fold(f64::INFINITY, f64::min);
    let most = costs().map(|c| c.value + c.error).fold(0.0, f64::max);
    let x = Axis::log("variance × rays").ticks(ticks).limits(0.6 * least, 6.0 * most);
    let mut axes = Axes::new(x, y).legend(Legend::None);
    for (index, scheme) in study.schemes.iter().enumerate() {
        let style = Style::new(scheme.field.color());
        let cost = scheme.measured.cost();
        let marker = if scheme.is_bound() { Marker::Ring } else { scheme.field.marker() };
        if !scheme.is_bound() {
            let ends = [(cost.value - cost.error).max(0.3 * cost.value), cost.value + cost.error];
            axes.line(ends.map(|x| [x, row(index)]), &style);
        }
        axes.scatter([[cost.value, row(index)]], &style.marker(marker).radius(4.0));
    }
    let placed = axes.draw(canvas, space);
    let right = placed.frame.right();
    let heading = TextStyle::new(10.0, Color::MUTED).anchored(Align::Left, Height::Baseline);
    canvas.text("missing part", DVec2::new(right + 10.0, placed.frame.y - 4.0), &heading);
    for (index, scheme) in study.schemes.iter().enumerate() {
        let field = scheme.field;
        let ring = placed.at([scheme.measured.cost().value, row(index)]).filter(|_| scheme.is_bound());
        if let Some(ring) = ring {
            let from = ring + DVec2::new(5.0, 0.0);
            canvas.arrow(from, from + DVec2::new(AT_LEAST, 0.0), &Pen::new(field.color(), 1.2));
        }
        let Some(at) = placed.at([placed.x.low(), row(index)]) else { continue };
        let style = TextStyle::new(9.8, field.color().mix(Color::INK, 0.25));
        let left = style.anchored(Align::Right, Height::Middle);
        canvas.text(&field.name(), at - DVec2::new(8.0, 0.0), &left);
        let missing = super::text::missing(&scheme.measured.bias);
        let style = TextStyle::new(9.8, Color::INK).anchored(Align::Left, Height::Middle);
        canvas.text(&missing, DVec2::new(right + 10.0, at.y), &style);
    }
}
