//! Pictures of the set-up and the variances, and of the cost in time.

use flatland::transport::Gloss;
use glam::DVec2;

use super::scene::{CENTRE, Lighting, OBJECT, PIXELS, Scene};
use super::study::{Place, Racer, Run, WIDTH_OF_PARTS};
use crate::figures::flat::{draw_camera, draw_motion, draw_world, label};
use crate::plot::*;

/// Lobes that are drawn, with their derivatives.
const SHOWN: [f64; 3] = [0.5, 0.1, 1e-3];

const VARIANCE: &str = "relative variance of a sample";
const COST: &str = "variance × microseconds";

fn shade(index: usize) -> Color {
    [Palette::SKY, Palette::BLUE, Color::INK][index]
}

/// All measurements except times.
pub(super) fn variance(widths: &[Place], vertices: &[Place]) -> anyhow::Result<Canvas> {
    let title = "An object seen in a glossy floor, from a wide lobe to a mirror";
    let mut figure = Figure::new(960.0, 610.0, title);
    let rows = figure.body.rows(&[0.86, 1.0], GUTTER);
    let top = rows[0].columns(&[1.35, 1.0], GUTTER);
    let space = figure.panel(top[0], "the set-up; three lobes at one point of the floor");
    figure.canvas.clipped(space, |canvas| set_up(canvas, space))?;
    figure.plot(top[1], "the exact derivative of each pixel", &derivatives()?);
    let bottom = rows[1].columns(&[1.0; 3], GUTTER);
    for (i, lighting) in Lighting::ALL.into_iter().enumerate() {
        let y = Axis::log(VARIANCE).limits(1.0, 1e10);
        let mine = widths.iter().filter(|p| p.lighting == lighting);
        let axes = race(mine, width_axis(), y, |p| p.width, |r| r.variance.value);
        let axes = axes.legend(if i == 0 { Legend::TopRight } else { Legend::None });
        figure.plot(bottom[i], &format!("variance: {}", lighting.name()), &axes);
    }
    let title = format!("the same object in more segments, lobe {}", number(WIDTH_OF_PARTS));
    let axes = race(vertices.iter(), vertex_axis(), Axis::log(VARIANCE), count, |r| r.variance.value);
    figure.plot(bottom[2], &title, &axes.legend(Legend::None));
    Ok(figure.canvas)
}

/// The cost in time.
pub(super) fn time(widths: &[Place], vertices: &[Place]) -> Canvas {
    let mut figure = Figure::new(960.0, 320.0, "The same by the clock, on one thread");
    let cells = figure.body.columns(&[1.0; 3], GUTTER);
    let cost = |run: &Run| 1e6 * run.time_cost();
    let sky = widths.iter().filter(|p| p.lighting == Lighting::Sky);
    let axes = race(sky, width_axis(), Axis::log(COST).limits(1.0, 1e11), |p| p.width, cost);
    figure.plot(cells[0], "time for a given precision against the lobe", &axes);
    let mut axes = Axes::new(vertex_axis(), Axis::log("microseconds")).legend(Legend::None);
    for (i, looks) in Racer::ALL.map(Racer::looks).into_iter().enumerate() {
        let points = vertices.iter().map(|p| [count(p), 1e6 * p.runs[i].seconds]);
        axes.line(points, &Style::new(looks.color).marker(looks.marker));
    }
    figure.plot(cells[1], "time of a sample against vertices", &axes);
    let axes = race(vertices.iter(), vertex_axis(), Axis::log(COST), count, cost).legend(Legend::None);
    figure.plot(cells[2], "time for a given precision against vertices", &axes);
    figure.canvas
}

fn count(place: &Place) -> f64 {
    place.vertices as f64
}

fn width_axis() -> Axis {
    let ticks = [1.0, 0.1, 0.01, 1e-3, 1e-4].map(|w| (w, number(w)));
    Axis::log("half width of the lobe (radians)").ticks(ticks).limits(6e-5, 0.9)
}

fn vertex_axis() -> Axis {
    let ticks = [10.0, 100.0, 1000.0, 10_000.0].map(|n| (n, number(n)));
    Axis::log("vertices of the object").ticks(ticks).limits(4.5, 9000.0)
}

