//! Pictures of the targets, success rates, convergence, and the rest points of biased gradients.

use super::drift::{Drift, Offset};
use super::fit::Path;
use super::protocol::SAMPLES;
use super::racer::Racer;
use super::stage::Stage;
use super::study::Study;
use super::summary::Race;
use super::views::View;
use crate::plot::*;
use crate::space::picture::radiance;

const GAP: f64 = 14.0;
/// Room for the names of methods beside a plot.
const NAMES: f64 = 128.0;
/// The side of a small picture.
const SIDE: f64 = 96.0;

/// Target, start and ends: a row for each scene.
pub(super) fn views(views: &[View]) -> Canvas {
    let columns = 2 + Racer::ALL.len();
    let (width, row) = (NAMES - 30.0 + columns as f64 * (SIDE + 6.0), SIDE + 10.0);
    let title = "What the descents see: target, the first start, and where each method ends from there";
    let mut figure = Figure::new(width, views.len() as f64 * row + 18.0, title);
    let (names, cells) = figure.body.split_top(18.0);
    let left = NAMES - 30.0;
    let heads = ["target", "start"].into_iter().map(|name| (name, Color::INK));
    let heads = heads.chain(Racer::ALL.map(|racer| (racer.name(), racer.color().mix(Color::INK, 0.25))));
    for (i, (name, color)) in heads.enumerate() {
        let at = glam::DVec2::new(names.x + left + i as f64 * (SIDE + 6.0) + 0.5 * SIDE, names.y + 8.0);
        let style = TextStyle::new(9.4, color).anchored(Align::Centre, Height::Middle);
        figure.canvas.text(name, at, &style);
    }
    for (i, view) in views.iter().enumerate() {
        let top = cells.y + i as f64 * row;
        let at = glam::DVec2::new(cells.x, top + 0.5 * SIDE);
        let style = TextStyle::new(10.5, Color::INK).anchored(Align::Left, Height::Middle);
        figure.canvas.text(view.stage.name(), at, &style);
        for (j, (pixels, is_good)) in view.pictures.iter().enumerate() {
            let place = Rect::new(cells.x + left + j as f64 * (SIDE + 6.0), top, SIDE, SIDE);
            let place = figure.canvas.picture(&radiance(pixels, view.side), place);
            if let Some(is_good) = is_good {
                let color = if *is_good { Palette::GREEN } else { Palette::VERMILION };
                figure.canvas.frame(place, &Pen::new(color, 2.0));
            }
        }
    }
    figure.canvas
}

/// Target and start, the ends of some descents, and their errors along the way.
pub(super) fn live(ends: &[Vec<glam::DVec3>; 2], paths: &[Path], side: usize) -> Canvas {
    const SIDE: f64 = 128.0;
    let count = (2 + paths.len()) as f64;
    let mut figure = Figure::new(count * (SIDE + GAP), SIDE + 20.0 + 200.0, "");
    let (cells, plot) = figure.body.split_top(SIDE + 34.0);
    let named = ends.iter().zip(["target", "start"]).map(|(pixels, name)| (pixels, name, Color::INK, None));
    let found = |path: &Path| path.end.relative() <= 1.0;
    let named =
        named.chain(paths.iter().map(|p| (&p.picture, p.racer.name(), p.racer.color(), Some(found(p)))));
    for (i, (pixels, name, color, is_found)) in named.enumerate() {
        let at = glam::DVec2::new(cells.x + i as f64 * (SIDE + GAP), cells.y);
        let style = TextStyle::new(10.5, color.mix(Color::INK, 0.25)).anchored(Align::Left, Height::Top);
        figure.canvas.text(name, at, &style);
        let place = Rect::new(at.x, at.y + 16.0, SIDE, SIDE);
        let place = figure.canvas.picture(&radiance(pixels, side), place);
        if let Some(is_found) = is_found {
            let color = if is_found { Palette::GREEN } else { Palette::VERMILION };
            figure.canvas.frame(place, &Pen::new(color, 2.0));
        }
    }
    let mut axes = Axes::new(Axis::linear("step"), Axis::log("error, 1 = found")).legend(Legend::Outside);
    axes.horizontal(1.0, &Style::new(Color::MUTED).width(1.0).dashed());
    for path in paths {
        let points = path.errors.iter().enumerate().map(|(i, error)| [i as f64, *error]);
        axes.line(points, &Style::new(path.racer.color()).labelled(path.racer.name()));
    }
    axes.draw(&mut figure.canvas, plot);
    figure.canvas.part(cells);
    figure.canvas.part(plot);
    figure.canvas
}

