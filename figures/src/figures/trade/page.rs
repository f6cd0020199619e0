//! The two pictures of the target.

use glam::DVec2;

use super::bias::{BOUND, Curve, GammaPoint, RAYS_OF_GAMMA, RAYS_OF_KAPPA};
use super::debias::{RAYS, Scheme, name};
use super::front::{Contender, Line, TIMES, front};
use super::target::{Ask, KAPPA, SIDE, Target, VERTICES};
use crate::plot::{
    Align, Axes, Axis, Color, Figure, GUTTER, Height, Legend, Marker, Palette, Pen, Rect, Shading, Style,
    TextStyle, number,
};

/// How far a bias must stand out of its noise to be drawn on a log axis, in standard errors.
const VISIBLE: f64 = 2.0;

/// Picture 1: the scene, and bias against N', κ and γ.
pub(super) fn bias_page(target: &Target, rays: &[Curve], kappa: &[Curve], gamma: &[GammaPoint]) -> Figure {
    let title = "The bias of a fixed number of auxiliary rays N′, and what decides it";
    let mut figure = Figure::new(960.0, 600.0, title, "");
    let rows = figure.body.rows(&[1.0, 0.92], GUTTER);
    let top = rows[0].columns(&[0.27, 0.73], GUTTER);
    let space = figure.panel(top[0], 0, "The scene: ∂_{θ}I of 4 × 4 pixels");
    draw_scene(&mut figure, target, space);
    figure.plot(top[1], 1, "Bias against the number of auxiliary rays", &rays_axes(rays));
    let bottom = rows[1].columns(&[1.0, 1.0, 1.0], GUTTER);
    figure.plot(bottom[0], 2, &format!("Bias against κ, N′ = {RAYS_OF_KAPPA}"), &kappa_axes(kappa));
    figure.plot(
        bottom[1],
        3,
        "Bias against γ (linear B)",
        &gamma_axes(gamma, "missing part of the gradient", |p| p.bias.missing, |p| p.bias.error)
            .legend(Legend::BottomLeft),
    );
    figure.plot(
        bottom[2],
        4,
        "Variance against γ (linear B)",
        &gamma_axes(gamma, "relative variance of one sample", |p| p.spread.variance, |_| 0.0)
            .legend(Legend::BottomRight),
    );
    figure
}

/// The exact gradient image under the quadrilateral and the velocities of its corners.
fn draw_scene(figure: &mut Figure, target: &Target, space: Rect) {
    let shading = Shading::signed_covering(&target.exact, 1.0);
    let canvas = &mut figure.canvas;
    let picture = canvas.field((SIDE, SIDE), &target.exact, &shading, "", space);
    let scale = picture.width / SIDE as f64;
    let page = |p: DVec2| DVec2::new(picture.x, picture.y) + scale * p;
    let corners: Vec<DVec2> = target.scene.vertices().iter().map(|&p| page(p)).collect();
    canvas.stroke_polygon(&[corners.as_slice()], &Pen::new(Color::INK, 1.5));
    let Ask::Pixels { velocities, .. } = &target.ask else { return };
    for (corner, velocity) in corners.iter().zip(velocities) {
        canvas.arrow(*corner, *corner + 0.42 * scale * *velocity, &Pen::new(Color::INK, 1.3));
    }
    // The auxiliary kernel, its width as radius, around one point.
    let at = page(DVec2::new(2.95, 2.0));
    let radius = scale / KAPPA.sqrt();
    canvas.circle(at, radius, &Pen::new(Palette::ORANGE, 1.6));
    let style = TextStyle::new(10.0, Palette::ORANGE.mix(Color::INK, 0.3)).halo(Color::WHITE);
    let beside = at - DVec2::new(radius + 4.0, 0.0);
    canvas.text("kernel", beside, &style.anchored(Align::Right, Height::Middle));
}

