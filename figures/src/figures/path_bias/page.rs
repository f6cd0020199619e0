//! The picture: each world with its biases and prices.

use glam::DVec2;

use super::study::Study;
use super::worlds::OCCLUDER;
use crate::figures::flat::{draw_camera, draw_motion, draw_world};
use crate::figures::trade::bias::Curve;
use crate::plot::{Axes, Axis, Canvas, Color, Figure, GUTTER, Legend, Marker, Pen, Rect, Rows, Style, View};

/// Both worlds.
pub(super) fn draw(studies: &[Study]) -> Canvas {
    let mut figure = Figure::new(960.0, 600.0, "Bias and price of debiasing along paths");
    let rows = figure.body.rows(&vec![1.0; studies.len()], GUTTER);
    for (i, (study, row)) in studies.iter().zip(rows).enumerate() {
        let cells = row.columns(&[0.78, 0.9, 1.42], GUTTER);
        let space = figure.panel(cells[0], study.setting.name);
        figure.canvas.clipped(space, |canvas| draw_setting(canvas, study, space));
        let axes = bias_axes(study).legend(if i == 0 { Legend::TopRight } else { Legend::None });
        figure.plot(cells[1], "bias against the number of auxiliary rays", &axes);
        let space = figure.panel(cells[2], "variance × rays of a sample");
        draw_prices(&mut figure.canvas, study, space);
    }
    figure.canvas
}

fn draw_setting(canvas: &mut Canvas, study: &Study, space: Rect) {
    let setting = &study.setting;
    let [low, high] = setting.window;
    let view = View::upward(low, high, space);
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
    axes.horizontal(0.0, &Style::new(Color::MUTED).width(1.0));
    for Curve { series, points } in &study.curves {
        let style = Style::new(series.color).marker(series.marker).labelled(series.name);
        axes.measured(points.iter().map(|(n, b)| b.at(*n)), &style);
    }
    for scheme in study.schemes.iter().filter(|s| s.field.is_unbiased()) {
        let Some(rays) = scheme.field.auxiliary_rays() else { continue };
        let style = Style::new(scheme.field.color()).marker(scheme.field.marker()).radius(4.0);
        axes.measured([scheme.measured.bias.at(rays)], &style);
    }
    axes.scatter([], &Style::new(Color::MUTED).marker(Marker::Square).labelled("debiased, at its mean rays"));
    axes
}

/// Length on the page of the arrow that says “at least”.
const AT_LEAST: f64 = 20.0;

/// Rows of variance × rays with error bars, or with an arrow where it is a lower bound, and the missing part
/// of each.
fn draw_prices(canvas: &mut Canvas, study: &Study, space: Rect) {
    let ticks = [(10.0, "10"), (100.0, "100"), (1e3, "1000"), (1e4, "10⁴"), (1e5, "10⁵"), (1e6, "10⁶")];
    let costs = || study.schemes.iter().map(|s| s.measured.cost().ends());
    let least = costs().map(|[low, _]| low).filter(|c| *c > 0.0).fold(f64::INFINITY, f64::min);
    let most = costs().map(|[_, high]| high).fold(0.0, f64::max);
    let x = Axis::log("variance × rays").ticks(ticks).limits(0.6 * least, 6.0 * most);
    let names = study.schemes.iter().map(|s| (s.field.name(), s.field.color())).collect();
    let mut rows = Rows::new(x, names);
    for (index, scheme) in study.schemes.iter().enumerate() {
        let cost = scheme.measured.cost();
        if !scheme.is_bound() {
            let [low, high] = cost.ends();
            rows.bar(index, [low.max(0.3 * cost.value), high]);
        }
        let marker = if scheme.is_bound() { Marker::Ring } else { scheme.field.marker() };
        rows.mark(index, cost.value, marker);
    }
    let placed = rows.draw(canvas, space.inset(0.0, 14.0, 0.0, 0.0), 158.0, 92.0);
    rows.column(canvas, &placed, (10.0, "missing part"), |row| {
        (study.schemes[row].measured.bias.missing.shown(), Color::INK)
    });
    for (index, scheme) in study.schemes.iter().enumerate().filter(|(_, scheme)| scheme.is_bound()) {
        let Some(ring) = placed.at(rows.point(index, scheme.measured.cost().value)) else { continue };
        let from = ring + DVec2::new(5.0, 0.0);
        canvas.arrow(from, from + DVec2::new(AT_LEAST, 0.0), &Pen::new(scheme.field.color(), 1.2));
    }
}
