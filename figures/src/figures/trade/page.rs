//! The two pictures of the target.

use glam::DVec2;

use super::bias::{BOUND, Curve, GammaPoint, RAYS_OF_GAMMA, RAYS_OF_KAPPA};
use super::debias::{RAYS, Scheme, name};
use super::front::{Contender, TIMES, front};
use super::target::{Ask, KAPPA, SIDE, Target, VERTICES};
use crate::plot::*;
use crate::ratio::Ratio;

/// Ratio of bias to its noise, in standard errors, from which it is drawn on a log axis.
const VISIBLE: f64 = 2.0;

/// Picture 1: the scene, and bias against N', κ and γ.
pub(super) fn bias_page(target: &Target, rays: &[Curve], kappa: &[Curve], gamma: &[GammaPoint]) -> Canvas {
    let title = "The bias of a fixed number of auxiliary rays N′, and what decides it";
    let mut figure = Figure::new(960.0, 600.0, title);
    let rows = figure.body.rows(&[1.0, 0.92], GUTTER);
    let top = rows[0].columns(&[0.27, 0.73], GUTTER);
    let space = figure.panel(top[0], "The scene: ∂_{θ}I of 4 × 4 pixels");
    draw_scene(&mut figure, target, space);
    figure.plot(top[1], "Bias against the number of auxiliary rays", &rays_axes(rays));
    let bottom = rows[1].columns(&[1.0, 1.0, 1.0], GUTTER);
    figure.plot(bottom[0], &format!("Bias against κ, N′ = {RAYS_OF_KAPPA}"), &kappa_axes(kappa));
    let axes = gamma_axes(gamma, "missing part of the gradient", |p| p.bias.missing);
    figure.plot(bottom[1], "Bias against γ (linear B)", &axes.legend(Legend::BottomLeft));
    let variance = |p: &GammaPoint| Ratio { value: p.spread.variance, error: 0.0 };
    let axes = gamma_axes(gamma, "relative variance of one sample", variance);
    figure.plot(bottom[2], "Variance against γ (linear B)", &axes.legend(Legend::BottomRight));
    figure.canvas
}

/// The exact gradient image under the quadrilateral and the velocities of its corners.
fn draw_scene(figure: &mut Figure, target: &Target, space: Rect) {
    let shading = Shading::signed_covering(&target.exact, 1.0);
    let canvas = &mut figure.canvas;
    let picture = canvas.field(SIDE, &target.exact, &shading, space);
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
                let exponent = format!("{:.2} ± {:.2}", rate.value, rate.error).replace('-', "−");
                format!("{}: N′^{{{exponent}}}", curve.series.name)
            },
        );
        let visible = curve.points.iter().filter(|(_, b)| b.missing.value > VISIBLE * b.missing.error);
        let points = visible.map(|(n, b)| b.at(*n));
        axes.measured(points, &Style::new(curve.series.color).marker(curve.series.marker).labelled(label));
    }
    let guide: Vec<[f64; 2]> = [24.0, 256.0].map(|n| [n, 3.2 / n]).to_vec();
    axes.line(guide, &Style::new(Color::MUTED).dotted().labelled("slope −1"));
    axes
}

fn kappa_axes(curves: &[Curve]) -> Axes {
    let mut axes = Axes::new(Axis::log("κ (1/pixel²)"), Axis::linear("missing part of the gradient"));
    axes.horizontal(0.0, &Style::new(Color::MUTED).width(1.0));
    for Curve { series, points } in curves {
        let style = Style::new(series.color).marker(series.marker).labelled(series.name);
        axes.measured(points.iter().map(|(k, b)| b.at(*k)), &style);
    }
    axes
}

fn gamma_axes(points: &[GammaPoint], label: &str, value: impl Fn(&GammaPoint) -> Ratio) -> Axes {
    let ticks = [0.5, 1.0, 1.5, 2.0, 3.0, 4.0, 6.0].map(|g| (g, number(g)));
    let x = Axis::log("exponent γ").ticks(ticks).limits(0.46, 6.5);
    let mut axes = Axes::new(x, Axis::log(label));
    axes.vertical(BOUND, &Style::new(Color::MUTED).dashed().labelled(format!("bound γ = {BOUND}")));
    let looks =
        [(Palette::SKY, Marker::Circle), (Palette::BLUE, Marker::Square), (Color::INK, Marker::Diamond)];
    for (rays, (color, marker)) in RAYS_OF_GAMMA.into_iter().zip(looks) {
        let mine = points.iter().filter(|p| p.rays == rays).map(|p| (p.gamma, value(p)));
        let visible = mine.filter(|(_, v)| v.value > VISIBLE * v.error);
        let bars = visible.map(|(gamma, v)| [gamma, v.value, v.ends()[0], v.ends()[1]]);
        axes.measured(bars, &Style::new(color).marker(marker).labelled(format!("N′ = {rays}")));
    }
    axes
}

