//! Figure 3: Reynolds, divergence and reparameterised forms of one derivative.

mod animation;
mod crossing;
mod exact;
mod sampled;
mod sampled_picture;
mod scene;
mod terms_picture;
mod words;

use flatland::plane::exact::Arrangement;
use flatland::plane::{Film, Filter};
use flatland::warp::Weighting;

use crate::context::Context;
use crate::gallery::Section;
use crate::output::{Table, write_animation, write_csv, write_png};
use crate::plot::Shading;
use crossing::{Moved, Samples, Window};
use exact::Terms;
use sampled::Estimate;
use scene::{Example, SIDE};

/// A construction of V with (θ − θ₀, fraction of samples that see another shape than at θ₀).
type Crossings<'a> = (&'a Moved, Vec<[f64; 2]>);

/// Everything the figure computes.
struct Results<'a> {
    tent: Terms,
    boxed: Terms,
    /// Central differences of exact images.
    central: Vec<f64>,
    estimate: Estimate,
    /// The negative control: weights that ignore boundaries.
    gaussian: Estimate,
    /// (area form, reparameterised form) of single samples.
    pairs: Vec<(f64, f64)>,
    crossings: Vec<Crossings<'a>>,
}

/// Draws it.
pub(crate) fn draw(context: &Context) -> anyhow::Result<Section> {
    let example = scene::example()?;
    let film = Film::new(SIDE, SIDE, Filter::Tent)?;
    let arrangement = Arrangement::new(&example.scene, &film)?;
    context.step("figure 3: samples moved by T");
    let side = context.spend(150, 500);
    let samples = Samples::new(&example, &arrangement, Window::FILM, side, context.seed());
    let results = compute(context, &example, &arrangement, &film, &samples)?;
    draw_pictures(context, &example, &arrangement, &film, &results)?;
    write_csv(&context.path("figure3_pixels.csv"), &pixels(&results))?;
    write_csv(&context.path("figure3_crossings.csv"), &crossing_table(&results))?;
    Ok(words::section(&results))
}

fn compute<'a>(
    context: &Context,
    example: &Example,
    arrangement: &Arrangement<'_>,
    film: &Film,
    samples: &'a Samples,
) -> anyhow::Result<Results<'a>> {
    context.step("figure 3: exact terms");
    let tent = exact::terms(example, arrangement, film)?;
    let boxed = exact::terms(example, arrangement, &film.with_filter(Filter::Box))?;
    let central = exact::central_difference(example, film)?;
    context.step("figure 3: warped-area sampling");
    let estimate = sampled::estimate(context, example, film, &tent.total, Weighting::default())?;
    let gaussian = sampled::estimate(context, example, film, &tent.total, Weighting::Gaussian)?;
    let pairs = sampled::sample_pairs(context, example, film);
    let crossings = crossings(example, samples)?;
    Ok(Results { tent, boxed, central, estimate, gaussian, pairs, crossings })
}

fn draw_pictures(
    context: &Context,
    example: &Example,
    arrangement: &Arrangement<'_>,
    film: &Film,
    results: &Results<'_>,
) -> anyhow::Result<()> {
    let Results { tent, boxed, central, .. } = results;
    let shown = terms_picture::Exhibits { example, arrangement, film, tent, boxed, central };
    let canvas = terms_picture::draw(&shown, &words::terms_caption());
    write_png(&context.path("figure3_forms.png"), &canvas)?;
    let shown = sampled_picture::Exhibits {
        estimate: &results.estimate,
        gaussian: &results.gaussian,
        pairs: &results.pairs,
        common: Shading::signed_covering(&tent.total, 0.985),
        crossings: &results.crossings,
    };
    let canvas = sampled_picture::draw(&shown, &words::sampled_caption(results));
    write_png(&context.path("figure3_samples.png"), &canvas)?;
    context.step("figure 3: animation");
    let frames = animation::frames(example, arrangement, context.spend(20, 48), context.seed())?;
    write_animation(&context.path("figure3_motion.png"), frames, context.spend(120, 50))
}

/// For each construction, (θ − θ₀, fraction of samples that see another shape than at θ₀).
fn crossings<'a>(example: &Example, samples: &'a Samples) -> anyhow::Result<Vec<Crossings<'a>>> {
    let mut curves: Vec<Crossings<'_>> = samples.moved.iter().map(|moved| (moved, vec![])).collect();
    for step in 0..=8 {
        let theta = 0.2 * 10.0_f64.powf(f64::from(step - 8) / 4.0);
        let displaced = example.motion.displace(&example.scene, theta)?;
        for (moved, curve) in &mut curves {
            let changed = samples.changed(moved, &displaced, theta);
            curve.push([theta, changed as f64 / samples.points.len() as f64]);
        }
    }
    Ok(curves)
}

fn crossing_table(results: &Results<'_>) -> Table {
    let mut table = Table::new(&["construction", "theta", "fraction_changed"]);
    for (moved, curve) in &results.crossings {
        for [theta, fraction] in curve {
            table.row([moved.name.into(), (*theta).into(), (*fraction).into()]);
        }
    }
    table
}

fn pixels(results: &Results<'_>) -> Table {
    let Results { tent, boxed, central, estimate, gaussian, .. } = results;
    let columns: [(&str, &[f64]); 13] = [
        ("interior", &tent.interior),
        ("edge_integral", &tent.edge),
        ("area_integral", &tent.area),
        ("total", &tent.total),
        ("central_difference", central),
        ("box_interior", &boxed.interior),
        ("box_edge_integral", &boxed.edge),
        ("box_area_integral_less_flux", &boxed.area),
        ("box_flux", &boxed.flux),
        ("warped_area", &estimate.mean),
        ("warped_area_standard_error", &estimate.standard_error),
        ("gaussian_weights", &gaussian.mean),
        ("gaussian_weights_standard_error", &gaussian.standard_error),
    ];
    let mut table = Table::new(&["x", "y"]);
    table.header.extend(columns.iter().map(|(name, _)| (*name).to_owned()));
    for i in 0..SIDE * SIDE {
        let values = columns.iter().map(|(_, values)| values[i].into());
        table.row([(i % SIDE).into(), (i / SIDE).into()].into_iter().chain(values));
    }
    table
}
