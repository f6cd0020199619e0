//! The picture.

use flatland::sdf::exact::Silhouette;
use flatland::sdf::fields::BangaruField;
use flatland::warp::Circle as Directions;
use glam::DVec2;

use super::ablation::Setting;
use super::world::{Curve, REACH, World};
use crate::plot::*;

/// Angular distance from a silhouette of the rays drawn beside it, in radians.
const BESIDE: f64 = 0.012;

/// Measurements to be drawn.
pub(super) struct Shown<'a> {
    pub(super) world: &'a World,
    pub(super) silhouettes: &'a [Silhouette],
    pub(super) curves: &'a [Curve],
    pub(super) gammas: &'a [Setting],
    pub(super) lambdas: &'a [Setting],
}

pub(super) fn page(shown: &Shown<'_>) -> Canvas {
    let title = "Warp fields from the points of sphere tracing";
    let mut figure = Figure::new(960.0, 700.0, title);
    let rows = figure.body.rows(&[1.0, 1.0], GUTTER);
    let top = rows[0].columns(&[0.46, 0.54], GUTTER);
    let space = figure.panel(top[0], "Tracer points and their weights");
    draw_world(&mut figure.canvas, shown, space);
    figure.plot(top[1], "Every field against direction", &field_axes(shown));
    let bottom = rows[1].columns(&[1.0, 1.0], GUTTER);
    let colors = [Palette::GREY, Palette::ORANGE, Palette::SKY, Palette::BLUE, Palette::PURPLE];
    let axes = bias_axes(shown.gammas, &colors);
    figure.plot(bottom[0], "Error of V at the last hits, by γ (λ = 0.1)", &axes);
    let colors = [Palette::SKY, Palette::BLUE, Color::INK, Palette::VERMILION, Palette::OCHRE];
    figure.plot(bottom[1], "The same by λ (γ = 3), and by ε", &bias_axes(shown.lambdas, &colors));
    figure.canvas
}

/// The discs, four rays with their points, and the scale of weights.
fn draw_world(canvas: &mut Canvas, shown: &Shown<'_>, space: Rect) {
    let (space, scale) = (space.inset(0.0, 0.0, 0.0, 40.0), space);
    let view = View::upward(DVec2::new(-0.15, -1.25), DVec2::new(5.0, 1.65), space);
    let world = shown.world;
    for disc in &world.discs {
        let (centre, radius) = (view.at(disc.centre()), view.vector(disc.radius() * DVec2::X).x);
        canvas.disc(centre, radius, Palette::GREY.tint(0.72));
        canvas.circle(centre, radius, &Pen::new(Color::MUTED, 1.2));
    }
    for (disc, parameters) in world.discs.iter().zip(world.direction.chunks(3)) {
        let from = view.at(disc.centre());
        let motion = view.vector(0.45 * DVec2::new(parameters[0], parameters[1]));
        canvas.arrow(from, from + motion, &Pen::new(Palette::VERMILION, 1.8));
    }
    for angle in rays(shown.silhouettes) {
        draw_ray(canvas, world, &view, angle);
    }
    let eye = view.at(DVec2::ZERO);
    canvas.marker(Marker::Diamond, eye, 5.0, Color::INK);
    let style = TextStyle::new(10.5, Color::INK).anchored(Align::Left, Height::Top);
    canvas.text("eye", eye + DVec2::new(-3.0, 8.0), &style);
    draw_scale(canvas, scale);
}

/// Just outside the near disc below, just inside it above, onto the far disc, just past it.
fn rays(silhouettes: &[Silhouette]) -> Vec<f64> {
    let (Some(first), Some(last)) = (silhouettes.first(), silhouettes.last()) else { return vec![] };
    let middle = 0.5 * (first.angle + last.angle);
    vec![first.angle - BESIDE, first.angle + 4.0 * BESIDE, middle + 0.1, last.angle + BESIDE]
}

