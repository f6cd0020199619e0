//! The picture and the animation.

use glam::DVec2;

use super::fit::{Fit, Shown};
use super::shapes::Subject;
use crate::plot::*;
use crate::space::picture::{gradient, radiance};

/// Side of a picture on the page: of 128 pixels, each is two device pixels wide.
const SIDE: f64 = 128.0;
const GAP: f64 = 8.0;
/// Room above the pictures for their headings.
const HEADS: f64 = 17.0;
/// Room on the right for the colour bar.
const BAR: f64 = 58.0;
const PLOTS: f64 = 215.0;
/// Luminance difference at the ends of the colour scale.
const LIMIT: f64 = 0.25;

const COLORS: [Color; 4] = [Palette::BLUE, Palette::SKY, Palette::VERMILION, Palette::ORANGE];

/// A row for each fit, and below the curves of all.
pub(super) fn draw(fits: &[Fit], title: &str) -> Canvas {
    let row = PANEL_TITLE_ROOM + SIDE + GAP;
    let width = 7.0 * SIDE + 6.0 * GAP + 2.0 * GAP + BAR;
    let height = HEADS + fits.len() as f64 * row + PLOTS;
    let mut figure = Figure::new(width, height, title);
    let (heads, rest) = figure.body.split_top(HEADS);
    let names = ["target", "start", "fit", "fit − target", "target, held out", "fit", "fit − target"];
    let style = TextStyle::new(10.5, Color::MUTED).anchored(Align::Left, Height::Top);
    for (name, cell) in names.iter().zip(cells(heads)) {
        figure.canvas.text(name, DVec2::new(cell.x, cell.y), &style);
    }
    let shading = Shading::signed(LIMIT);
    let mut place = rest;
    for fit in fits {
        let title = format!(
            "{}, {}: Chamfer distance {} %, at first {} %",
            fit.subject.name(),
            fit.light.name(),
            number(100.0 * fit.chamfer()),
            number(100.0 * fit.moments[0].chamfer)
        );
        let strip = Rect { height: row - GAP, ..place };
        let space = figure.panel(strip, &title);
        pictures(&mut figure.canvas, fit, &cells(space), &shading);
        place = place.inset(0.0, row, 0.0, 0.0);
    }
    let bar = Rect::new(rest.right() - BAR + 8.0, rest.y + PANEL_TITLE_ROOM, 9.0, SIDE);
    figure.canvas.color_bar(bar, &shading, "luminance");
    let halves = place.inset(0.0, 4.0, 0.0, 0.0).columns(&[0.85, 1.0], GUTTER);
    curves(&mut figure, fits, &halves);
    figure.canvas
}

/// The cells of a row's pictures: four of a view used by the fit, and three of a held-out one.
fn cells(row: Rect) -> Vec<Rect> {
    (0..7)
        .map(|i| {
            let x = row.x + f64::from(i) * (SIDE + GAP) + if i > 3 { 2.0 * GAP } else { 0.0 };
            Rect::new(x, row.y, SIDE, row.height.min(SIDE))
        })
        .collect()
}

fn pictures(canvas: &mut Canvas, fit: &Fit, cells: &[Rect], shading: &Shading) {
    let side = fit.effort.side;
    let [known, unknown] = &fit.shown;
    let seen = [&known.target, &known.start, &known.fit, &unknown.target, &unknown.fit];
    for (pixels, cell) in seen.into_iter().zip([0, 1, 2, 4, 5]) {
        canvas.picture(&radiance(pixels, side), cells[cell]);
    }
    for (shown, cell) in [(known, 3), (unknown, 6)] {
        let Shown { target, fit, .. } = shown;
        let difference: Vec<_> = fit.iter().zip(target).map(|(a, b)| *a - *b).collect();
        gradient(canvas, &difference, side, shading, cells[cell]);
    }
}

fn curves(figure: &mut Figure, fits: &[Fit], halves: &[Rect]) {
    let mut axes = Axes::new(Axis::linear("step"), Axis::log("loss")).legend(Legend::None);
    for (fit, color) in fits.iter().zip(COLORS) {
        // Views differ: means over as many steps as see all.
        let round = fit.effort.views / fit.effort.batch;
        let means = fit.losses.chunks(round).enumerate().map(|(i, losses)| {
            let middle = (i * round) as f64 + 0.5 * losses.len() as f64;
            [middle, losses.iter().sum::<f64>() / losses.len() as f64]
        });
        axes.line(means, &Style::new(color));
    }
    figure.plot(halves[0], "loss of the views, mean over a round of all", &axes);
    let mut axes = Axes::new(Axis::linear("step"), Axis::log("% of the diagonal")).legend(Legend::Outside);
    for (fit, color) in fits.iter().zip(COLORS) {
        let name = format!("{}, {}", fit.subject.name(), fit.light.name());
        axes.line(distances(fit), &Style::new(color).labelled(name));
    }
    axes.horizontal(100.0 * super::GOAL[0], &Style::new(Color::MUTED).dashed().labelled("the goal"));
    figure.plot(halves[1], "Chamfer distance of the surfaces", &axes);
}

fn distances(fit: &Fit) -> impl Iterator<Item = [f64; 2]> {
    fit.moments.iter().map(|moment| [moment.step as f64, 100.0 * moment.chamfer])
}

/// The fits with shadows, step by step beside their targets; the last is held.
pub(super) fn frames(fits: &[Fit]) -> Vec<Canvas> {
    const SIDE: f64 = 192.0;
    const HOLD: usize = 8;
    let moving: Vec<(&Fit, Color)> =
        fits.iter().zip(COLORS).filter(|(fit, _)| fit.light == super::scene::Light::Lamp).collect();
    let count = moving.iter().map(|(fit, _)| fit.moments.len()).min().unwrap_or(0);
    let frame = |i: usize| {
        let columns = (2 * moving.len()) as f64;
        let mut figure = Figure::new(columns * (SIDE + GAP) + GAP, SIDE + 22.0 + 150.0, "");
        let (top, below) = figure.body.split_top(SIDE + 22.0);
        let mut axes =
            Axes::new(Axis::linear("step"), Axis::log("Chamfer distance (%)")).legend(Legend::Outside);
        for (k, (fit, color)) in moving.iter().enumerate() {
            let moment = &fit.moments[i];
            let from = fit.subject == Subject::Bunny;
            let start = if from { "a sphere" } else { "a torus" };
            let titles =
                [format!("{}: target", fit.subject.name()), format!("from {start}, step {}", moment.step)];
            for (j, (pixels, title)) in
                [&fit.shown[1].target, &moment.picture].into_iter().zip(titles).enumerate()
            {
                let x = top.x + (2 * k + j) as f64 * (SIDE + GAP) + k as f64 * GAP;
                let style = TextStyle::new(12.0, Color::INK).anchored(Align::Left, Height::Top);
                figure.canvas.text(&title, DVec2::new(x, top.y), &style);
                figure
                    .canvas
                    .picture(&radiance(pixels, fit.effort.side), Rect::new(x, top.y + 18.0, SIDE, SIDE));
            }
            axes.line(distances(fit), &Style::new(*color).labelled(fit.subject.name()));
            let now = [moment.step as f64, 100.0 * moment.chamfer];
            axes.scatter([now], &Style::new(*color).marker(Marker::Circle).radius(4.0));
        }
        axes.draw(&mut figure.canvas, below.inset(0.0, 6.0, 0.0, 0.0));
        figure.canvas
    };
    (0..count).chain(std::iter::repeat_n(count.saturating_sub(1), HOLD.min(count))).map(frame).collect()
}