/// One curve per method; rings without a line where the run was too short to know.
fn race<'a>(
    places: impl Iterator<Item = &'a Place> + Clone,
    x: Axis,
    y: Axis,
    at: impl Fn(&Place) -> f64,
    value: impl Fn(&Run) -> f64,
) -> Axes {
    let mut axes = Axes::new(x, y);
    for (i, looks) in Racer::ALL.map(Racer::looks).into_iter().enumerate() {
        let style = Style::new(looks.color);
        let known = places.clone().filter(|p| p.runs[i].is_known()).map(|p| {
            let (v, variance) = (value(&p.runs[i]), p.runs[i].variance);
            let error = variance.error / variance.value;
            [at(p), v, v * (1.0 - error), v * (1.0 + error)]
        });
        axes.measured(known, &style.clone().marker(looks.marker).labelled(looks.name));
        let unknown = places.clone().filter(|p| !p.runs[i].is_known() && p.runs[i].variance.value > 0.0);
        let points = unknown.map(|p| [at(p), value(&p.runs[i])]);
        axes.scatter(points, &style.marker(Marker::Ring).radius(3.6));
    }
    axes
}

/// The exact derivative against the film coordinate.
fn derivatives() -> anyhow::Result<Axes> {
    let mut axes = Axes::new(Axis::linear("pixel").limits(0.0, PIXELS as f64), Axis::linear("∂_{θ}I"));
    axes.horizontal(0.0, &Style::new(Color::MUTED).width(0.8));
    for (i, width) in SHOWN.into_iter().enumerate() {
        let scene = Scene::new(width, 1, Lighting::Sky)?;
        let ends = |p: usize| [[p as f64, scene.exact[p]], [p as f64 + 1.0, scene.exact[p]]];
        let style = Style::new(shade(i)).labelled(format!("lobe {}", number(width)));
        axes.line((0..PIXELS).flat_map(ends), &style);
    }
    Ok(axes)
}

/// Camera, floor, object, the lobes at one point, and the mirrored view.
fn set_up(canvas: &mut Canvas, space: Rect) -> anyhow::Result<()> {
    let scene = Scene::new(SHOWN[0], 1, Lighting::Sky)?;
    let view = View::upward(DVec2::new(-2.0, -0.3), DVec2::new(2.3, 1.75), space);
    draw_camera(canvas, &view, &scene.camera, 0.5);
    for u in [0.0, PIXELS as f64] {
        let [from, hit, mirror] = reflected(&scene, u);
        let pen = Pen::new(Palette::GREEN.alpha(0.55), 0.9).dashed();
        canvas.polyline(&[from, hit, hit + 1.7 * mirror].map(|p| view.at(p)), &pen);
    }
    lobes(canvas, &view, &scene);
    draw_world(canvas, &view, &scene.world);
    draw_motion(canvas, &view, &scene.world, (OBJECT, &scene.change), 0.28);
    label(canvas, &view, CENTRE, "object", Color::INK);
    label(canvas, &view, scene.camera.position + DVec2::new(0.0, 0.17), "camera", Palette::GREEN);
    label(canvas, &view, DVec2::new(-1.3, -0.15), "glossy floor", Palette::BLUE);
    Ok(())
}

/// The camera, the point of the floor that it sees at u, and the mirror direction there.
fn reflected(scene: &Scene, u: f64) -> [DVec2; 3] {
    let (from, direction) = (scene.camera.position, scene.camera.direction(u));
    [from, from - direction * (from.y / direction.y), DVec2::new(direction.x, -direction.y)]
}

/// The lobes around the mirror direction at the point seen in the middle of the film, each as a polar
/// curve of the square root of g/g(0): the root keeps tails visible.
fn lobes(canvas: &mut Canvas, view: &View, scene: &Scene) {
    let [from, at, mirror] = reflected(scene, 0.4 * PIXELS as f64);
    canvas.line(view.at(from), view.at(at), &Pen::new(Palette::GREEN, 1.2));
    for (i, width) in SHOWN.into_iter().enumerate() {
        let lobe = Gloss { strength: 1.0, width };
        let point = |k: i32| {
            let alpha = lobe.quantile(f64::from(k) / 400.0);
            let d = DVec2::from_angle(alpha).rotate(mirror);
            let radius = 0.85 * (lobe.density(alpha) / lobe.density(0.0)).sqrt();
            (d.y > 0.0).then(|| view.at(at + radius * d))
        };
        let mut ring: Vec<DVec2> = vec![view.at(at)];
        ring.extend((1..400).filter_map(point));
        canvas.outlined(&ring, shade(i).alpha(0.12), &Pen::new(shade(i), 1.1));
    }
}