fn draw_ray(canvas: &mut Canvas, world: &World, view: &View, angle: f64) {
    let (eyes, omega) = (world.scene.view(), DVec2::from_angle(angle));
    let trace = eyes.trace(omega);
    let weights = BangaruField::default().weights::<Directions>(&eyes, &trace);
    let largest = weights.iter().copied().fold(0.0, f64::max);
    let colors = Shading::sequential(0.0, 1.0);
    let end = trace.hit().map_or(4.9 / omega.x, |hit| hit.t);
    canvas.line(view.at(DVec2::ZERO), view.at(end * omega), &Pen::new(Color::SPINE, 0.8));
    let mut drawn: Vec<(f64, DVec2)> =
        trace.points.iter().skip(1).zip(weights).map(|(p, w)| (w / largest, p.position)).collect();
    // The heaviest are drawn on top.
    drawn.sort_by(|a, b| a.0.total_cmp(&b.0));
    for (relative, position) in drawn.into_iter().filter(|(_, p)| p.x < 4.9) {
        canvas.disc(view.at(position), 2.2 + 2.3 * shade(relative), colors.color(shade(relative)));
    }
}

/// Decades of weight shown.
const DECADES: f64 = 4.0;

/// The weight on a log scale in [0, 1].
fn shade(relative: f64) -> f64 {
    (1.0 + relative.log10() / DECADES).clamp(0.0, 1.0)
}

fn draw_scale(canvas: &mut Canvas, space: Rect) {
    let (left, y) = (space.x + 0.34 * space.width, space.bottom() - 18.0);
    for i in 0..=4 {
        let t = f64::from(i) / 4.0;
        let at = DVec2::new(left + t * 0.5 * space.width, y);
        canvas.disc(at, 2.2 + 2.3 * t, Shading::sequential(0.0, 1.0).color(t));
        let label = if i == 4 { "1".to_owned() } else { format!("10^{{−{}}}", 4 - i) };
        let style = TextStyle::new(10.0, Color::MUTED).anchored(Align::Centre, Height::Top);
        canvas.text(&label, at + DVec2::new(0.0, 7.0), &style);
    }
    let style = TextStyle::new(10.0, Color::MUTED).anchored(Align::Right, Height::Middle);
    canvas.text("weight / largest of its ray", DVec2::new(left - 14.0, y), &style);
}

fn field_axes(shown: &Shown<'_>) -> Axes {
    let degrees = |angle: f64| angle.to_degrees();
    let limit = degrees(REACH);
    let values = shown.curves.iter().flat_map(|c| &c.values).map(|v| v[1]);
    let (low, high) = values.fold((0.0_f64, 0.0_f64), |(l, h), v| (l.min(v), h.max(v)));
    let pad = 0.06 * (high - low);
    let y = Axis::linear("V (radians per unit of θ)").limits(low - pad, high + pad);
    let mut axes = Axes::new(Axis::linear("direction α (degrees)").limits(-limit, limit), y);
    axes = axes.legend(Legend::Outside);
    let looks = [Palette::GREY, Palette::GREEN, Palette::BLUE, Palette::VERMILION, Color::INK];
    for (curve, color) in shown.curves.iter().zip(looks) {
        let style = Style::new(color).labelled(curve.name).width(1.6);
        let style = if color == Color::INK { style.dashed() } else { style };
        axes.line(curve.values.iter().map(|[a, v]| [degrees(*a), *v]), &style);
    }
    let exact = Style::new(Color::INK).marker(Marker::Circle).radius(4.5).labelled("silhouette (exact)");
    axes.scatter(shown.silhouettes.iter().map(|s| [degrees(s.angle), s.rate]), &exact);
    axes
}

fn bias_axes(settings: &[Setting], colors: &[Color]) -> Axes {
    let x = settings.iter().flat_map(|s| &s.points).map(|p| p[0]);
    let (low, high) = x.fold((f64::INFINITY, 0.0_f64), |(l, h), v| (l.min(v), h.max(v)));
    let ticks: Vec<(f64, String)> = settings
        .first()
        .map(|s| s.points.iter().step_by(2).map(|p| (p[0], number(p[0]))).collect())
        .unwrap_or_default();
    let x = Axis::log("steps a ray may take").ticks(ticks).limits(0.9 * low, 1.1 * high);
    let mut axes = Axes::new(x, Axis::log("Σ|V − v| / Σ|v|")).legend(Legend::BottomLeft);
    for (setting, color) in settings.iter().zip(colors) {
        let style = Style::new(*color).labelled(setting.name.clone()).marker(Marker::Circle).radius(3.0);
        axes.line(setting.points.iter().copied(), &style);
    }
    axes
}
