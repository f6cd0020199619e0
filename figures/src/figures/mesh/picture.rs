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

const TITLE: &str = "A bunny that turns: the image, its derivative, and the terms of it";

/// Image and whole gradients above; below, the terms by warped area and by edge sampling. Indirect light is
/// faint, and shown if there are samples enough.
pub(super) fn draw(study: &Study, shows_indirect: bool) -> Canvas {
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
    let faint = Shading::signed_covering(&luminance(&study.edges.mean(Part::Indirect)), COVERED);
    let methods: [(&str, &Parts, &str); 2] =
        [("warped area", &study.warped, "only (h)"), ("edge sampling", &study.edges, "only (l)")];
    for ((by, method, label), row) in methods.into_iter().zip(cells[4..].chunks(4)) {
        for (part, cell) in Part::ALL.into_iter().skip(1).zip(row) {
            if part == Part::Indirect && !shows_indirect {
                continue;
            }
            let [name, _] = part.names();
            let title = if part == Part::Interior { format!("{by}: {name}") } else { name.to_owned() };
            let space = figure.panel(*cell, &title);
            let shading = if part == Part::Indirect { &faint } else { &shading };
            gradient(&mut figure.canvas, &method.mean(part), study.side, shading, space);
        }
        if shows_indirect {
            bar(&mut figure, row[3], &faint, label);
        }
    }
    figure.canvas
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
