//! The picture: each scene, its gradient image, the error of every method, and what is wrong and what it costs.

use glam::{DVec2, DVec3};

use super::study::{Entry, Study};
use crate::figures::common::draw_turn;
use crate::plot::{
    Align, Axes, Axis, Canvas, Color, Figure, Height, Legend, Marker, PANEL_TITLE_ROOM, Rect, Shading, Style,
    TextStyle, number,
};
use crate::space::picture::{framed, gradient, luminance, on_film, radiance};

/// Side of a picture on the page.
const SIDE: f64 = 160.0;
const GAP: f64 = 12.0;
const COLUMNS: usize = 4;
/// Room for the colour bar and for the plots.
const BAR: f64 = 62.0;
const PLOTS: f64 = 330.0;
/// Room for the names of methods beside a plot.
const NAMES: f64 = 168.0;
/// The part of pixels whose magnitudes the colours reach.
const COVERED: f64 = 0.985;

/// All scenes, one below the other.
pub(super) fn draw(studies: &[Study], caption: &str) -> Figure {
    let row_height = SIDE + PANEL_TITLE_ROOM;
    let rows = |study: &Study| (2 + study.entries.len()).div_ceil(COLUMNS);
    let height: f64 = studies.iter().map(|study| rows(study) as f64 * (row_height + GAP)).sum::<f64>() + GAP;
    let width = COLUMNS as f64 * (SIDE + GAP) + BAR + PLOTS;
    let title = "Variance and bias: scenes that rotate, by every method";
    let mut figure = Figure::new(width, height, title, caption);
    let (mut top, mut index) = (figure.body.y, 0);
    for study in studies {
        let block = rows(study) as f64 * (row_height + GAP);
        let place = Rect::new(figure.body.x, top, figure.body.width, block - GAP);
        pictures(&mut figure, study, place, &mut index);
        let plots = Rect::new(place.right() - PLOTS, place.y, PLOTS, place.height);
        let halves = plots.rows(&[1.0, 1.0], GAP);
        let space = figure.panel(halves[0], index, "bias: the missing part");
        missing(&mut figure.canvas, study, space);
        let space = figure.panel(halves[1], index + 1, "cost: variance × processor time");
        costs(&mut figure.canvas, study, space);
        index += 2;
        top += block + GAP;
    }
    figure
}

/// The image, the reference and every method's error.
fn pictures(figure: &mut Figure, study: &Study, place: Rect, index: &mut usize) {
    let shading = Shading::signed_covering(&luminance(&study.reference.gradient), COVERED);
    let side = study.setting.side();
    let mut next = |figure: &mut Figure, number: usize, title: &str| {
        let (row, column) = (number / COLUMNS, number % COLUMNS);
        let step = SIDE + PANEL_TITLE_ROOM + GAP;
        let (x, y) = (place.x + column as f64 * (SIDE + GAP), place.y + row as f64 * step);
        let space = figure.panel(Rect::new(x, y, SIDE, SIDE + PANEL_TITLE_ROOM), *index, title);
        *index += 1;
        space
    };
    let space = next(figure, 0, study.setting.name);
    let film = framed(&mut figure.canvas, &radiance(&study.image, side), space);
    turn(&mut figure.canvas, study, film);
    let space = next(figure, 1, "∂_{θ}I, the reference");
    gradient(&mut figure.canvas, &study.reference.gradient, side, &shading, space);
    for (i, entry) in study.entries.iter().enumerate() {
        let space = next(figure, i + 2, entry.method.short);
        gradient(&mut figure.canvas, &entry.error, side, &shading, space);
    }
    let right = place.x + COLUMNS as f64 * (SIDE + GAP) - GAP + 8.0;
    let bar = Rect::new(right, place.y + PANEL_TITLE_ROOM + 12.0, 9.0, SIDE - 16.0);
    figure.canvas.vertical_color_bar(bar, &shading, "1/rad");
}

/// An arrow along the turn, on the floor in front.
fn turn(canvas: &mut Canvas, study: &Study, film: Rect) {
    let at = |angle: f64| {
        let around = 1.25 * DVec3::new(angle.sin(), 0.0, angle.cos());
        on_film(&study.setting.scene, film, around)
    };
    draw_turn(canvas, at, [-0.6, 0.4, 0.3, 0.62], [3.4, 1.8]);
}

/// The place of the i-th of `count` methods on the vertical axis, from the top.
fn row(index: usize, count: usize) -> f64 {
    (count - 1 - index) as f64
}

/// Axes with a row for every method.
fn rows(study: &Study, x: Axis) -> Axes {
    let none: [(f64, String); 0] = [];
    let y = Axis::linear("").ticks(none).limits(-0.6, study.entries.len() as f64 - 0.4);
    Axes::new(x, y).legend(Legend::None)
}

/// Draws axes with the names of methods beside them.
fn named(canvas: &mut Canvas, study: &Study, axes: &Axes, space: Rect) {
    let placed = axes.draw(canvas, space.inset(NAMES, 0.0, 8.0, 0.0));
    for (i, entry) in study.entries.iter().enumerate() {
        let Some(at) = placed.at([placed.x.low(), row(i, study.entries.len())]) else { continue };
        let style = TextStyle::new(9.8, entry.method.color.mix(Color::INK, 0.25));
        let style = style.anchored(Align::Right, Height::Middle);
        canvas.text(entry.method.name, DVec2::new(at.x - 8.0, at.y), &style);
    }
}

fn missing(canvas: &mut Canvas, study: &Study, space: Rect) {
    let reach = |e: &Entry| (1.0 - e.quiet.value).abs() + e.quiet.error;
    let widest = study.entries.iter().map(reach).fold(0.12, f64::max);
    let step = [5.0, 2.0, 1.0].map(|digit| digit * 10f64.powf(widest.log10().floor()));
    let step = step.into_iter().find(|step| *step <= widest).unwrap_or(widest);
    let ticks = [-step, 0.0, step].map(|t| (t, number(t)));
    let mut axes = rows(study, Axis::linear("1 − slope").limits(-widest, widest).ticks(ticks));
    axes.vertical(0.0, "", &Style::new(Color::MUTED).width(1.0));
    for (i, entry) in study.entries.iter().enumerate() {
        let (value, error) = (1.0 - entry.quiet.value, entry.quiet.error);
        let style = Style::new(entry.method.color);
        axes.line([value - error, value + error].map(|x| [x, row(i, study.entries.len())]), &style);
        let marker = if entry.is_biased() { Marker::Circle } else { Marker::Ring };
        axes.scatter([[value, row(i, study.entries.len())]], &style.marker(marker).radius(4.0));
    }
    named(canvas, study, &axes, space);
}

fn costs(canvas: &mut Canvas, study: &Study, space: Rect) {
    let costs: Vec<f64> = study.entries.iter().map(Entry::cost).collect();
    let (low, high) = costs.iter().fold((f64::INFINITY, 0.0_f64), |(l, h), c| (l.min(*c), h.max(*c)));
    let x = Axis::log("variance × seconds").limits(0.3 * low, 4.0 * high);
    let mut axes = rows(study, x);
    for (i, entry) in study.entries.iter().enumerate() {
        let spread = entry.measured.variance_error / entry.measured.variance;
        let ends = [(1.0 - spread).max(0.3), 1.0 + spread].map(|f| f * entry.cost());
        let style = Style::new(entry.method.color);
        axes.line(ends.map(|x| [x, row(i, study.entries.len())]), &style);
        let point = [entry.cost(), row(i, study.entries.len())];
        axes.scatter([point], &style.marker(Marker::Circle).radius(4.0));
    }
    named(canvas, study, &axes, space);
}
