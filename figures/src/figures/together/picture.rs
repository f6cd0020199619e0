//! Picture of views, floors, and the distance of every number from the truth.

use glam::DVec2;

use super::scene::TEXELS;
use super::study::Study;
use crate::plot::*;
use crate::space::picture::{gradient, radiance};

const SIDE: f64 = 160.0;
const GAP: f64 = 10.0;
const HEADS: f64 = 18.0;
/// Room for the names of parameters beside the plot.
const NAMES: f64 = 120.0;
/// Luminance difference at the ends of the colour scale.
const LIMIT: f64 = 0.05;
/// Score beyond which a number counts as not recovered; 95 % of recovered ones are within, by the normal
/// distribution.
pub(super) const LIKELY: f64 = 1.96;

/// Views, floors, and the scores of all numbers.
pub(super) fn draw(study: &Study) -> Canvas {
    let title = "Pose, paint, lamp and floor from two pictures";
    let (mut figure, rest) = fitted(study, title, "the floor: truth, start, mean of all fits");
    let space = figure.panel(rest, "mean less truth, in standard errors of the mean");
    scores(&mut figure, study, space);
    figure.canvas
}

/// Views and floors of one fit, and its loss.
pub(super) fn live(study: &Study) -> Canvas {
    let (mut figure, rest) = fitted(study, "", "the floor: truth, start, fit");
    let mut axes = Axes::new(Axis::linear("step"), Axis::log("loss")).legend(Legend::None);
    let points = (1..).zip(&study.losses).map(|(step, loss)| [f64::from(step), *loss]);
    axes.line(points, &Style::new(Palette::BLUE));
    figure.plot(rest, "loss of both pictures", &axes);
    figure.canvas
}

/// Targets, starts and fits with the floors below them; the rest of the page is free.
fn fitted(study: &Study, title: &str, of_floors: &str) -> (Figure, Rect) {
    let height = HEADS + 2.0 * (SIDE + GAP) + GUTTER + 250.0;
    let mut figure = Figure::new(4.0 * SIDE + 3.0 * GAP, height, title);
    let (heads, rest) = figure.body.split_top(HEADS);
    let column = |i: usize| heads.x + i as f64 * (SIDE + GAP);
    let style = TextStyle::new(10.5, Color::MUTED).anchored(Align::Left, Height::Top);
    for (i, name) in ["target", "start", "fit", "fit − target"].into_iter().enumerate() {
        figure.canvas.text(name, DVec2::new(column(i), heads.y), &style);
    }
    for (row, images) in study.pictures.iter().enumerate() {
        let place = |i: usize| Rect::new(column(i), rest.y + row as f64 * (SIDE + GAP), SIDE, SIDE);
        for (i, image) in images.iter().enumerate() {
            figure.canvas.picture(&radiance(&image.pixels, image.width), place(i));
        }
        let [target, _, fit] = images;
        let difference: Vec<_> = fit.pixels.iter().zip(&target.pixels).map(|(a, b)| *a - *b).collect();
        gradient(&mut figure.canvas, &difference, fit.width, &Shading::signed(LIMIT), place(3));
    }
    let below = rest.inset(0.0, 2.0 * (SIDE + GAP) + GUTTER, 0.0, 0.0);
    figure.canvas.part(Rect { height: below.y - figure.body.y - GUTTER, ..figure.body });
    let parts = below.columns(&[1.0, 1.25], GUTTER);
    let space = figure.panel(parts[0], of_floors);
    for (i, texels) in study.textures.iter().enumerate() {
        let side = (space.width - 2.0 * GAP) / 3.0;
        let pixels: Vec<_> = texels.chunks_exact(3).map(glam::DVec3::from_slice).collect();
        let place = Rect::new(space.x + i as f64 * (side + GAP), space.y, side, side);
        figure.canvas.picture(&radiance(&pixels, TEXELS), place);
    }
    (figure, parts[1])
}

/// Every number's distance from the truth.
fn scores(figure: &mut Figure, study: &Study, space: Rect) {
    let names = study.groups.iter().map(|group| (group.name.to_owned(), Palette::BLUE)).collect();
    let widest = study.scores().fold(3.0, |a: f64, s| a.max(s.abs())).min(20.0);
    let ticks = [-LIKELY, 0.0, LIKELY].map(|at| (at, number(at)));
    let axis = Axis::linear("standard errors").limits(-1.05 * widest, 1.05 * widest).ticks(ticks);
    let mut rows = Rows::new(axis, names);
    for end in [-LIKELY, 0.0, LIKELY] {
        rows.axes.vertical(end, &Style::new(Color::MUTED).width(1.0).dashed());
    }
    for (row, group) in study.groups.iter().enumerate() {
        for number in &group.numbers {
            rows.mark(row, number.score().clamp(-widest, widest), Marker::Ring);
        }
    }
    rows.draw(&mut figure.canvas, space, NAMES, 6.0);
}