fn rays_axes(curves: &[Curve]) -> Axes {
    let ticks = [1, 2, 4, 8, 16, 32, 64, 128, 256].map(|n| (f64::from(n), n.to_string()));
    let x = Axis::log("auxiliary rays N′").ticks(ticks).limits(0.9, 285.0);
    let y = Axis::log("missing part of the gradient, 1 − slope").limits(3e-3, 1.0);
    let mut axes = Axes::new(x, y).legend(Legend::Outside);
    for curve in curves {
        let label = curve.rate().map_or_else(
            || curve.series.name.to_owned(),
            |rate| {
                format!("{}: N′^{{{:.2} ± {:.2}}}", curve.series.name, rate.exponent, rate.error)
                    .replace("^{-", "^{−")
            },
        );
        let style = Style::new(curve.series.color).marker(curve.series.marker);
        let visible = curve.points.iter().filter(|(_, b)| b.missing > VISIBLE * b.error);
        let points: Vec<[f64; 4]> = visible
            .map(|(n, b)| [*n, b.missing, (b.missing - b.error).max(1e-9), b.missing + b.error])
            .collect();
        axes.error_bars(points.clone(), &Style::new(curve.series.color));
        axes.line(points.iter().map(|p| [p[0], p[1]]), &style.labelled(label));
    }
    let guide: Vec<[f64; 2]> = [24.0, 256.0].map(|n| [n, 3.2 / n]).to_vec();
    axes.line(guide, &Style::new(Color::MUTED).dotted().labelled("slope −1"));
    axes
}

fn kappa_axes(curves: &[Curve]) -> Axes {
    let y = Axis::linear("missing part of the gradient");
    let mut axes = Axes::new(Axis::log("κ (1/pixel²)"), y).legend(Legend::TopRight);
    axes.horizontal(0.0, "", &Style::new(Color::MUTED).width(1.0));
    for curve in curves {
        let style = Style::new(curve.series.color).marker(curve.series.marker);
        let bars =
            curve.points.iter().map(|(k, b)| [*k, b.missing, b.missing - b.error, b.missing + b.error]);
        axes.error_bars(bars, &Style::new(curve.series.color));
        let line = curve.points.iter().map(|(k, b)| [*k, b.missing]);
        axes.line(line, &style.labelled(curve.series.name));
    }
    axes
}

fn gamma_axes(
    points: &[GammaPoint],
    label: &str,
    value: impl Fn(&GammaPoint) -> f64,
    error: impl Fn(&GammaPoint) -> f64,
) -> Axes {
    let ticks = [0.5, 1.0, 1.5, 2.0, 3.0, 4.0, 6.0].map(|g| (g, number(g)));
    let x = Axis::log("exponent γ").ticks(ticks).limits(0.46, 6.5);
    let mut axes = Axes::new(x, Axis::log(label));
    axes.vertical(BOUND, "", &Style::new(Color::MUTED).dashed().labelled(format!("bound γ = {BOUND}")));
    let looks =
        [(Palette::SKY, Marker::Circle), (Palette::BLUE, Marker::Square), (Color::INK, Marker::Diamond)];
    for (rays, (color, marker)) in RAYS_OF_GAMMA.into_iter().zip(looks) {
        let mine: Vec<&GammaPoint> =
            points.iter().filter(|p| p.rays == rays && value(p) > VISIBLE * error(p)).collect();
        let bars = mine.iter().map(|p| {
            let (v, e) = (value(p), error(p));
            [p.gamma, v, v - e, v + e]
        });
        axes.error_bars(bars, &Style::new(color));
        let style = Style::new(color).marker(marker).labelled(format!("N′ = {rays}"));
        axes.line(mine.iter().map(|p| [p.gamma, value(p)]), &style);
    }
    axes
}

/// Picture 2: what debiasing costs, and the fronts.
pub(super) fn trade_page(schemes: &[Scheme], forward: &[Contender], reverse: &[Contender]) -> Figure {
    let title = "The price of no bias, and the error of every method at equal time";
    let mut figure = Figure::new(960.0, 700.0, title, "");
    let rows = figure.body.rows(&[0.72, 1.0], GUTTER);
    let heading = format!("Variance × rays of a sample, relative to {RAYS} rays of the original’s weight");
    let space = figure.panel(rows[0], 0, &heading);
    draw_schemes(&mut figure, schemes, space);
    let columns = rows[1].columns(&[1.0, 1.47], GUTTER);
    figure.plot(
        columns[0],
        1,
        "One parameter: its gradient image",
        &front_axes(forward).legend(Legend::None),
    );
    let heading = format!("{} parameters: all coordinates of a star, reverse mode", 2 * VERTICES);
    figure.plot(columns[1], 2, &heading, &front_axes(reverse).legend(Legend::Outside));
    figure
}