/// Picture 2: the cost of debiasing, and the fronts.
pub(super) fn trade_page(schemes: &[Scheme], forward: &[Contender], reverse: &[Contender]) -> Canvas {
    let title = "The price of no bias, and the error of every method at equal time";
    let mut figure = Figure::new(960.0, 700.0, title);
    let rows = figure.body.rows(&[0.72, 1.0], GUTTER);
    let heading = format!("Variance × rays of a sample, relative to {RAYS} rays of the original’s weight");
    let space = figure.panel(rows[0], &heading);
    draw_schemes(&mut figure.canvas, schemes, space);
    let columns = rows[1].columns(&[1.0, 1.47], GUTTER);
    let axes = front_axes(forward).legend(Legend::None);
    figure.plot(columns[0], "One parameter: its gradient image", &axes);
    let heading = format!("{} parameters: all coordinates of a star, reverse mode", 2 * VERTICES);
    figure.plot(columns[1], &heading, &front_axes(reverse).legend(Legend::Outside));
    figure.canvas
}

/// Rows of means with error bars, and medians over batches, with the numbers beside them.
fn draw_schemes(canvas: &mut Canvas, schemes: &[Scheme], space: Rect) {
    let reference = |original: bool| schemes.iter().find(|s| s.original == original);
    let (Some(one), Some(own)) = (reference(true), reference(false)) else { return };
    let ticks = [0.5, 1.0, 2.0, 5.0, 10.0, 20.0, 50.0, 100.0, 200.0].map(|v| (v, number(v)));
    let color = |scheme: &Scheme| if scheme.original { Palette::BLUE } else { Palette::VERMILION };
    let names = schemes.iter().map(|scheme| (name(scheme.debias), color(scheme))).collect();
    let mut rows = Rows::new(Axis::log("times as many rays for the same noise").ticks(ticks), names);
    rows.axes = rows.axes.legend(Legend::TopRight);
    for scheme in [one, own] {
        let style = Style::new(color(scheme)).width(1.0).dashed();
        rows.axes.vertical(scheme.cost.over(one.cost).value, &style);
    }
    for (index, scheme) in schemes.iter().enumerate() {
        let ratio = scheme.cost.over(one.cost);
        let [low, high] = ratio.ends();
        rows.bar(index, [low.max(0.5 * ratio.value), high]);
        rows.mark(index, ratio.value, Marker::Circle);
        rows.mark(index, scheme.median / one.cost.value, Marker::Ring);
    }
    let sample = Style::new(Color::MUTED).radius(4.0);
    rows.axes.scatter([], &sample.clone().marker(Marker::Circle).labelled("mean ± standard error"));
    rows.axes.scatter([], &sample.marker(Marker::Ring).labelled("median of the batches"));
    let placed = rows.draw(canvas, space, 190.0, 245.0);
    let relative = |scheme: &Scheme, base: &Scheme| {
        let same = std::ptr::eq(base, scheme);
        let text = if same { "1".to_owned() } else { scheme.cost.over(base.cost).shown() };
        (text, color(scheme))
    };
    rows.column(canvas, &placed, (12.0, "against the original’s"), |row| relative(&schemes[row], one));
    rows.column(canvas, &placed, (132.0, "against the same weight"), |row| {
        relative(&schemes[row], if schemes[row].original { one } else { own })
    });
}

fn front_axes(contenders: &[Contender]) -> Axes {
    let x = Axis::log("time per pixel on one core (s)").limits(TIMES.0, TIMES.1);
    let y = Axis::log("relative RMS error of the gradient").limits(1e-3, 30.0);
    let mut axes = Axes::new(x, y);
    let best: Vec<[f64; 2]> = front(contenders).iter().map(|(t, e, _)| [*t, *e]).collect();
    axes.line(best, &Style::new(Palette::OCHRE.alpha(0.5)).width(8.0).labelled("best without edges"));
    for contender in contenders {
        // Methods with a bias have thin lines.
        let style = contender.style.clone().width(if contender.unbiased { 2.2 } else { 1.1 });
        axes.line(contender.curve(), &style.labelled(contender.name.as_str()));
    }
    axes
}
