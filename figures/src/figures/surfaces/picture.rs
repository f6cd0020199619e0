//! The picture.

use glam::DVec2;

use crate::plot::*;
use crate::space::picture::{gradient, radiance};
use crate::space::reconstruction::Reconstruction;
use crate::space::studio::Subject;

const SIDE: f64 = 128.0;
const GAP: f64 = 8.0;
/// Room above the pictures for their headings.
const HEADS: f64 = 17.0;
/// Room on the right for the colour bar.
const BAR: f64 = 58.0;
const PLOTS: f64 = 225.0;
/// Luminance difference at the ends of the colour scale.
const LIMIT: f64 = 0.25;

const COLORS: [Color; 4] = [Palette::BLUE, Palette::VERMILION, Palette::GREEN, Palette::PURPLE];

/// Data shared by all rows.
pub(super) struct Page<'a> {
    pub(super) title: &'a str,
    /// The side of the film in pixels.
    pub(super) side: usize,
    /// Cells along each side of the grid after every phase.
    pub(super) cells: &'a [usize],
}

/// A row for the first fit of each subject and one for the first in the sun, and below the curves of those
/// that are not.
pub(super) fn draw(page: &Page<'_>, fits: &[&Reconstruction], sunny: &[&Reconstruction]) -> Canvas {
    let row = PANEL_TITLE_ROOM + SIDE + GAP;
    let columns = 3 + page.cells.len();
    let of = |subject: Subject| fits.iter().any(|fit| fit.subject == subject);
    let rows = Subject::ALL.into_iter().filter(|subject| of(*subject)).count() + sunny.len().min(1);
    let width = columns as f64 * (SIDE + GAP) + BAR;
    let height = HEADS + rows as f64 * row + PLOTS;
    let mut figure = Figure::new(width, height, page.title);
    let (heads, rest) = figure.body.split_top(HEADS);
    let after = page.cells.iter().map(|n| format!("after {n}³ cells"));
    let names = ["target, held out", "start"].into_iter().map(str::to_owned).chain(after);
    let names: Vec<String> = names.chain(["last − target".to_owned()]).collect();
    let style = TextStyle::new(10.5, Color::MUTED).anchored(Align::Left, Height::Top);
    let place_of = |i: usize, y: f64| Rect::new(rest.x + i as f64 * (SIDE + GAP), y, SIDE, SIDE);
    for (i, name) in names.iter().enumerate() {
        figure.canvas.text(name, DVec2::new(place_of(i, 0.0).x, heads.y), &style);
    }
    let shading = Shading::signed(LIMIT);
    let mut place = rest;
    let rows = Subject::ALL.map(|subject| (fits, subject, "")).into_iter();
    for (fits, subject, lit) in rows.chain([(sunny, Subject::Bunny, " in the sun")]) {
        let of_subject = || fits.iter().filter(|fit| fit.subject == subject);
        let Some(first) = of_subject().next() else { continue };
        let chamfers: Vec<String> = of_subject().map(|fit| number(100.0 * fit.chamfer())).collect();
        let (name, chamfers) = (subject.name(), chamfers.join(", "));
        let title = format!("{name}{lit}: Chamfer distance {chamfers} % of the diagonal");
        let space = figure.panel(Rect { height: row - GAP, ..place }, &title);
        let seen = std::iter::once(&first.target).chain(&first.stages);
        for (i, pixels) in seen.enumerate() {
            figure.canvas.picture(&radiance(pixels, page.side), place_of(i, space.y));
        }
        if let Some(last) = first.stages.last() {
            let difference: Vec<_> = last.iter().zip(&first.target).map(|(a, b)| *a - *b).collect();
            gradient(&mut figure.canvas, &difference, page.side, &shading, place_of(columns - 1, space.y));
        }
        place = place.inset(0.0, row, 0.0, 0.0);
    }
    let bar = Rect::new(rest.right() - BAR + 8.0, rest.y + PANEL_TITLE_ROOM, 9.0, SIDE);
    figure.canvas.color_bar(bar, &shading, "luminance");
    let mut axes = Axes::new(Axis::linear("step"), Axis::log("% of the diagonal")).legend(Legend::Outside);
    for (subject, color) in Subject::ALL.into_iter().zip(COLORS) {
        for fit in fits.iter().filter(|fit| fit.subject == subject) {
            let style = Style::new(color);
            let style = if fit.number == 1 { style.labelled(subject.name()) } else { style };
            axes.line(fit.moments.iter().map(|m| [m.step as f64, 100.0 * m.chamfer]), &style);
        }
    }
    axes.horizontal(100.0 * super::GOAL.0, &Style::new(Color::MUTED).dashed().labelled("the goal"));
    figure.plot(place.inset(0.0, 4.0, 0.0, 0.0), "Chamfer distance of the surfaces, for every seed", &axes);
    figure.canvas
}
