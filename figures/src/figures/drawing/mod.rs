//! A real drawing with the gradient image of a rotation of one of its parts.

mod measure;
mod page;

use anyhow::ensure;
use flatland::plane::svg::{SvgOptions, parse};
use flatland::plane::{Film, Filter, Motion, Scene};
use glam::DVec2;

use self::measure::{Estimate, Subject, View, channel};
use crate::context::Context;
use crate::gallery::Section;
use crate::output::Table;
use crate::plot::number;
use crate::prose::Prose;
use crate::ratio::Ratio;

/// The drawing; see figures/assets/CREDITS.md for its origin and licence.
const DRAWING: &str = include_str!("../../../assets/montenegro.svg");
/// The rotating part.
const PART: &str = "shield";

/// Measures, draws and explains.
pub(crate) fn draw(context: &Context) -> anyhow::Result<Section> {
    let drawing = parse(DRAWING, &SvgOptions::default())?;
    let part = drawing.shapes_under(PART);
    let scene = &drawing.scene;
    let moving: Vec<DVec2> =
        part.iter().flat_map(|&shape| scene.vertices()[scene.vertex_range(shape)].iter().copied()).collect();
    ensure!(!moving.is_empty(), "the drawing has no part named {PART}");
    let low = moving.iter().copied().fold(DVec2::INFINITY, DVec2::min);
    let high = moving.iter().copied().fold(DVec2::NEG_INFINITY, DVec2::max);
    let centre = 0.5 * (low + high);
    let radius = moving.iter().map(|p| p.distance(centre)).fold(0.0, f64::max);
    let subject = Subject { scene, motion: Motion::rotate(part.iter().copied(), centre), radius };

    let side = context.spend(144, 432);
    let film =
        |corner: DVec2, width: f64| Film::placed(side, side, Filter::Tent, corner, width / side as f64);
    context.step("gradient of the drawing");
    let spp = context.spend([12, 28], [256, 512]);
    let whole = View::new(&subject, film(DVec2::ZERO, drawing.size.x)?, spp[0], context.seed())?;
    context.step("gradient of the shield");
    let width = 1.06 * (high - low).max_element();
    let corner = centre - DVec2::splat(0.5 * width);
    let close = View::new(&subject, film(corner, width)?, spp[1], context.seed() ^ 0x6)?;

    context.png("drawing.png", &page::page(&whole, &close, centre, radius))?;
    let table = methods(&whole, &close);
    let mut data = vec![];
    for (name, view) in [("whole", &whole), ("shield", &close)] {
        let exact = view.exact.pixels();
        data.push(context.exr(&format!("drawing_exact_{name}.exr"), view.exact.width(), exact)?);
        data.push(context.csv(&format!("drawing_pixels_{name}.csv"), &pixels(view))?);
    }
    data.push(context.csv("drawing_methods.csv", &table)?);
    prose(&drawing.scene, part.len(), &whole, &close)?.section("drawing", data, table)
}

fn prose(scene: &Scene, moving: usize, whole: &View, close: &View) -> anyhow::Result<Prose> {
    let View { warped, differences, edges, .. } = close;
    let slope = |estimate: &Estimate| {
        let Ratio { value, error } = estimate.agreement.slope;
        format!("{value:.3} ± {error:.3}")
    };
    let times = |other: &Estimate| number(other.agreement.error / warped.agreement.error);
    let [pixels, blocks] = warped.worst();
    Prose::new(
        include_str!("drawing.md"),
        &[
            ("shapes", &scene.shapes().len()),
            ("edges", &scene.edges().count()),
            ("moving", &moving),
            ("seconds_exact", &number(whole.exact_seconds)),
            ("seconds_warped", &number(whole.warped.seconds)),
            ("samples_whole", &whole.warped.samples),
            ("slope_whole", &slope(&whole.warped)),
            ("slope_warped", &slope(warped)),
            ("step", &number(close.step)),
            ("slope_differences", &slope(differences)),
            ("error_differences", &times(differences)),
            ("slope_edges", &slope(edges)),
            ("error_edges", &times(edges)),
            ("samples", &warped.samples),
            ("pixels", &pixels.count),
            ("pixels_worst", &number(pixels.z)),
            ("pixels_expected", &number(pixels.expected)),
            ("block", &measure::BLOCK),
            ("blocks", &blocks.count),
            ("blocks_worst", &number(blocks.z)),
            ("blocks_expected", &number(blocks.expected)),
        ],
    )
}

/// Table of every pixel that changes.
fn pixels(view: &View) -> Table {
    let (width, _) = view.size();
    let exact = channel(&view.exact);
    let changes = |i: &usize| exact[*i] != 0.0 || view.warped.standard_error[*i] != 0.0;
    Table::of(
        (0..exact.len()).filter(changes),
        &[
            ("x", &|i| (i % width).into()),
            ("y", &|i| (i / width).into()),
            ("exact", &|i| exact[*i].into()),
            ("warped area", &|i| view.warped.mean[*i].into()),
            ("standard error", &|i| view.warped.standard_error[*i].into()),
            ("finite differences", &|i| view.differences.mean[*i].into()),
            ("edge sampling", &|i| view.edges.mean[*i].into()),
        ],
    )
}

fn methods(whole: &View, close: &View) -> Table {
    let estimates = [("whole", whole), ("shield", close)].into_iter().flat_map(|(film, view)| {
        [
            (film, "warped area", &view.warped),
            (film, "finite differences", &view.differences),
            (film, "edge sampling", &view.edges),
        ]
    });
    Table::of(
        estimates,
        &[
            ("film", &|(film, ..)| (*film).into()),
            ("method", &|(_, method, _)| (*method).into()),
            ("samples a pixel", &|(.., e)| e.samples.into()),
            ("rays (millions)", &|(.., e)| (1e-6 * e.rays as f64).into()),
            ("seconds", &|(.., e)| e.seconds.into()),
            ("slope on exact", &|(.., e)| e.agreement.slope.value.into()),
            ("its error", &|(.., e)| e.agreement.slope.error.into()),
            ("relative RMS error", &|(.., e)| e.agreement.error.into()),
            ("worst z of pixels", &|(.., e)| e.worst()[0].z.into()),
            ("expected", &|(.., e)| e.worst()[0].expected.into()),
            ("worst z of blocks", &|(.., e)| e.worst()[1].z.into()),
            ("expected", &|(.., e)| e.worst()[1].expected.into()),
        ],
    )
}
