//! The animated picture: samples moved by T while the scene moves.

use flatland::plane::Scene;
use flatland::plane::exact::Arrangement;
use glam::{DVec2, DVec3};
use rayon::prelude::*;

use super::super::common::display;
use super::crossing::{Moved, Samples, Window};
use super::scene::Example;
use crate::plot::*;

/// Amplitude of θ to either side.
pub(super) const SWING: f64 = 0.12;
/// The region shown in the panels: the shapes that move.
const WINDOW: Window = Window { low: DVec2::new(11.0, 8.5), side: 30.0 };
/// Samples along each side of the window.
const SAMPLES: usize = 28;
/// Number of panels, one per construction in order; the last construction is only in the diagram below.
const PANELS: usize = 3;

/// The frames of one swing.
pub(super) fn frames(
    example: &Example,
    arrangement: &Arrangement<'_>,
    count: usize,
    seed: u64,
) -> anyhow::Result<Vec<Canvas>> {
    let samples = &Samples::new(example, arrangement, WINDOW, SAMPLES, seed);
    let curves = curves(example, samples)?;
    (0..count)
        .into_par_iter()
        .map(|i| {
            let theta = SWING * (std::f64::consts::TAU * i as f64 / count as f64).sin();
            let displaced = example.motion.displace(&example.scene, theta)?;
            Ok(frame(example, samples, &displaced, theta, &curves))
        })
        .collect()
}

/// Pairs (θ, samples that see another shape than at θ₀) for each construction.
fn curves(example: &Example, samples: &Samples) -> anyhow::Result<Vec<Vec<[f64; 2]>>> {
    let steps = 44;
    let mut curves = vec![vec![]; samples.moved.len()];
    for i in 0..=steps {
        let theta = SWING * (2.0 * f64::from(i) / f64::from(steps) - 1.0);
        let displaced = example.motion.displace(&example.scene, theta)?;
        for (curve, moved) in curves.iter_mut().zip(&samples.moved) {
            curve.push([theta, samples.changed(moved, &displaced, theta) as f64]);
        }
    }
    Ok(curves)
}

fn frame(
    example: &Example,
    samples: &Samples,
    displaced: &Scene,
    theta: f64,
    curves: &[Vec<[f64; 2]>],
) -> Canvas {
    let side = 256.0;
    let mut figure = Figure::new(3.0 * side + 2.0 * GUTTER, side + 44.0 + 130.0, "");
    let (top, below) = figure.body.split_top(side + 44.0);
    for (moved, cell) in samples.moved.iter().take(PANELS).zip(top.columns(&[1.0; PANELS], GUTTER)) {
        figure.canvas.part(cell);
        let (strip, rest) = cell.split_top(20.0);
        let (picture, foot) = rest.split_top(side);
        let style = TextStyle::new(13.0, moved.color).bold().anchored(Align::Centre, Height::Top);
        figure.canvas.text(moved.name, DVec2::new(strip.centre().x, strip.y), &style);
        let places = samples.at(moved, displaced, theta);
        panel(&mut figure.canvas, example, displaced, &places, picture);
        let count = places.iter().filter(|(_, changed)| *changed).count();
        let text = format!("{count} of {} samples see another shape", places.len());
        let style = TextStyle::new(11.0, if count > 0 { Palette::VERMILION } else { Color::MUTED });
        let at = DVec2::new(foot.centre().x, foot.y + 5.0);
        figure.canvas.text(&text, at, &style.anchored(Align::Centre, Height::Top));
    }
    diagram(&mut figure.canvas, &samples.moved, theta, curves, below);
    figure.canvas.part(below);
    figure.canvas
}

fn panel(canvas: &mut Canvas, example: &Example, displaced: &Scene, places: &[(DVec2, bool)], at: Rect) {
    let view = View::downward(WINDOW.low, WINDOW.low + WINDOW.side, at);
    canvas.clipped(at, |canvas| {
        canvas.fill_rect(at, tone(example.scene.background()));
        for shape in displaced.shapes() {
            let rings: Vec<Vec<DVec2>> =
                shape.polygon().rings().map(|ring| ring.iter().map(|p| view.at(*p)).collect()).collect();
            canvas.fill_polygon(&rings, tone(shape.shade().value(middle(shape.polygon().vertices()))));
        }
        for (place, changed) in places {
            if *changed {
                canvas.disc(view.at(*place), 3.9, Color::WHITE);
                canvas.disc(view.at(*place), 3.1, Palette::VERMILION);
            } else {
                canvas.disc(view.at(*place), 1.5, Color::INK.alpha(0.75));
            }
        }
    });
    canvas.frame(at, &Pen::new(Color::SPINE, 0.5));
}

fn middle(points: &[DVec2]) -> DVec2 {
    points.iter().sum::<DVec2>() / points.len().max(1) as f64
}

/// A shape's colour, paler, so that samples stand out.
fn tone(linear: DVec3) -> Color {
    display(linear).tint(0.55)
}

fn diagram(canvas: &mut Canvas, moved: &[Moved], theta: f64, curves: &[Vec<[f64; 2]>], space: Rect) {
    let mut axes = Axes::new(Axis::linear("θ − θ_{0}").limits(-SWING, SWING), Axis::linear("samples"))
        .legend(Legend::Outside);
    for (moved, curve) in moved.iter().zip(curves) {
        axes.line(curve.iter().copied(), &Style::new(moved.color).labelled(moved.name).width(1.6));
    }
    axes.vertical(theta, &Style::new(Color::INK).width(1.0));
    axes.draw(canvas, space);
}
