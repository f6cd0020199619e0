//! Figure 6: a real drawing with the gradient image of a rotation of one of its parts.

mod measure;
mod page;

use anyhow::ensure;
use flatland::plane::svg::{SvgOptions, parse};
use flatland::plane::{Film, Filter, Image, Motion};
use glam::DVec2;

use self::measure::{Estimate, Subject, View, channel};
use crate::context::Context;
use crate::gallery::{Picture, Placement, Section, formula};
use crate::output::{Table, write_csv, write_exr, write_png};
use crate::plot::number;

/// The drawing; its origin and licence stand in figures/assets/CREDITS.md.
const DRAWING: &str = include_str!("../../../assets/montenegro.svg");
/// The part that turns.
const PART: &str = "shield";
const PICTURE: &str = "figure6_drawing.png";

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
    context.step("6 gradient of the drawing");
    let spp = context.spend([12, 28], [256, 512]);
    let whole = View::new(&subject, film(DVec2::ZERO, drawing.size.x)?, spp[0], context.seed())?;
    context.step("6 gradient of the shield");
    let width = 1.06 * (high - low).max_element();
    let corner = centre - DVec2::splat(0.5 * width);
    let close = View::new(&subject, film(corner, width)?, spp[1], context.seed() ^ 0x6)?;

    write_png(&context.path(PICTURE), &page::page(&whole, &close, centre, radius).canvas)?;
    let views = [("whole", &whole), ("shield", &close)];
    let data = write_data(context, &views)?;
    Ok(Section {
        id: "drawing".to_owned(),
        title: "A real drawing".to_owned(),
        explanation_html: explanation(&drawing.scene, part.len(), &whole, &close),
        formula_mathml: formula(
            r"∂_θ I_p = ∫ h_p ∂_θ f \d u + ∮ h_p Δf (v·ν) \d l = ∫ h_p ∂_θ f + ∇·(V h_p f) \d u",
            Placement::Display,
        ),
        pictures: vec![Picture {
            file: PICTURE.to_owned(),
            alt: "A coat of arms, the exact gradient image of turning its shield, and estimates of it"
                .to_owned(),
            caption: caption(&close),
        }],
        data,
        table: Some(methods(&views)),
    })
}

fn explanation(scene: &flatland::plane::Scene, moving: usize, whole: &View, close: &View) -> String {
    let [warped, differences, edges] =
        [&close.warped, &close.differences, &close.edges].map(|estimate| estimate.agreement);
    format!(
        "<p>The coat of arms of Montenegro, read from an SVG file: {} shapes with {} edges. The {moving} shapes of \
         the shield turn about its centre, the rest stands still. Red pixels grow lighter in green, blue ones \
         darker; wherever nothing moves, or a shape slides along itself, the gradient is 0. The exact image integrates over every visible edge in \
         closed form, which took {} s here. Warped area is not told the edges: it asks only what is \
         seen at a point, how fast that moves, and how far its end is. It took {} s for {} samples a pixel, \
         and it is unbiased, so what is left is noise: the slope of its image on the exact one is {}, on \
         the shield alone {}.</p>\
         <p>With as many rays, finite differences with a step of {} rad, half a pixel at the rim, have slope {} and {} times \
         warped area’s error; edge sampling, given all edges, has slope {} and {} times its error. For one parameter both are \
         hard to beat; they need a second scene a parameter, or the edges.</p>\
         <p>The ratio of difference and standard error would be normal if samples were many. With {} a \
         pixel it has heavy tails: the largest of {} is {}, where {} would be expected of normal ones. Sums \
         over blocks of {} × {} pixels average more samples: the largest of {} is {}, expected {}.</p>",
        scene.shapes().len(),
        scene.edges().count(),
        number(whole.exact_seconds),
        number(whole.warped.seconds),
        whole.warped.samples,
        slope(&whole.warped),
        slope(&close.warped),
        number(close.step),
        slope(&close.differences),
        number(differences.error / warped.error),
        slope(&close.edges),
        number(edges.error / warped.error),
        close.warped.samples,
        warped.pixels.count,
        number(warped.pixels.z),
        number(warped.pixels.expected),
        measure::BLOCK,
        measure::BLOCK,
        warped.blocks.count,
        number(warped.blocks.z),
        number(warped.blocks.expected),
    )
}

fn caption(close: &View) -> String {
    format!(
        "Green channel. (a–d) The whole drawing; the frame is the film of (e–h). (i) Standard error of (g). (j) \
         Its z-scores; grey where nothing varies. (k) Their distribution, which would be the dashed line for \
         {} samples a pixel if samples were normal.",
        close.warped.samples
    )
}

fn slope(estimate: &Estimate) -> String {
    format!("{:.3} ± {:.3}", estimate.agreement.slope, estimate.agreement.slope_error)
}

/// Writes the exact gradients as signed EXR, every pixel that changes as CSV, and the table of methods.
fn write_data(context: &Context, views: &[(&str, &View)]) -> anyhow::Result<Vec<String>> {
    let mut files = vec![];
    for (name, view) in views {
        let file = format!("figure6_exact_{name}.exr");
        let (width, height) = view.size();
        write_exr(&context.path(&file), width, height, &rgb(&view.exact))?;
        files.push(file);
        let file = format!("figure6_pixels_{name}.csv");
        write_csv(&context.path(&file), &pixels(view))?;
        files.push(file);
    }
    let file = "figure6_methods.csv".to_owned();
    write_csv(&context.path(&file), &methods(views))?;
    files.push(file);
    Ok(files)
}

fn rgb(image: &Image) -> Vec<[f32; 3]> {
    image.pixels().iter().map(|pixel| pixel.as_vec3().to_array()).collect()
}

fn pixels(view: &View) -> Table {
    let mut table = Table::new(&[
        "x",
        "y",
        "exact",
        "warped area",
        "standard error",
        "finite differences",
        "edge sampling",
    ]);
    let (width, _) = view.size();
    for (i, exact) in channel(&view.exact).into_iter().enumerate() {
        let error = view.warped.standard_error[i];
        if exact == 0.0 && error == 0.0 {
            continue;
        }
        table.row([
            (i % width).into(),
            (i / width).into(),
            exact.into(),
            view.warped.mean[i].into(),
            error.into(),
            view.differences.mean[i].into(),
            view.edges.mean[i].into(),
        ]);
    }
    table
}

fn methods(views: &[(&str, &View)]) -> Table {
    let mut table = Table::new(&[
        "film",
        "method",
        "samples a pixel",
        "rays (millions)",
        "seconds",
        "slope on exact",
        "its error",
        "relative RMS error",
        "worst z of pixels",
        "expected",
        "worst z of blocks",
        "expected",
    ]);
    for (name, view) in views {
        let estimates = [
            ("warped area", &view.warped),
            ("finite differences", &view.differences),
            ("edge sampling", &view.edges),
        ];
        for (method, estimate) in estimates {
            let a = &estimate.agreement;
            table.row([
                (*name).into(),
                method.into(),
                estimate.samples.into(),
                (1e-6 * estimate.rays as f64).into(),
                estimate.seconds.into(),
                a.slope.into(),
                a.slope_error.into(),
                a.error.into(),
                a.pixels.z.into(),
                a.pixels.expected.into(),
                a.blocks.z.into(),
                a.blocks.expected.into(),
            ]);
        }
    }
    table
}