/// The colour of a weight.
fn weight_color(scheme: &Scheme) -> Color {
    if scheme.original { Palette::BLUE } else { Palette::VERMILION }
}

/// Rows of means with error bars, and medians over batches, with the numbers beside them.
fn draw_schemes(figure: &mut Figure, schemes: &[Scheme], space: Rect) {
    let space = space.inset(190.0, 0.0, 245.0, 0.0);
    let row = |index: usize| (schemes.len() - 1 - index) as f64;
    let reference = |original: bool| schemes.iter().find(|s| s.original == original);
    let (Some(one), Some(own)) = (reference(true), reference(false)) else { return };
    let ticks = [0.5, 1.0, 2.0, 5.0, 10.0, 20.0, 50.0, 100.0, 200.0].map(|v| (v, number(v)));
    let none: [(f64, String); 0] = [];
    let y = Axis::linear("").ticks(none).limits(-0.6, schemes.len() as f64 - 0.4);
    let mut axes = Axes::new(Axis::log("times as many rays for the same noise").ticks(ticks), y);
    axes = axes.legend(Legend::TopRight);
    for (scheme, color) in [(one, Palette::BLUE), (own, Palette::VERMILION)] {
        axes.vertical(scheme.relative(one).value, "", &Style::new(color).width(1.0).dashed());
    }
    for (index, scheme) in schemes.iter().enumerate() {
        let style = Style::new(weight_color(scheme));
        let ratio = scheme.relative(one);
        let ends = [(ratio.value - ratio.error).max(0.5 * ratio.value), ratio.value + ratio.error];
        axes.line(ends.map(|x| [x, row(index)]), &style);
        let mean = style.clone().marker(Marker::Circle).radius(4.0);
        axes.scatter([[ratio.value, row(index)]], &mean);
        let median = style.marker(Marker::Ring).radius(4.0);
        axes.scatter([[scheme.median() / one.cost().value, row(index)]], &median);
    }
    let sample = Style::new(Color::MUTED).radius(4.0);
    axes.scatter([], &sample.clone().marker(Marker::Circle).labelled("mean ± standard error"));
    axes.scatter([], &sample.marker(Marker::Ring).labelled("median of the batches"));
    let placed = axes.draw(&mut figure.canvas, space);
    let right = placed.frame.right();
    let heading = TextStyle::new(10.0, Color::MUTED).anchored(Align::Left, Height::Baseline);
    let above = placed.frame.y - 4.0;
    figure.canvas.text("against the original’s", DVec2::new(right + 12.0, above), &heading);
    figure.canvas.text("against the same weight", DVec2::new(right + 132.0, above), &heading);
    for (index, scheme) in schemes.iter().enumerate() {
        let Some(at) = placed.at([placed.x.low(), row(index)]) else { continue };
        let color = weight_color(scheme).mix(Color::INK, 0.25);
        let style = TextStyle::new(10.5, color).anchored(Align::Right, Height::Middle);
        figure.canvas.text(&name(scheme.debias), at - DVec2::new(10.0, 0.0), &style);
        let style = style.anchored(Align::Left, Height::Middle);
        let same = if scheme.original { one } else { own };
        for (base, x) in [(one, 12.0), (same, 132.0)] {
            let text =
                if std::ptr::eq(base, scheme) { "1".to_owned() } else { scheme.relative(base).shown() };
            figure.canvas.text(&text, DVec2::new(right + x, at.y), &style);
        }
    }
}

fn front_axes(contenders: &[Contender]) -> Axes {
    let x = Axis::log("time per pixel on one core (s)").limits(TIMES.0, TIMES.1);
    let y = Axis::log("relative RMS error of the gradient").limits(1e-3, 30.0);
    let mut axes = Axes::new(x, y);
    let best: Vec<[f64; 2]> = front(contenders).iter().map(|(t, e, _)| [*t, *e]).collect();
    axes.line(best, &Style::new(Palette::OCHRE.alpha(0.5)).width(8.0).labelled("best without edges"));
    for contender in contenders {
        let looks = &contender.looks;
        let style = Style::new(looks.color).labelled(looks.name.clone());
        let style = match looks.line {
            Line::Solid => style,
            Line::Dashed => style.dashed(),
            Line::Dotted => style.dotted(),
        };
        axes.line(contender.curve(), &style);
    }
    axes
}
