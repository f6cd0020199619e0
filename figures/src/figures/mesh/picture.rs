//! The picture.

use glam::DVec3;

use super::study::{Part, Parts, Study};
use crate::figures::common::draw_turn;
use crate::plot::{Canvas, Figure, PANEL_TITLE_ROOM, Rect, Shading};
use crate::space::picture::{gradient, luminance, on_film, radiance};

/// Side of a picture on the page.
const SIDE: f64 = 200.0;
const GAP: f64 = 12.0;
/// Room on the right for a colour bar and its label.
const BAR: f64 = 66.0;
/// Part of the pixels whose magnitudes the colours cover: the brightest silhouettes are beyond.
const COVERED: f64 = 0.985;

/// Side of the blocks of pixels whose mean is shown of indirect light, which is faint.
pub(super) const BLOCK: usize = 4;

const TITLE: &str = "A bunny that turns: the image, its derivative, and the terms of it";

/// Image and whole gradients above; below, the terms by warped area and by edge sampling.
pub(super) fn draw(study: &Study) -> Canvas {
    let height = 3.0 * (SIDE + PANEL_TITLE_ROOM) + 2.0 * GAP;
    let mut figure = Figure::new(4.0 * SIDE + 3.0 * GAP + BAR, height, TITLE);
    let cells = figure.body.inset(0.0, 0.0, BAR, 0.0).grid([3, 4], [GAP; 2]);
    let whole = study.edges.mean(Part::Whole);
    let shading = Shading::signed_covering(&luminance(&whole), COVERED);
    let space = figure.panel(cells[0], "the image I, turned by θ");
    let place = figure.canvas.picture(&radiance(&study.image, study.side), space);
    turn(&mut figure, study, place);
    let wholes = [
        ("warped area", study.warped.mean(Part::Whole)),
        ("finite differences", study.differences.mean(Part::Whole)),
        ("edge sampling", whole),
    ];
    for ((name, pixels), cell) in wholes.iter().zip(&cells[1..]) {
        let space = figure.panel(*cell, &format!("∂_{{θ}}I: {name}"));
        gradient(&mut figure.canvas, pixels, study.side, &shading, space);
    }
    bar(&mut figure, cells[3], &shading, "∂_{θ}I (1/rad)");
    let indirect = |method: &Parts| blocks(&method.mean(Part::Indirect), study.side);
    let faint = Shading::signed_covering(&luminance(&indirect(&study.edges)), COVERED);
    let methods: [(&str, &Parts, &str); 2] =
        [("warped area", &study.warped, "only (h)"), ("edge sampling", &study.edges, "only (l)")];
    for ((by, method, label), row) in methods.into_iter().zip(cells[4..].chunks(4)) {
        for (part, cell) in Part::ALL.into_iter().skip(1).zip(row) {
            let [name, _] = part.names();
            let title = if part == Part::Interior { format!("{by}: {name}") } else { name.to_owned() };
            let space = figure.panel(*cell, &title);
            if part == Part::Indirect {
                gradient(&mut figure.canvas, &indirect(method), study.side / BLOCK, &faint, space);
            } else {
                gradient(&mut figure.canvas, &method.mean(part), study.side, &shading, space);
            }
        }
        bar(&mut figure, row[3], &faint, label);
    }
    figure.canvas
}

/// The mean over every block of pixels.
fn blocks(pixels: &[DVec3], side: usize) -> Vec<DVec3> {
    let across = side / BLOCK;
    let mut means = vec![DVec3::ZERO; across * across];
    for (i, pixel) in pixels.iter().enumerate() {
        let [x, y] = [i % side / BLOCK, i / side / BLOCK];
        if x < across && y < across {
            means[y * across + x] += *pixel / (BLOCK * BLOCK) as f64;
        }
    }
    means
}

fn bar(figure: &mut Figure, beside: Rect, shading: &Shading, label: &str) {
    let at = Rect::new(beside.right() + 8.0, beside.y + PANEL_TITLE_ROOM + 8.0, 9.0, SIDE - 10.0);
    figure.canvas.color_bar(at, shading, label);
}

/// An arrow along the rotation, above the floor in front of the bunny.
fn turn(figure: &mut Figure, study: &Study, place: Rect) {
    let at = |angle: f64| {
        let around = DVec3::new(angle.sin(), 0.0, angle.cos());
        on_film(&study.scene, place, 0.62 * around + 0.02 * DVec3::Y)
    };
    draw_turn(&mut figure.canvas, at, [-0.7, 0.5, 0.4, 0.7], [4.0, 2.2]);
}
