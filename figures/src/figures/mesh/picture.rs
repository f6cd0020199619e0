//! The picture.

use glam::DVec3;

use super::study::{Apart, Part, Study};
use crate::figures::common::draw_turn;
use crate::plot::{Figure, PANEL_TITLE_ROOM, Rect, Shading};
use crate::space::picture::{framed, gradient, luminance, on_film, radiance};

/// Side of a picture on the page.
const SIDE: f64 = 200.0;
const GAP: f64 = 12.0;
/// Room on the right for a colour bar and its label.
const BAR: f64 = 66.0;
/// The part of pixels whose magnitudes the colours reach: the brightest silhouettes are beyond.
const COVERED: f64 = 0.985;

const TITLE: &str = "A bunny that turns: the image, its derivative, and the terms of it";

/// Image and whole gradients above; below, the terms by warped area and by edge sampling.
pub(super) fn draw(study: &Study, caption: &str) -> Figure {
    let row_height = SIDE + PANEL_TITLE_ROOM;
    let mut figure = Figure::new(4.0 * SIDE + 3.0 * GAP + BAR, 3.0 * row_height + 2.0 * GAP, TITLE, caption);
    let (x, y) = (figure.body.x, figure.body.y);
    let cell = |row: usize, column: usize| {
        let (right, down) = (column as f64 * (SIDE + GAP), row as f64 * (row_height + GAP));
        Rect::new(x + right, y + down, SIDE, row_height)
    };
    let whole = study.edges.mean(Part::Whole);
    let shading = Shading::signed_covering(&luminance(&whole), COVERED);
    let space = figure.panel(cell(0, 0), 0, "the image I, turned by θ");
    let place = framed(&mut figure.canvas, &radiance(&study.image, study.side), space);
    turn(&mut figure, study, place);
    let wholes = [
        ("warped area", study.warped.mean(Part::Whole)),
        ("finite differences", study.differences.reference().gradient),
        ("edge sampling", whole),
    ];
    for (i, (name, pixels)) in wholes.iter().enumerate() {
        let space = figure.panel(cell(0, i + 1), i + 1, &format!("∂_{{θ}}I: {name}"));
        gradient(&mut figure.canvas, pixels, study.side, &shading, space);
    }
    bar(&mut figure, cell(0, 3), &shading, "∂_{θ}I (1/rad)");
    let faint = Shading::signed_covering(&luminance(&study.edges.mean(Part::Indirect)), COVERED);
    for (row, method) in [&study.warped, &study.edges].into_iter().enumerate() {
        terms(&mut figure, study, method, (row, &[0, 1, 2, 3].map(|c| cell(row + 1, c))), [&shading, &faint]);
        bar(&mut figure, cell(row + 1, 3), &faint, ["only (h)", "only (l)"][row]);
    }
    figure
}

/// One method's terms in a row.
fn terms(
    figure: &mut Figure,
    study: &Study,
    method: &Apart,
    (row, cells): (usize, &[Rect; 4]),
    [shading, faint]: [&Shading; 2],
) {
    let by = ["warped area", "edge sampling"][row];
    for (i, part) in Part::ALL.into_iter().skip(1).enumerate() {
        let title = if i == 0 { format!("{by}: {}", part.name()) } else { part.name().to_owned() };
        let space = figure.panel(cells[i], 4 * (row + 1) + i, &title);
        let shading = if part == Part::Indirect { faint } else { shading };
        gradient(&mut figure.canvas, &method.mean(part), study.side, shading, space);
    }
}

fn bar(figure: &mut Figure, beside: Rect, shading: &Shading, label: &str) {
    let at = Rect::new(beside.right() + 8.0, beside.y + PANEL_TITLE_ROOM + 8.0, 9.0, SIDE - 10.0);
    figure.canvas.vertical_color_bar(at, shading, label);
}

/// An arrow along the turn, above the floor in front of the bunny.
fn turn(figure: &mut Figure, study: &Study, place: Rect) {
    let at = |angle: f64| {
        let around = DVec3::new(angle.sin(), 0.0, angle.cos());
        on_film(&study.scene, place, 0.62 * around + 0.02 * DVec3::Y)
    };
    draw_turn(&mut figure.canvas, at, [-0.7, 0.5, 0.4, 0.7], [4.0, 2.2]);
}
