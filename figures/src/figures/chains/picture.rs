//! Pictures of the mirror with its auxiliary rays, and of the derivatives.

use flatland::chain::ChainTerms;
use flatland::estimator::chain::AuxiliaryRay;
use glam::DVec2;

use super::study::{Case, EMITTER, MIRROR, PIXELS, RAYS, Study, WEIGHTINGS};
use crate::figures::flat::label;
use crate::plot::*;

/// Half width of a band in standard errors.
pub(super) const BAND: f64 = 2.0;
/// A point is drawn largest if its weight is at least this multiple of the mean.
const HEAVY: f64 = 3.0;
/// Points of a drawn curve.
const POINTS: usize = 60;
/// Length of arrows per unit of velocity.
const ARROW: f64 = 0.9;

const COLORS: [Color; 4] = [Palette::VERMILION, Palette::BLUE, Palette::GREEN, Palette::SKY];

/// The whole figure.
pub(super) fn draw(study: &Study) -> Canvas {
    let mut figure = Figure::new(960.0, 640.0, "What no list of edges says: an emitter in a curved mirror");
    let rows = figure.body.rows(&[1.25, 1.0], GUTTER);
    let top = rows[0].columns(&[1.0, 1.0], GUTTER);
    let titles = ["auxiliary rays next to the emitter’s image", "auxiliary rays next to the mirror’s border"];
    for ((space, title), rays) in top.into_iter().zip(titles).zip([&study.rays[1], &study.rays[0]]) {
        let space = figure.panel(space, title);
        figure.canvas.clipped(space, |canvas| world(canvas, space, study, rays));
    }
    for (space, case) in rows[1].columns(&[1.0, 1.0], GUTTER).into_iter().zip(&study.cases) {
        figure.plot(space, &format!("∂_{{θ}}I as {}", case.name), &derivatives(case));
    }
    figure.canvas
}

fn derivatives(case: &Case) -> Axes {
    let mut axes = Axes::new(Axis::linear("pixel").limits(0.0, PIXELS as f64), Axis::linear("∂_{θ}I"));
    axes.horizontal(0.0, &Style::new(Color::MUTED).width(0.8));
    let at = |i: usize| i as f64 + 0.5;
    for ((weighting, color), [mean, error]) in WEIGHTINGS.iter().zip(COLORS).zip(&case.found).rev() {
        let band = mean.iter().zip(error).enumerate().map(|(i, (m, e))| [at(i), m - BAND * e, m + BAND * e]);
        axes.band(band, &Style::new(color));
        let line = mean.iter().enumerate().map(|(i, m)| [at(i), *m]);
        axes.line(line, &Style::new(color).width(1.4).labelled(weighting.name));
    }
    let exact = case.exact.iter().map(ChainTerms::total).enumerate().map(|(i, d)| [at(i), d]);
    axes.line(exact, &Style::new(Color::INK).width(1.2).dashed().labelled("exact"));
    axes.legend(Legend::TopLeft)
}

fn world(canvas: &mut Canvas, space: Rect, study: &Study, rays: &[AuxiliaryRay]) {
    let view = View::upward(DVec2::new(-2.5, -0.75), DVec2::new(1.5, 3.65), space);
    let camera = view.at(study.camera.position);
    let faint = Pen::new(Color::MUTED.alpha(0.55), 0.7);
    for ray in rays {
        let mut from = camera;
        for point in &ray.points {
            canvas.line(from, view.at(*point), &faint);
            from = view.at(*point);
        }
    }
    for (surface, color) in [(MIRROR, Palette::BLUE), (EMITTER, Palette::ORANGE)] {
        let curve = study.world.surfaces()[surface].curve;
        let points: Vec<DVec2> = (0..=POINTS).map(|i| view.at(curve.at(i as f64 / POINTS as f64))).collect();
        canvas.polyline(&points, &Pen::new(color, 3.0));
        let velocity = study.cases.iter().map(|case| case.velocities[surface]).sum::<DVec2>();
        let from = curve.at(0.5);
        canvas.arrow(view.at(from), view.at(from + ARROW * velocity), &Pen::new(Color::INK, 1.4));
    }
    for ray in rays {
        for (point, weight) in ray.points.iter().zip(&ray.weights) {
            let relative = (weight * RAYS as f64 / HEAVY).clamp(0.0, 1.0);
            canvas.disc(view.at(*point), 1.2 + 4.5 * relative.sqrt(), Palette::VERMILION.alpha(0.6));
        }
    }
    canvas.disc(camera, 4.0, Palette::GREEN);
    label(canvas, &view, study.camera.position - DVec2::new(0.0, 0.2), "camera", Palette::GREEN);
    label(canvas, &view, DVec2::new(-1.6, -0.1), "emitter", Palette::ORANGE);
    label(canvas, &view, DVec2::new(0.0, 3.3), "mirror", Palette::BLUE);
}
