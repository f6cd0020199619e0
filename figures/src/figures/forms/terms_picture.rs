//! The picture of the exact terms: both theorems, pixel by pixel.

use flatland::plane::Film;
use flatland::plane::exact::Arrangement;
use glam::DVec2;

use super::super::common::{display, largest, picture};
use super::Results;
use super::exact::{difference, sum};
use super::scene::{Example, SIDE};
use crate::plot::*;

const CELL: f64 = 224.0;
const ROW: f64 = 207.0;
const HEADING: f64 = 25.0;

/// Contents of the scene panels.
pub(super) struct Setting<'a> {
    pub(super) example: &'a Example,
    pub(super) arrangement: &'a Arrangement<'a>,
    pub(super) film: &'a Film,
}

enum Content {
    Image,
    Field,
    Values(Vec<f64>, Shading),
}

/// Draws twelve panels: Reynolds, divergence, and divergence with a box filter.
pub(super) fn draw(setting: &Setting<'_>, results: &Results) -> Canvas {
    let size = DVec2::new(4.0 * CELL + 3.0 * GUTTER, 3.0 * (ROW + HEADING) + 2.0 * GUTTER);
    let mut figure = Figure::new(size.x, size.y, "One derivative, written in two ways, pixel by pixel");
    let headings = [
        "Reynolds transport theorem, tent filter:  dI/dθ = interior term + edge integral",
        "Divergence theorem:  the edge integral is the area integral of ∇·(V h f), for a V that is continuous and \
         boundary consistent",
        "The same for a box filter:  h jumps on the pixel's fixed edge, so the flux of V f through it is subtracted",
    ];
    let rows = figure.body.rows(&[1.0; 3], GUTTER);
    let mut cells = vec![];
    for (row, heading) in rows.into_iter().zip(headings) {
        let (strip, rest) = row.split_top(HEADING);
        let style = TextStyle::new(12.0, Palette::BLUE).bold().anchored(Align::Left, Height::Top);
        figure.canvas.text(heading, DVec2::new(strip.x, strip.y + 1.0), &style);
        cells.extend(rest.columns(&[1.0; 4], GUTTER));
    }
    for ((title, content), cell) in panels(results).into_iter().zip(cells) {
        let space = figure.panel(cell, &title);
        match content {
            Content::Image => image_panel(&mut figure.canvas, setting, space),
            Content::Field => field_panel(&mut figure.canvas, setting, space),
            Content::Values(values, shading) => {
                figure.canvas.field(SIDE, &values, &shading, space);
            }
        }
    }
    figure.canvas
}

/// The titles and contents, row by row.
fn panels(results: &Results) -> Vec<(String, Content)> {
    let Results { tent, boxed, central, .. } = results;
    let common = Shading::signed_covering(&tent.total, 0.985);
    let term = |title: &str, values: &[f64]| (title.to_owned(), Content::Values(values.to_vec(), common));
    let residual = |title: &str, values: Vec<f64>| {
        let size = largest(&values);
        (format!("{title}, up to {}", number(size)), Content::Values(values, Shading::signed(size)))
    };
    let area_alone = sum(&boxed.area, &boxed.flux);
    vec![
        ("image I, and how the scene moves".to_owned(), Content::Image),
        term("dI/dθ = (c) + (d)", &tent.total),
        term("interior term ∫ h ∂f/∂θ du", &tent.interior),
        term("edge integral ∮ h Δf (v·n) dl", &tent.edge),
        ("a field V that obeys both rules".to_owned(), Content::Field),
        term("area integral ∫ ∇·(V h f) du", &tent.area),
        residual("(f) − (d)", difference(&tent.area, &tent.edge)),
        residual("differences − (b)", difference(central, &tent.total)),
        term("edge integral, box filter", &boxed.edge),
        term("area integral over the pixel", &area_alone),
        term("flux ∮ f (V·n) dl through its edge", &boxed.flux),
        residual("(j) − (k) − (i)", difference(&boxed.area, &boxed.edge)),
    ]
}

/// The space of a field's picture of this size, so that all pictures of a row line up.
fn picture_space(space: Rect) -> Rect {
    let (_, below) = space.split_top(15.0);
    let side = below.height.min(space.width) - 1.0;
    Rect::new(space.x, below.y, side, side)
}

fn view(film: &Film, space: Rect) -> View {
    let low = film.corner();
    let size = film.pixel() * DVec2::new(film.width() as f64, film.height() as f64);
    View::downward(low, low + size, space)
}

fn image_panel(canvas: &mut Canvas, setting: &Setting<'_>, space: Rect) {
    let picture = picture(&setting.arrangement.primal(setting.film));
    let at = canvas.picture(&picture, picture_space(space));
    let view = view(setting.film, at);
    let (scene, velocities) = (&setting.example.scene, &setting.example.velocities);
    for (shape, [a, b]) in scene.edges() {
        let (p, q) = (scene.vertices()[a], scene.vertices()[b]);
        let steps = ((q - p).length() / 4.6).round().max(1.0) as usize;
        for i in 0..steps {
            let t = (i as f64 + 0.5) / steps as f64;
            let (u, v) = (p.lerp(q, t), velocities[a].lerp(velocities[b], t));
            if v != DVec2::ZERO && !scene.is_covered(u, shape) {
                let (from, to) = (view.at(u), view.at(u + 0.4 * v));
                canvas.arrow(from, to, &Pen::new(Color::INK, 1.0));
            }
        }
    }
}

fn field_panel(canvas: &mut Canvas, setting: &Setting<'_>, space: Rect) {
    let at = picture_space(space);
    let view = view(setting.film, at);
    let oracle = setting.arrangement.oracle(&setting.example.velocities);
    canvas.clipped(at, |canvas| {
        for (corners, shape) in setting.arrangement.faces() {
            let ring = corners.map(|corner| view.at(corner));
            let tone = |shape: usize| setting.example.scene.shapes()[shape].shade().value(corners[0]);
            canvas.fill_polygon(&[ring], shape.map_or(Color::WHITE, |shape| display(tone(shape)).tint(0.75)));
        }
        for (corners, _) in setting.arrangement.faces() {
            let pen = Pen::new(Color::SPINE.alpha(0.35), 0.4);
            canvas.stroke_polygon(&[corners.map(|corner| view.at(corner))], &pen);
        }
        for (ends, _) in setting.arrangement.silhouettes() {
            let [p, q] = ends.map(|end| view.at(end));
            canvas.line(p, q, &Pen::new(Color::INK, 1.0));
        }
        let count = 17;
        for i in 0..count * count {
            let place = DVec2::new((i % count) as f64, (i / count) as f64) + 0.5;
            let u = place * SIDE as f64 / count as f64;
            let v = oracle.at(u).value;
            canvas.arrow(view.at(u), view.at(u + 0.3 * v), &Pen::new(Palette::BLUE, 1.0));
        }
    });
    canvas.frame(at, &Pen::new(Color::SPINE, 0.5));
}
