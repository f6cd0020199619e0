//! Pictures of the estimates and their cost.

use flatland::plane::exact::Arrangement;
use glam::DVec2;

use super::super::common::display;
use super::foliage::{Foliage, SIDE};
use super::study::{Plant, RACERS, Run};
use crate::plot::*;

/// The title of a panel, the label of its axis, and the quantity compared.
type Race<'a> = (&'a str, &'a str, fn(&Run) -> f64);

/// Two plants and their cost without a clock: the same for every run of one seed.
pub(super) fn rays(examples: &[Foliage; 2], plants: &[Plant]) -> anyhow::Result<Canvas> {
    let mut figure = Figure::new(960.0, 650.0, "What edge sampling has to find, and what finding it costs");
    let (top, bottom) = figure.body.split_top(342.0);
    let top = top.columns(&[1.0; 3], GUTTER);
    for (plant, cell) in examples.iter().zip(&top) {
        let title = format!("{} leaves, {} edges", plant.scene.shapes().len(), plant.scene.edges().count());
        let space = figure.panel(*cell, &title);
        leaves(&mut figure.canvas, plant, space)?;
    }
    figure.plot(top[2].inset(0.0, 0.0, 0.0, 8.0), "most edges are hidden", &visibility(plants));
    let races: [Race<'_>; 3] = [
        ("variance of one sample", "variance", |run| run.variance),
        ("rays of one sample", "rays", |run| run.rays),
        ("rays for a given precision", "variance × rays", Run::rays_cost),
    ];
    draw_races(&mut figure, plants, bottom, &races);
    Ok(figure.canvas)
}

/// The cost in time.
pub(super) fn time(plants: &[Plant]) -> Canvas {
    let mut figure = Figure::new(960.0, 290.0, "The same by the clock, on one thread");
    let races: [Race<'_>; 2] = [
        ("time of one sample", "microseconds", |run| 1e6 * run.seconds),
        ("time for a given precision", "variance × microseconds", |run| 1e6 * run.time_cost()),
    ];
    let body = figure.body;
    let cells = draw_races(&mut figure, plants, body, &races);
    figure.plot(cells[2], "edge sampling's advantage", &advantage(plants));
    figure.canvas
}

/// One panel of a row for each race, the first with a legend; returns three cells of the row.
fn draw_races(figure: &mut Figure, plants: &[Plant], space: Rect, races: &[Race<'_>]) -> Vec<Rect> {
    let cells = space.columns(&[1.0; 3], GUTTER);
    for (i, (title, label, value)) in races.iter().enumerate() {
        let legend = if i == 0 { Legend::BottomRight } else { Legend::None };
        let mut axes = Axes::new(leaf_axis(), Axis::log(*label)).legend(legend);
        for (i, racer) in RACERS.iter().enumerate() {
            let style = Style::new(racer.color).labelled(racer.name).marker(racer.marker);
            axes.line(plants.iter().map(|p| [p.leaves as f64, value(&p.runs[i])]), &style);
        }
        figure.plot(cells[i], title, &axes);
    }
    cells
}

fn leaves(canvas: &mut Canvas, plant: &Foliage, space: Rect) -> anyhow::Result<()> {
    let side = space.width.min(space.height);
    let at = Rect::new(space.x, space.y, side, side);
    let view = View::downward(DVec2::ZERO, DVec2::splat(SIDE as f64), at);
    let scene = &plant.scene;
    let arrangement = Arrangement::new(scene, &plant.film)?;
    canvas.clipped(at, |canvas| {
        canvas.fill_rect(at, display(scene.background()).tint(0.5));
        for shape in scene.shapes() {
            let ring: Vec<DVec2> = shape.polygon().vertices().iter().map(|p| view.at(*p)).collect();
            canvas.fill_polygon(&[ring], display(shape.shade().value(DVec2::ZERO)).tint(0.35));
        }
        for (_, edge) in scene.edges() {
            let [p, q] = edge.map(|v| view.at(scene.vertices()[v]));
            canvas.line(p, q, &Pen::new(Color::INK.alpha(0.33), 0.5));
        }
        for pen in [Pen::new(Color::WHITE, 2.6), Pen::new(Palette::VERMILION, 1.5)] {
            for (ends, _) in arrangement.silhouettes() {
                let [p, q] = ends.map(|end| view.at(end));
                canvas.line(p, q, &pen);
            }
        }
    });
    canvas.frame(at, &Pen::new(Color::SPINE, 0.5));
    Ok(())
}

fn leaf_axis() -> Axis {
    Axis::log("leaves")
}

fn visibility(plants: &[Plant]) -> Axes {
    let ticks = [0.0, 0.25, 0.5, 0.75, 1.0].map(|t| (t, format!("{t}")));
    let mut axes = Axes::new(leaf_axis(), Axis::linear("fraction").limits(0.0, 1.42).ticks(ticks));
    let curve = |value: fn(&Plant) -> f64| plants.iter().map(move |p| [p.leaves as f64, value(p)]);
    let style = Style::new(Palette::GREEN).labelled("edge length that is seen").marker(Marker::Circle);
    axes.line(curve(|p| p.visible), &style);
    let exact = plants.iter().filter_map(|p| Some([p.leaves as f64, p.visible_exact?]));
    let style = Style::new(Color::INK).labelled("the same, exactly").marker(Marker::Ring).radius(5.0);
    axes.scatter(exact, &style);
    let style = Style::new(Palette::VERMILION).labelled("edge samples wasted").marker(Marker::Square);
    axes.line(curve(|p| p.wasted), &style);
    axes
}

fn advantage(plants: &[Plant]) -> Axes {
    let mut axes = Axes::new(leaf_axis(), Axis::log("unbiased warped area ÷ edge sampling"));
    let mut curve = |label: &str, color, marker, value: fn(&Run) -> f64| {
        let points = plants.iter().map(|p| [p.leaves as f64, value(&p.runs[1]) / value(&p.runs[0])]);
        axes.line(points, &Style::new(color).labelled(label).marker(marker));
    };
    curve("variance", Palette::GREY, Marker::Diamond, |run| run.variance);
    curve("variance × rays", Palette::GREEN, Marker::TriangleUp, Run::rays_cost);
    curve("variance × time", Palette::PURPLE, Marker::Circle, Run::time_cost);
    axes.horizontal(1.0, &Style::new(Color::INK).dashed().width(1.0));
    axes.note([3.0, 0.6], "equal", Color::INK);
    axes
}
