//! The picture.

use flatland::plane::Image;
use glam::DVec2;

use super::measure::{BLOCK, View, channel};
use crate::figures::common::draw_turn;
use crate::plot::{
    Axes, Axis, Color, Figure, Filter, Legend, PANEL_TITLE_ROOM, Palette, Pen, Raster, Rect, Shading, Style,
};
use crate::space::picture::LUMINANCE;

/// Side of a picture on the page.
const SIDE: f64 = 216.0;
const GAP: f64 = 14.0;
/// How dark a black primal prints under a gradient.
const PRINT: f64 = 0.2;
/// Widest |z| shown.
const REACH: f64 = 6.0;

/// The whole drawing, the moving part, and how warped area agrees with the exact gradient there.
pub(super) fn page(whole: &View, part: &View, centre: DVec2, radius: f64) -> Figure {
    let title = "A drawing whose shield turns: the gradient image, exact and estimated";
    let height = 3.0 * (SIDE + PANEL_TITLE_ROOM) + 2.0 * GAP + 24.0;
    let mut figure = Figure::new(4.0 * SIDE + 3.0 * GAP + 64.0, height, title, "");
    let (x, y) = (figure.body.x, figure.body.y);
    let cell = |row: usize, column: usize| {
        let step = SIDE + PANEL_TITLE_ROOM + GAP;
        Rect::new(x + column as f64 * (SIDE + GAP), y + row as f64 * step, SIDE, SIDE + PANEL_TITLE_ROOM)
    };
    for (row, view) in [whole, part].into_iter().enumerate() {
        let exact = channel(&view.exact);
        let shading = Shading::signed_covering(&exact, 0.97);
        let names = [
            if row == 0 { "Primal" } else { "The shield" }.to_owned(),
            "Exact gradient".to_owned(),
            format!("Warped area, {} spp", view.warped.samples),
            format!("Finite differences, {} spp", view.differences.samples),
        ];
        let fields = [&exact, &view.warped.mean, &view.differences.mean];
        let (width, rows) = view.size();
        for (column, name) in names.iter().enumerate() {
            let place = cell(row, column);
            let space = figure.panel(place, 4 * row + column, name);
            let raster = match column.checked_sub(1) {
                None => colors(&view.primal),
                Some(field) if row == 0 => over_primal(&view.primal, &shading, fields[field]),
                Some(field) => shading.raster(width, rows, fields[field]),
            };
            let rect = figure.canvas.image_fit(&raster, space, Filter::Nearest);
            figure.canvas.frame(rect, &Pen::new(Color::SPINE, 0.5));
            if row == 0 {
                frame_part(&mut figure, whole, part, rect);
            }
            if row == 0 && column == 0 {
                turn(&mut figure, whole, rect, centre, radius);
            }
        }
        let last = cell(row, 3);
        let bar = Rect::new(last.right() + 8.0, last.y + PANEL_TITLE_ROOM, 9.0, SIDE);
        figure.canvas.vertical_color_bar(bar, &shading, "∂_{θ}I (1/rad)");
    }
    agreement(&mut figure, part, [0, 1, 2].map(|column| cell(2, column)));
    figure
}

fn colors(image: &Image) -> Raster {
    Raster::from_fn(image.width(), image.height(), |x, y| image.pixel(x, y).to_array())
}

/// A gradient over a pale print of the primal, so that its place in the drawing is seen.
fn over_primal(primal: &Image, shading: &Shading, gradient: &[f64]) -> Raster {
    Raster::from_fn(primal.width(), primal.height(), |x, y| {
        let luminance = primal.pixel(x, y).dot(LUMINANCE);
        let pale = 1.0 - PRINT * (1.0 - luminance);
        shading.color(gradient[y * primal.width() + x]).rgb.map(|channel| f64::from(channel) * pale)
    })
}

/// Where a point of the scene lies on a picture of the view.
fn on(view: &View, rect: Rect, point: DVec2) -> DVec2 {
    let scale = rect.width / (view.film.width() as f64 * view.film.pixel());
    DVec2::new(rect.x, rect.y) + scale * (point - view.film.corner())
}