/// The part of starts that succeed, with intervals: full discs at equal steps, rings at equal time.
pub(super) fn rates(study: &Study, races: &[[Race<'_>; 2]]) -> Canvas {
    let title = "How often each method finds the pose";
    let mut figure = Figure::new(960.0, 2.0 * 205.0 + GAP, title);
    let cells = figure.body.grid([2, 3], [GAP; 2]);
    for (stage, cell) in Stage::ALL.into_iter().zip(cells) {
        let count = study.effort.starts[stage as usize];
        let space = figure.panel(cell, &format!("{} (starts: {count})", stage.name()));
        let ticks = [0, 25, 50, 75, 100].map(|part| (f64::from(part), part.to_string()));
        let axis = Axis::linear("found, % of starts").limits(-4.0, 104.0).ticks(ticks);
        let mut rows = named(axis);
        for [steps, time] in races.iter().filter(|race| race[0].stage == stage) {
            let row = steps.racer as usize;
            for (race, lift, marker) in [(steps, 0.16, Marker::Circle), (time, -0.16, Marker::Ring)] {
                let lifted = |value: f64| {
                    let [x, y] = rows.point(row, 100.0 * value);
                    [x, y + lift]
                };
                let (bar, point) = (race.rate().interval().map(lifted), lifted(race.rate().value()));
                let style = Style::new(race.racer.color());
                rows.axes.line(bar, &style.clone().width(1.3));
                rows.axes.scatter([point], &style.marker(marker).radius(3.4));
            }
        }
        rows.draw(&mut figure.canvas, space, NAMES, 6.0);
    }
    figure.canvas
}

/// The median error over the steps.
pub(super) fn curves(study: &Study, races: &[[Race<'_>; 2]]) -> anyhow::Result<Canvas> {
    let title = "The median error along the descent, at equal steps";
    let mut figure = Figure::new(960.0, 2.0 * 215.0 + GAP, title);
    let columns = figure.body.columns(&[830.0, 116.0], GAP);
    let (plots, legend) = (columns[0], columns[1]);
    let cells = plots.grid([2, 3], [GAP; 2]);
    for (stage, cell) in Stage::ALL.into_iter().zip(cells) {
        let mut axes = Axes::new(Axis::linear("step"), Axis::log("error, 1 = found")).legend(Legend::None);
        axes.horizontal(1.0, &Style::new(Color::MUTED).width(1.0).dashed());
        for [steps, _] in races.iter().filter(|race| race[0].stage == stage) {
            let points = steps.curve()?.into_iter().enumerate();
            let points = points.map(|(i, error)| [(i * study.effort.stride) as f64, error]);
            axes.line(points, &Style::new(steps.racer.color()));
        }
        figure.plot(cell, stage.name(), &axes);
    }
    for (i, racer) in Racer::ALL.into_iter().enumerate() {
        let at = glam::DVec2::new(legend.x + 12.0, legend.y + 34.0 + 17.0 * i as f64);
        figure.canvas.line(at, at + glam::DVec2::new(18.0, 0.0), &Pen::new(racer.color(), 1.7));
        let style = TextStyle::new(10.0, Color::INK).anchored(Align::Left, Height::Middle);
        figure.canvas.text(racer.name(), at + glam::DVec2::new(24.0, 0.0), &style);
    }
    Ok(figure.canvas)
}

/// Rest points of descents that begin at the truth: before targets that cannot be reached, and the bunny
/// before its own.
pub(super) fn drifts(unreachable: &[(Stage, Vec<Drift>)], truth: &[Drift]) -> Canvas {
    let title = "Where descents go that begin with the object in its place";
    let mut figure = Figure::new(1020.0, 2.0 * 200.0 + GAP, title);
    let cells = figure.body.grid([2, 3], [GAP; 2]);
    let targets =
        unreachable.iter().map(|(stage, drifts)| (format!("{}, no match", stage.name()), drifts, true));
    let own = ("bunny, its own picture".to_owned(), truth.to_vec());
    let targets: Vec<_> = targets.chain([(own.0, &own.1, false)]).collect();
    for (part, row) in cells.chunks(3).enumerate() {
        for ((name, drifts, is_compared), cell) in targets.iter().zip(row) {
            let what = ["translation", "rotation"][part];
            let space = figure.panel(*cell, &format!("{name}: {what}"));
            draw_drifts(&mut figure.canvas, space, drifts, part, *is_compared);
        }
    }
    figure.canvas
}

/// Lengths of mean translations (part 0) or rotations (part 1), and their distance from those of edge
/// sampling.
fn draw_drifts(canvas: &mut Canvas, space: Rect, drifts: &[Drift], part: usize, is_compared: bool) {
    let (unit, scale) = [("% of the extent", 100.0), ("degrees", 1.0)][part];
    let offset = |drift: &Drift| [drift.shift, drift.turn][part];
    let widest = drifts.iter().map(|d| offset(d).length().ends()[1]).fold(1e-9, f64::max);
    let label = |d: &Drift| {
        let many = if d.samples > SAMPLES { format!(", {} samples", d.samples) } else { String::new() };
        (format!("{}{many}", d.racer.name()), d.racer.color())
    };
    let axis = Axis::linear(unit).limits(0.0, 1.1 * scale * widest);
    let mut rows = Rows::new(axis, drifts.iter().map(label).collect());
    let marker = |offset: &Offset| if offset.is_sure() { Marker::Circle } else { Marker::Ring };
    for (row, drift) in drifts.iter().enumerate() {
        let offset = offset(drift);
        rows.bar(row, offset.length().ends().map(|end| scale * end.max(0.0)));
        rows.mark(row, scale * offset.length().value, marker(&offset));
    }
    let placed = rows.draw(canvas, space, NAMES, if is_compared { 84.0 } else { 6.0 });
    if is_compared {
        rows.column(canvas, &placed, (8.0, "from edges’ end"), |row| {
            let beyond = drifts[row].beyond(drifts).filter(|_| drifts[row].racer != Racer::EdgeSampling);
            beyond.map_or_else(
                || ("–".to_owned(), Color::MUTED),
                |b| {
                    let color = if b[part].is_sure() { Color::INK } else { Color::SPINE };
                    (b[part].length().scaled(scale).shown(), color)
                },
            )
        });
    }
}

/// A row for every method.
fn named(axis: Axis) -> Rows {
    Rows::new(axis, Racer::ALL.map(|racer| (racer.name().to_owned(), racer.color())).to_vec())
}
