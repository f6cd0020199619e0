//! V, ∇·V and B along the line across the silhouette.

use glam::DVec2;

use super::check::Check;
use super::edge::{KAPPA, Profile, Reading, Weight};
use crate::plot::*;

const BODY: f64 = 960.0;
const PANEL: f64 = 300.0;
const KEY: f64 = 24.0;
const COLORS: [Color; 4] = [Palette::GREY, Palette::ORANGE, Palette::BLUE, Palette::GREEN];
const ACROSS: &str = "distance from the silhouette, in kernel widths";

pub(super) fn draw(profiles: &[Profile], checks: &[Check]) -> Canvas {
    let mut figure = Figure::new(BODY, PANEL + KEY, "Three attempts, along a line across a silhouette");
    let (key, body) = figure.body.split_top(KEY);
    legend(&mut figure.canvas, key, profiles);
    figure.canvas.part(key);
    let panels = body.columns(&[1.0, 1.0, 0.72], 26.0);
    let space = figure.panel(panels[0], "the field V·n");
    values(&mut figure.canvas, space, profiles, checks);
    let space = figure.panel(panels[1], "its divergence ∇·V");
    divergences(&mut figure.canvas, space, profiles);
    let space = figure.panel(panels[2], "boundary functions B");
    boundaries(&mut figure.canvas, space);
    figure.canvas
}

fn legend(canvas: &mut Canvas, space: Rect, profiles: &[Profile]) {
    let style = TextStyle::new(11.0, Color::INK).anchored(Align::Left, Height::Middle);
    let mut at = DVec2::new(space.x, space.y + 6.0);
    for (profile, color) in profiles.iter().zip(COLORS) {
        canvas.line(at, at + DVec2::new(18.0, 0.0), &Pen::new(color, 2.2));
        at.x += 24.0;
        at.x += canvas.text(&profile.name, at, &style) + 16.0;
    }
    canvas.disc(at + DVec2::new(4.0, 0.0), 2.4, Color::INK);
    canvas.text("quadrature", at + DVec2::new(11.0, 0.0), &style);
}

fn across() -> Axis {
    Axis::linear(ACROSS).limits(-3.0, 3.0)
}

/// Curves of one quantity; a gap at the silhouette where attempt 1 is discontinuous.
fn curves(axes: &mut Axes, profiles: &[Profile], which: usize) {
    for (profile, color) in profiles.iter().zip(COLORS) {
        let style = Style::new(color).width(if color == Palette::GREY { 2.4 } else { 1.9 });
        let readings = || profile.readings.iter();
        if readings().any(|r| r.error[which] > 0.0) {
            let band = |r: &Reading| {
                [r.x, r.value[which] - 2.0 * r.error[which], r.value[which] + 2.0 * r.error[which]]
            };
            axes.band(readings().map(band), &style);
            axes.line(readings().map(|r| [r.x, r.value[which]]), &style);
        } else {
            let points: Vec<_> = readings().map(|r| [r.x, r.value[which]]).collect();
            let jump = points.partition_point(|point| point[0] < 0.0);
            axes.line(points[..jump].to_vec(), &style);
            axes.line(points[jump..].to_vec(), &style);
        }
    }
}

fn values(canvas: &mut Canvas, space: Rect, profiles: &[Profile], checks: &[Check]) {
    let mut axes = Axes::new(across(), Axis::linear("V·n / |v|").limits(-0.1, 1.25)).legend(Legend::None);
    axes.vertical(0.0, &Style::new(Color::SPINE).width(1.0).dashed());
    curves(&mut axes, profiles, 0);
    let dots = checks.iter().map(|check| [check.x, check.exact]);
    axes.scatter(dots, &Style::new(Color::INK).marker(Marker::Circle).radius(2.4));
    axes.scatter([[0.0, 1.0]], &Style::new(Palette::VERMILION).marker(Marker::Ring).radius(5.0).width(2.2));
    let placed = axes.draw(canvas, space);
    let style = TextStyle::new(10.5, Color::MUTED).anchored(Align::Centre, Height::Middle).halo(Color::WHITE);
    for (x, text) in [(-1.7, "half-plane, v = 1"), (1.7, "background, at rest")] {
        if let Some(at) = placed.at([x, -0.055]) {
            canvas.text(text, at, &style);
        }
    }
    let style =
        TextStyle::new(10.5, Palette::VERMILION).anchored(Align::Left, Height::Middle).halo(Color::WHITE);
    if let Some(at) = placed.at([0.0, 1.0]) {
        canvas.text("boundary velocity", at + DVec2::new(12.0, -9.0), &style);
    }
}

fn divergences(canvas: &mut Canvas, space: Rect, profiles: &[Profile]) {
    let lowest = profiles.iter().flat_map(|p| &p.readings).map(|r| r.value[1]).fold(0.0, f64::min);
    let low = 1.3 * lowest;
    let y = Axis::linear("∇·V, per kernel width").limits(low, -0.2 * low);
    let mut axes = Axes::new(across(), y).legend(Legend::None);
    axes.vertical(0.0, &Style::new(Color::SPINE).width(1.0).dashed());
    curves(&mut axes, profiles, 1);
    let placed = axes.draw(canvas, space);
    // The direct field's divergence at the silhouette, which no reading can show.
    if let (Some(top), Some(bottom)) = (placed.at([0.0, 0.0]), placed.at([0.0, low])) {
        let tip = bottom - DVec2::new(0.0, 3.0);
        canvas.arrow(top, tip, &Pen::new(COLORS[0], 2.4));
        let style = TextStyle::new(10.5, COLORS[0]).anchored(Align::Right, Height::Middle).halo(Color::WHITE);
        canvas.text("attempt 1: a Dirac peak", tip + DVec2::new(-8.0, -24.0), &style);
        canvas.text("that no sample hits", tip + DVec2::new(-8.0, -10.0), &style);
    }
}

fn boundaries(canvas: &mut Canvas, space: Rect) {
    let x = Axis::linear("distance s, in kernel widths").limits(0.0, 6.0);
    let mut axes = Axes::new(x, Axis::linear("B(s)").limits(0.0, 1.1)).legend(Legend::None);
    for (weight, color) in Weight::both().iter().zip(&COLORS[2..]) {
        let point = |s: f64| [s, weight.boundary.value(s, KAPPA)];
        axes.line((0..=240).map(|i| point(f64::from(i) * 0.025)), &Style::new(*color).width(1.9));
        axes.note(point(0.62 * weight.boundary.reach(KAPPA)), weight.name, *color);
    }
    axes.draw(canvas, space);
}
