//! The picture.

use flatland::plane::Image;
use glam::DVec2;

use super::measure::{BLOCK, View, channel};
use crate::figures::common::draw_turn;
use crate::plot::*;
use crate::space::picture::LUMINANCE;

/// Side of a picture on the page.
const SIDE: f64 = 216.0;
const GAP: f64 = 14.0;
/// Darkness of a black primal printed under a gradient.
const PRINT: f64 = 0.2;
/// Largest |z| shown.
const REACH: f64 = 6.0;

/// The whole drawing, the moving part, and the agreement of warped area with the exact gradient there.
pub(super) fn page(whole: &View, part: &View, centre: DVec2, radius: f64) -> Canvas {
    let title = "A drawing whose shield turns: the gradient image, exact and estimated";
    let height = 3.0 * (SIDE + PANEL_TITLE_ROOM) + 2.0 * GAP + 24.0;
    let mut figure = Figure::new(4.0 * SIDE + 3.0 * GAP + 64.0, height, title);
    let cells = figure.body.inset(0.0, 0.0, 64.0, 24.0).grid([3, 4], [GAP; 2]);
    for (row, view) in [whole, part].into_iter().enumerate() {
        let exact = channel(&view.exact);
        let shading = Shading::signed_covering(&exact, 0.97);
        let pictures = [
            ("Exact gradient".to_owned(), &exact),
            (format!("Warped area, {} spp", view.warped.samples), &view.warped.mean),
            (format!("Finite differences, {} spp", view.differences.samples), &view.differences.mean),
        ];
        let cells = &cells[4 * row..][..4];
        let space = figure.panel(cells[0], ["Primal", "The shield"][row]);
        let mut places = vec![figure.canvas.picture(&colors(&view.primal), space)];
        for ((name, values), cell) in pictures.iter().zip(&cells[1..]) {
            let raster = match row {
                0 => over_primal(&view.primal, &shading, values),
                _ => shading.raster(view.size().0, values),
            };
            let space = figure.panel(*cell, name);
            places.push(figure.canvas.picture(&raster, space));
        }
        if row == 0 {
            places.iter().for_each(|place| frame_part(&mut figure.canvas, whole, part, *place));
            turn(&mut figure.canvas, whole, places[0], centre, radius);
        }
        let bar = Rect::new(cells[3].right() + 8.0, cells[3].y + PANEL_TITLE_ROOM, 9.0, SIDE);
        figure.canvas.color_bar(bar, &shading, "∂_{θ}I (1/rad)");
    }
    agreement(&mut figure, part, &cells[8..]);
    figure.canvas
}

fn colors(image: &Image) -> Raster {
    Raster::from_fn(image.width(), image.height(), |x, y| image.pixel(x, y).as_vec3().to_array())
}

/// A gradient over a pale print of the primal, which shows its place in the drawing.
fn over_primal(primal: &Image, shading: &Shading, gradient: &[f64]) -> Raster {
    Raster::from_fn(primal.width(), primal.height(), |x, y| {
        let luminance = primal.pixel(x, y).dot(LUMINANCE);
        let pale = 1.0 - PRINT * (1.0 - luminance);
        shading.color(gradient[y * primal.width() + x]).rgb.map(|channel| (f64::from(channel) * pale) as f32)
    })
}

/// Position of a scene point on a picture of the view.
fn on(view: &View, rect: Rect, point: DVec2) -> DVec2 {
    let scale = rect.width / (view.film.width() as f64 * view.film.pixel());
    DVec2::new(rect.x, rect.y) + scale * (point - view.film.corner())
}

/// The second film's frame on a picture of the first.
fn frame_part(canvas: &mut Canvas, whole: &View, part: &View, rect: Rect) {
    let low = on(whole, rect, part.film.corner());
    let (width, height) = part.size();
    let side = part.film.pixel() * DVec2::new(width as f64, height as f64);
    let high = on(whole, rect, part.film.corner() + side);
    let frame = Rect::new(low.x, low.y, high.x - low.x, high.y - low.y);
    canvas.frame(frame, &Pen::new(Color::INK, 0.8));
}

/// An arrow along the rotation.
fn turn(canvas: &mut Canvas, view: &View, rect: Rect, centre: DVec2, radius: f64) {
    let at = |angle: f64| on(view, rect, centre + 1.3 * radius * DVec2::from_angle(angle));
    draw_turn(canvas, at, [-1.0, 0.5, 0.45, 0.8], [4.0, 2.2]);
}

/// Standard error, z-scores and their distribution.
fn agreement(figure: &mut Figure, part: &View, cells: &[Rect]) {
    let errors = &part.warped.standard_error;
    let highest = errors.iter().fold(0.0_f64, |a, b| a.max(*b));
    let ratio = "(warped − exact)/standard error";
    for ((title, values, shading), cell) in [
        ("Standard error", errors, Shading::log(1e-3 * highest, highest)),
        (ratio, &part.warped.z[0], Shading::signed(4.0)),
    ]
    .into_iter()
    .zip(cells)
    {
        let space = figure.panel(*cell, title);
        let rect = figure.canvas.picture(&shading.raster(part.size().0, values), space);
        let bar = Rect::new(rect.x + 26.0, rect.bottom() + 8.0, rect.width - 52.0, 7.0);
        figure.canvas.color_bar(bar, &shading, "");
    }
    let wide = Rect { width: 2.0 * SIDE + GAP + 50.0, height: cells[2].height + 24.0, ..cells[2] };
    let x = Axis::linear(ratio).limits(-REACH, REACH);
    let mut axes = Axes::new(x, Axis::log("density").limits(2e-4, 1.0));
    let [pixels, blocks] = &part.warped.z;
    axes.steps(density(pixels, 0.25), &Style::new(Palette::SKY).labelled("pixels"));
    let style = Style::new(Palette::VERMILION).labelled(format!("blocks of {BLOCK} × {BLOCK}"));
    axes.steps(density(blocks, 0.5), &style);
    let normal = (-60..=60).map(|i| {
        let x = f64::from(i) * 0.1;
        [x, (-0.5 * x * x).exp() / std::f64::consts::TAU.sqrt()]
    });
    axes.line(normal, &Style::new(Color::INK).dashed().labelled("normal"));
    figure.plot(wide, "Is it noise? The distribution of those ratios", &axes);
}

/// A histogram of unit area; values beyond the reach count in the total.
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
