//! The picture of the sampled area integral.

use super::scene::SIDE;
use super::{Moving, Results};
use crate::plot::{Axes, Axis, Canvas, Color, Figure, GUTTER, Legend, Marker, Palette, Shading, Style};

/// Range of the histograms of z-scores; values beyond it are counted in the last bin.
const REACH: f64 = 6.0;
const BINS: usize = 48;

/// Draws the estimate, its error, and their statistics.
pub(super) fn draw(shown: &Results) -> Canvas {
    let mut figure = Figure::new(960.0, 250.0, "The area integral by sampling, no edge ever looked for");
    let cells = figure.body.grid([1, 4], [GUTTER; 2]);
    let estimate = &shown.estimate;
    let highest = Shading::signed_covering(&estimate.standard_error, 0.995).scale.high();
    let fields = [
        (
            format!("warped-area estimate, {} spp", estimate.samples),
            &estimate.mean,
            Shading::signed_covering(&shown.tent.total, 0.985),
        ),
        ("its standard error".to_owned(), &estimate.standard_error, Shading::sequential(0.0, highest)),
        ("z = (estimate − exact)/error".to_owned(), &estimate.z, Shading::signed(4.0)),
    ];
    for ((title, values, shading), cell) in fields.iter().zip(&cells) {
        let space = figure.panel(*cell, title);
        figure.canvas.field(SIDE, values, shading, space);
    }
    figure.plot(cells[3], "z-scores of all pixels", &histogram(shown));
    figure.canvas
}

/// Two forms of single samples, and how many samples cross a silhouette.
pub(super) fn draw_motion(shown: &Moving<'_>) -> Canvas {
    let mut figure = Figure::new(760.0, 250.0, "");
    let cells = figure.body.grid([1, 2], [GUTTER; 2]);
    figure.plot(cells[0], "two forms of the same sample", &forms(shown));
    figure.plot(cells[1], "samples that cross a silhouette", &crossings(shown));
    figure.canvas
}

fn histogram(shown: &Results) -> Axes {
    let y = Axis::linear("density").limits(0.0, 0.66);
    let mut axes = Axes::new(Axis::linear("z").limits(-REACH, REACH), y);
    let width = 2.0 * REACH / BINS as f64;
    let bars = density(&shown.estimate.scores());
    axes.bars(bars.clone(), width, &Style::new(Palette::SKY).labelled("boundary-aware"));
    let steps = density(&shown.gaussian.scores()).into_iter().map(|[x, y]| [x - 0.5 * width, y]);
    axes.steps(steps, &Style::new(Palette::VERMILION).labelled("Gaussian weights").width(1.3));
    let normal = (0..=120).map(|i| {
        let z = REACH * (f64::from(i) / 60.0 - 1.0);
        [z, (-0.5 * z * z).exp() / std::f64::consts::TAU.sqrt()]
    });
    axes.line(normal, &Style::new(Color::INK).labelled("standard normal").width(1.3));
    axes
}

/// (middle, density) of every bin.
fn density(scores: &[f64]) -> Vec<[f64; 2]> {
    let mut counts = [0_usize; BINS];
    let width = 2.0 * REACH / BINS as f64;
    for z in scores {
        let bin = ((z + REACH) / width).clamp(0.0, BINS as f64 - 1.0);
        counts[bin as usize] += 1;
    }
    let scale = 1.0 / (scores.len().max(1) as f64 * width);
    counts.iter().enumerate().map(|(i, &n)| [width * (i as f64 + 0.5) - REACH, n as f64 * scale]).collect()
}

fn forms(shown: &Moving<'_>) -> Axes {
    let mut axes = Axes::new(
        Axis::log("|area form| of one sample").limits(1e-3, 1e3),
        Axis::log("|reparameterised − area|").limits(1e-19, 1e-9),
    )
    .legend(Legend::TopLeft);
    let points =
        shown.pairs.iter().filter(|(a, b)| a != b && *a != 0.0).map(|(a, b)| [a.abs(), (b - a).abs()]);
    let style = Style::new(Palette::BLUE.alpha(0.35)).labelled("one sample of one pixel").radius(1.4);
    axes.scatter(points, &style);
    let rounding = |x: f64| [x, x * f64::EPSILON];
    axes.line([rounding(1e-3), rounding(1e3)], &Style::new(Color::INK).width(1.0).labelled("rounding, 2⁻⁵²"));
    axes
}

fn crossings(shown: &Moving<'_>) -> Axes {
    let mut axes = Axes::new(Axis::log("θ − θ_{0}"), Axis::log("fraction of samples").limits(2e-5, 3.0))
        .legend(Legend::TopLeft);
    let markers = [Marker::Cross, Marker::Square, Marker::Circle, Marker::Diamond];
    for ((moved, points), marker) in shown.crossings.iter().zip(markers) {
        let seen = points.iter().copied().filter(|[_, fraction]| *fraction > 0.0);
        let style = Style::new(moved.color).labelled(moved.name).marker(marker).radius(2.6);
        axes.line(seen, &style);
    }
    if let Some((_, last)) = shown.crossings.first()
        && let Some([theta, fraction]) = last.last().copied()
    {
        let style = Style::new(Palette::GREY).dotted().width(1.0);
        // Free space for labels: left of the end of one line, right of that of the other.
        for (power, start, words, beside) in [(1, 2.0, "∝ θ", 0.55), (2, 0.1, "∝ θ^{2}", 1.0)] {
            let line = [1.0, 0.1].map(|t: f64| [theta * t, start * fraction * t.powi(power)]);
            axes.line(line, &style);
            axes.note([beside * line[1][0], line[1][1]], words, Palette::GREY);
        }
    }
    axes
}