/// The second film's frame on a picture of the first.
fn frame_part(figure: &mut Figure, whole: &View, part: &View, rect: Rect) {
    let low = on(whole, rect, part.film.corner());
    let (width, height) = part.size();
    let side = part.film.pixel() * DVec2::new(width as f64, height as f64);
    let high = on(whole, rect, part.film.corner() + side);
    let frame = Rect::new(low.x, low.y, high.x - low.x, high.y - low.y);
    figure.canvas.frame(frame, &Pen::new(Color::INK, 0.8));
}

/// An arrow along the turn.
fn turn(figure: &mut Figure, view: &View, rect: Rect, centre: DVec2, radius: f64) {
    let at = |angle: f64| on(view, rect, centre + 1.3 * radius * DVec2::from_angle(angle));
    draw_turn(&mut figure.canvas, at, [-1.0, 0.5, 0.45, 0.8], [4.0, 2.2]);
}

/// Standard error, z-scores and their distribution.
fn agreement(figure: &mut Figure, part: &View, [first, second, third]: [Rect; 3]) {
    let size = part.size();
    let space = figure.panel(first, 8, "Standard error");
    let highest = part.warped.standard_error.iter().fold(0.0_f64, |a, b| a.max(*b));
    let shading = Shading::log(1e-3 * highest, highest);
    let raster = shading.raster(size.0, size.1, &part.warped.standard_error);
    let rect = figure.canvas.image_fit(&raster, space, Filter::Nearest);
    figure.canvas.frame(rect, &Pen::new(Color::SPINE, 0.5));
    let bar = Rect::new(rect.x + 26.0, rect.bottom() + 8.0, rect.width - 52.0, 7.0);
    figure.canvas.horizontal_color_bar(bar, &shading, "");
    let space = figure.panel(second, 9, "(warped − exact)/standard error");
    let shading = Shading::signed(4.0);
    let z = part.warped.z(&part.exact);
    let raster = shading.raster(size.0, size.1, &z);
    let rect = figure.canvas.image_fit(&raster, space, Filter::Nearest);
    figure.canvas.frame(rect, &Pen::new(Color::SPINE, 0.5));
    let bar = Rect::new(rect.x + 26.0, rect.bottom() + 8.0, rect.width - 52.0, 7.0);
    figure.canvas.horizontal_color_bar(bar, &shading, "");
    let wide = Rect::new(third.x, third.y, 2.0 * SIDE + GAP + 50.0, third.height + 24.0);
    figure.plot(wide, 10, "Is it noise? The distribution of those ratios", &histogram(part, &z));
}

fn histogram(part: &View, z: &[f64]) -> Axes {
    let x = Axis::linear("(warped − exact)/standard error").limits(-REACH, REACH);
    let mut axes = Axes::new(x, Axis::log("density").limits(2e-4, 1.0)).legend(Legend::TopRight);
    let normal = (-60..=60).map(|i| {
        let x = f64::from(i) * 0.1;
        [x, (-0.5 * x * x).exp() / std::f64::consts::TAU.sqrt()]
    });
    let series = [
        ("pixels".to_owned(), density(z, 0.25), Palette::SKY),
        (
            format!("blocks of {BLOCK} × {BLOCK}"),
            density(&part.warped.block_z(&part.exact), 0.5),
            Palette::VERMILION,
        ),
    ];
    for (name, steps, color) in series {
        axes.steps(steps, &Style::new(color).labelled(name));
    }
    axes.line(normal, &Style::new(Color::INK).dashed().labelled("normal"));
    axes
}

/// A histogram of unit area; what lies beyond the reach counts in the total.
fn density(z: &[f64], width: f64) -> Vec<[f64; 2]> {
    let finite: Vec<f64> = z.iter().copied().filter(|z| z.is_finite()).collect();
    let bins = (2.0 * REACH / width) as usize;
    let mut counts = vec![0.0; bins + 1];
    for z in &finite {
        let bin = ((z + REACH) / width).floor();
        if bin >= 0.0 && bin < bins as f64 {
            counts[bin as usize] += 1.0 / (finite.len() as f64 * width);
        }
    }
    counts.iter().enumerate().map(|(i, c)| [-REACH + i as f64 * width, c.max(1e-9)]).collect()
}
