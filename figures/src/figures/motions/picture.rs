//! Picture of each scene, its gradient image, the error of every method, and the biases and costs.

use glam::DVec3;

use super::study::{Entry, Study};
use crate::figures::common::draw_turn;
use crate::plot::*;
use crate::space::picture::{gradient, luminance, on_film, radiance};

/// Side of a picture on the page.
const SIDE: f64 = 384.0;
const GAP: f64 = 14.0;
/// Room for the colour bar.
const BAR: f64 = 62.0;
/// Height of the plots.
const PLOTS: f64 = 250.0;
/// Room for the names of methods beside a plot.
const NAMES: f64 = 168.0;
/// Part of the pixels whose magnitudes the colours cover.
const COVERED: f64 = 0.985;

/// Both scenes, one below the other: image and gradient image, and below them what the methods do.
pub(super) fn draw(studies: &[Study]) -> Canvas {
    let row = SIDE + PANEL_TITLE_ROOM + GAP + PLOTS + 2.0 * GAP;
    let width = 2.0 * SIDE + GAP + BAR;
    let title = "Variance and bias: scenes that rotate, by every method";
    let mut figure = Figure::new(width, studies.len() as f64 * row, title);
    for (i, study) in studies.iter().enumerate() {
        let place = Rect { y: figure.body.y + i as f64 * row, height: row - 2.0 * GAP, ..figure.body };
        let (pictures, plots) = place.split_top(SIDE + PANEL_TITLE_ROOM + GAP);
        draw_pictures(&mut figure, study, pictures);
        let halves = plots.columns(&[1.0, 1.0], GAP);
        let space = figure.panel(halves[0], "bias: the missing part");
        missing(&mut figure.canvas, study, space);
        let space = figure.panel(halves[1], "cost: variance × processor time");
        costs(&mut figure.canvas, study, space);
    }
    figure.canvas
}

/// The image and its gradient.
fn draw_pictures(figure: &mut Figure, study: &Study, space: Rect) {
    let shown = &study.shown;
    let cell = |i: f64| Rect::new(space.x + i * (SIDE + GAP), space.y, SIDE, SIDE + PANEL_TITLE_ROOM);
    let place = figure.panel(cell(0.0), study.setting.name);
    let film = figure.canvas.picture(&radiance(&shown.image, shown.side), place);
    turn(&mut figure.canvas, study, film);
    let place = figure.panel(cell(1.0), "∂_{θ}I, by edge sampling");
    let shading = Shading::signed_covering(&luminance(&shown.gradient), COVERED);
    gradient(&mut figure.canvas, &shown.gradient, shown.side, &shading, place);
    let bar = Rect::new(cell(1.0).right() + 8.0, place.y + 12.0, 9.0, SIDE - 24.0);
    figure.canvas.color_bar(bar, &shading, "1/rad");
}

/// An arrow along the rotation, on the floor in front.
fn turn(canvas: &mut Canvas, study: &Study, film: Rect) {
    let at = |angle: f64| {
        let around = 1.25 * DVec3::new(angle.sin(), 0.0, angle.cos());
        on_film(&study.setting.scene, film, around)
    };
    draw_turn(canvas, at, [-0.6, 0.4, 0.3, 0.62], [3.4, 1.8]);
}

/// A row for every method.
fn rows(study: &Study, x: Axis) -> Rows {
    let names = study.entries.iter().map(|entry| (entry.method.name.to_owned(), entry.method.color));
    Rows::new(x, names.collect())
}

fn missing(canvas: &mut Canvas, study: &Study, space: Rect) {
    let reach = |e: &Entry| (1.0 - e.quiet().value).abs() + e.quiet().error;
    let widest = study.entries.iter().map(reach).fold(0.12, f64::max);
    let step = [5.0, 2.0, 1.0].map(|digit| digit * 10f64.powf(widest.log10().floor()));
    let step = step.into_iter().find(|step| *step <= widest).unwrap_or(widest);
    let ticks = [-step, 0.0, step].map(|t| (t, number(t)));
    let mut rows = rows(study, Axis::linear("1 − slope").limits(-widest, widest).ticks(ticks));
    rows.axes.vertical(0.0, &Style::new(Color::MUTED).width(1.0));
    for (i, entry) in study.entries.iter().enumerate() {
        rows.bar(i, entry.quiet().ends().map(|slope| 1.0 - slope));
        let marker = if entry.is_biased() { Marker::Circle } else { Marker::Ring };
        rows.mark(i, 1.0 - entry.quiet().value, marker);
    }
    rows.draw(canvas, space, NAMES, 8.0);
}

fn costs(canvas: &mut Canvas, study: &Study, space: Rect) {
    let costs: Vec<f64> = study.entries.iter().map(Entry::cost).collect();
    let (low, high) = costs.iter().fold((f64::INFINITY, 0.0_f64), |(l, h), c| (l.min(*c), h.max(*c)));
    let mut rows = rows(study, Axis::log("variance × seconds").limits(0.3 * low, 4.0 * high));
    for (i, entry) in study.entries.iter().enumerate() {
        let spread = entry.compared.variance.error / entry.compared.variance.value;
        rows.bar(i, [(1.0 - spread).max(0.3), 1.0 + spread].map(|f| f * entry.cost()));
        rows.mark(i, entry.cost(), Marker::Circle);
    }
    rows.draw(canvas, space, NAMES, 8.0);
}
