//! The picture.

use glam::DVec2;

use super::study::{Arm, Entry, Flaw, Study};
use crate::plot::*;
use crate::space::picture::radiance;

const SIDE: f64 = 128.0;
const GAP: f64 = 16.0;
const PLOT: f64 = 250.0;

/// The target and the result of each fit, with its distance below.
pub(super) fn draw(study: &Study) -> Canvas {
    let shown = [
        Arm::WarpedArea,
        Arm::Masks(Flaw::Pixels(0)),
        Arm::Masks(Flaw::Pixels(-4)),
        Arm::Masks(Flaw::Pixels(4)),
        Arm::Masks(Flaw::Holes),
        Arm::Masks(Flaw::All),
        Arm::Nothing,
    ];
    let row = PANEL_TITLE_ROOM + SIDE + GAP;
    let width = 4.0 * (SIDE + GAP) + 2.0 * PLOT;
    let title = "The bunny as a network: from pictures alone, and from pictures and masks";
    let mut figure = Figure::new(width, 2.0 * row + 40.0, title);
    let (body, side) = (figure.body, study.effort.side);
    let place = |i: usize| {
        let (column, line) = (i % 4, i / 4);
        DVec2::new(body.x + column as f64 * (SIDE + GAP), body.y + line as f64 * (row + 12.0))
    };
    let head = TextStyle::new(10.5, Color::MUTED).anchored(Align::Left, Height::Top);
    let mut picture = |i: usize, name: &str, below: &str, pixels: &[glam::DVec3]| {
        let at = place(i);
        figure.canvas.text(name, at, &head);
        figure.canvas.picture(&radiance(pixels, side), Rect::new(at.x, at.y + 14.0, SIDE, SIDE));
        figure.canvas.text(below, at + DVec2::new(0.0, SIDE + 15.0), &head);
    };
    if let Some(first) = study.first(Arm::WarpedArea) {
        picture(0, "target, held out", "", &first.fit.target);
    }
    for (i, arm) in shown.into_iter().enumerate() {
        let Some(entry) = study.first(arm) else { continue };
        if let Some(last) = entry.fit.stages.last() {
            let vanished = entry.fit.vanished.map_or(String::new(), |step| format!(", ended at step {step}"));
            let below = format!("{} %{vanished}", number(100.0 * entry.fit.chamfer()));
            picture(i + 1, &arm.name(), &below, last);
        }
    }
    let mut axes = Axes::new(
        Axis::linear("pixels by which masks are too large"),
        Axis::log("Chamfer distance, % of the diagonal"),
    )
    .legend(Legend::Outside);
    let distance = |arm| study.of(arm).map(|entry| 100.0 * entry.fit.chamfer());
    let pixels = [-4, -2, -1, 0, 1, 2, 4].map(|n| (n, Arm::Masks(Flaw::Pixels(n))));
    let line = pixels.iter().filter_map(|&(n, arm)| Some([f64::from(n), distance(arm).next()?]));
    axes.line(line, &Style::new(Palette::VERMILION).labelled("masks, too small or too large"));
    for (n, arm) in pixels {
        axes.scatter(distance(arm).map(|d| [f64::from(n), d]), &Style::new(Palette::VERMILION));
    }
    for (i, d) in distance(Arm::WarpedArea).enumerate() {
        let style = Style::new(Palette::BLUE);
        let style = if i == 0 { style.labelled("warped area, no mask") } else { style };
        axes.horizontal(d, &style);
    }
    let others = [
        (Arm::Masks(Flaw::Holes), "masks with holes", Palette::GREEN),
        (Arm::Masks(Flaw::All), "masks of all pixels", Palette::ORANGE),
        (Arm::Nothing, "interior term alone", Color::MUTED),
    ];
    for (arm, name, color) in others {
        if let Some(d) = distance(arm).next() {
            axes.horizontal(d, &Style::new(color).dashed().labelled(name));
        }
    }
    let left = body.x + 4.0 * (SIDE + GAP) + 6.0;
    figure.canvas.part(Rect { width: left - body.x, ..body });
    let space = Rect::new(left, body.y, body.right() - left, 2.0 * row + 4.0);
    figure.plot(space, "How far the surfaces are from the bunny", &axes);
    figure.canvas
}

/// Target, start and ends of some fits, and their distances by steps.
pub(super) fn live(entries: &[Entry], side: usize) -> Canvas {
    let width = (2 + entries.len()) as f64 * (SIDE + GAP);
    let mut figure = Figure::new(width + 1.6 * PLOT, SIDE + 40.0, "");
    let body = figure.body;
    let head = TextStyle::new(10.5, Color::MUTED).anchored(Align::Left, Height::Top);
    let mut picture = |i: usize, name: &str, pixels: &[glam::DVec3]| {
        let at = DVec2::new(body.x + i as f64 * (SIDE + GAP), body.y);
        figure.canvas.text(name, at, &head);
        figure.canvas.picture(&radiance(pixels, side), Rect::new(at.x, at.y + 14.0, SIDE, SIDE));
    };
    let mut axes = Axes::new(Axis::linear("step"), Axis::log("Chamfer distance, %")).legend(Legend::Outside);
    if let Some(first) = entries.first() {
        picture(0, "target, held out", &first.fit.target);
        picture(1, "start", &first.fit.stages[0]);
    }
    for ((i, entry), color) in entries.iter().enumerate().zip([Palette::BLUE, Palette::VERMILION]) {
        if let Some(last) = entry.fit.stages.last() {
            picture(2 + i, &entry.arm.name(), last);
        }
        let style = Style::new(color).labelled(entry.arm.name());
        axes.line(entry.fit.moments.iter().map(|m| [m.step as f64, 100.0 * m.chamfer]), &style);
    }
    let plot = Rect::new(body.x + width, body.y, 1.6 * PLOT, SIDE + 36.0);
    axes.draw(&mut figure.canvas, plot);
    figure.canvas.part(Rect { width: width - GAP, ..body });
    figure.canvas.part(plot);
    figure.canvas
}
