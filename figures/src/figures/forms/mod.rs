//! Three forms of one derivative: Reynolds and divergence in one figure, samples that move in another.

mod animation;
mod crossing;
mod exact;
mod sampled;
mod sampled_picture;
mod scene;
mod terms_picture;

use flatland::plane::exact::Arrangement;
use flatland::plane::{Film, Filter};
use flatland::warp::Weighting;

use self::animation::SWING;
use self::crossing::{AUXILIARY_RAYS, KERNEL_WIDTH, Moved, Samples, Window};
use self::exact::{STEP, Terms, difference};
use self::sampled::{Estimate, SETTLED};
use self::scene::{Example, SIDE};
use crate::context::Context;
use crate::figures::common::{largest, root_mean_square};
use crate::gallery::Section;
use crate::output::Table;
use crate::plot::number;
use crate::prose::Prose;

/// A construction of V with (θ − θ₀, fraction of samples that see another shape than at θ₀).
type Crossings<'a> = (&'a Moved, Vec<[f64; 2]>);

/// Results on integrals.
struct Results {
    tent: Terms,
    boxed: Terms,
    /// Central differences of exact images.
    central: Vec<f64>,
    estimate: Estimate,
    /// The negative control: weights that ignore boundaries.
    gaussian: Estimate,
}

/// Results on samples that move.
struct Moving<'a> {
    /// (area form, reparameterised form) of single samples.
    pairs: Vec<(f64, f64)>,
    crossings: Vec<Crossings<'a>>,
}

/// Reynolds and divergence.
pub(crate) fn draw(context: &Context) -> anyhow::Result<Section> {
    let example = scene::example()?;
    let film = Film::new(SIDE, SIDE, Filter::Tent)?;
    let arrangement = Arrangement::new(&example.scene, &film)?;
    context.step("exact terms");
    let tent = exact::terms(&example, &arrangement, &film)?;
    let boxed = exact::terms(&example, &arrangement, &film.with_filter(Filter::Box))?;
    let central = exact::central_difference(&example, &film)?;
    context.step("warped-area sampling");
    let estimate = sampled::estimate(context, &example, &film, &tent.total, Weighting::default())?;
    let gaussian = sampled::estimate(context, &example, &film, &tent.total, Weighting::Gaussian)?;
    let results = Results { tent, boxed, central, estimate, gaussian };
    let prose = prose(&results)?;
    let setting = terms_picture::Setting { example: &example, arrangement: &arrangement, film: &film };
    context.png("forms.png", &terms_picture::draw(&setting, &results))?;
    context.png("forms_samples.png", &sampled_picture::draw(&results))?;
    let data = context.csv("forms_pixels.csv", &pixels(&results))?;
    prose.section("forms", vec![data], table(&results))
}

/// Samples that move.
pub(crate) fn draw_motion(context: &Context) -> anyhow::Result<Section> {
    let example = scene::example()?;
    let film = Film::new(SIDE, SIDE, Filter::Tent)?;
    let arrangement = Arrangement::new(&example.scene, &film)?;
    context.step("samples moved by T");
    let side = context.spend(150, 500);
    let samples = Samples::new(&example, &arrangement, Window::FILM, side, context.seed());
    let pairs = sampled::sample_pairs(context, &example, &film)?;
    let moving = Moving { pairs, crossings: crossings(&example, &samples)? };
    let prose = motion_prose(&moving)?;
    context.step("animation");
    let frames = animation::frames(&example, &arrangement, context.spend(20, 48), context.seed())?;
    context.animation("motion.png", &frames, context.spend(120, 50))?;
    context.png("motion_forms.png", &sampled_picture::draw_motion(&moving))?;
    let table = crossing_table(&moving);
    let data = context.csv("motion_crossings.csv", &table)?;
    prose.section("motion", vec![data], Table::default())
}

/// Pairs (θ − θ₀, fraction of samples that see another shape than at θ₀) for each construction.
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

fn crossing_table(moving: &Moving<'_>) -> Table {
    Table::of(
        moving
            .crossings
            .iter()
            .flat_map(|(moved, curve)| curve.iter().map(move |point| (moved.name, *point))),
        &[
            ("construction", &|(name, _)| (*name).into()),
            ("theta", &|(_, [theta, _])| (*theta).into()),
            ("fraction_changed", &|(_, [_, fraction])| (*fraction).into()),
        ],
    )
}

fn pixels(results: &Results) -> Table {
    let Results { tent, boxed, central, estimate, gaussian } = results;
    Table::of(
        0..SIDE * SIDE,
        &[
            ("x", &|i| (i % SIDE).into()),
            ("y", &|i| (i / SIDE).into()),
            ("interior", &|i| tent.interior[*i].into()),
            ("edge_integral", &|i| tent.edge[*i].into()),
            ("area_integral", &|i| tent.area[*i].into()),
            ("total", &|i| tent.total[*i].into()),
            ("central_difference", &|i| central[*i].into()),
            ("box_interior", &|i| boxed.interior[*i].into()),
            ("box_edge_integral", &|i| boxed.edge[*i].into()),
            ("box_area_integral_less_flux", &|i| boxed.area[*i].into()),
            ("box_flux", &|i| boxed.flux[*i].into()),
            ("warped_area", &|i| estimate.mean[*i].into()),
            ("warped_area_standard_error", &|i| estimate.standard_error[*i].into()),
            ("gaussian_weights", &|i| gaussian.mean[*i].into()),
            ("gaussian_weights_standard_error", &|i| gaussian.standard_error[*i].into()),
        ],
    )
}

/// The text on one derivative in its forms.
fn prose(results: &Results) -> anyhow::Result<Prose> {
    let Results { tent, boxed, central, estimate, gaussian } = results;
    Prose::new(
        include_str!("forms.md"),
        &[
            ("rounding", &number(worst_residual(results))),
            ("size", &number(largest(&tent.total))),
            ("central", &number(largest(&difference(central, &tent.total)))),
            ("flux", &number(root_mean_square(&boxed.flux) / root_mean_square(&boxed.total))),
            ("count", &estimate.scores().len()),
            ("z", &number(estimate.root_mean_square_score())),
            ("gaussian", &number(gaussian.root_mean_square_score())),
            ("side", &SIDE),
            ("step", &number(STEP)),
            ("rays", &number(estimate.rays_per_sample())),
            ("settled", &number(SETTLED)),
        ],
    )
}

/// The text on samples that move.
fn motion_prose(moving: &Moving<'_>) -> anyhow::Result<Prose> {
    let (worst, equal) = agreement(&moving.pairs);
    Prose::new(
        include_str!("motion.md"),
        &[
            ("worst", &number(worst)),
            ("equal", &equal),
            ("pairs", &moving.pairs.len()),
            ("none", &power(moving, 0)),
            ("direct", &power(moving, 1)),
            ("aware", &power(moving, 2)),
            ("oracle", &power(moving, 3)),
            ("kernel_width", &number(KERNEL_WIDTH)),
            ("auxiliary_rays", &AUXILIARY_RAYS),
            ("swing", &number(SWING)),
        ],
    )
}

fn worst_residual(results: &Results) -> f64 {
    let residual = |terms: &Terms| largest(&difference(&terms.area, &terms.edge));
    residual(&results.tent).max(residual(&results.boxed))
}

/// The largest difference of two forms relative to the largest sample, and how many agree to the bit.
fn agreement(pairs: &[(f64, f64)]) -> (f64, usize) {
    let size = pairs.iter().map(|(a, _)| a.abs()).fold(0.0, f64::max);
    let apart = pairs.iter().map(|(a, b)| (a - b).abs()).fold(0.0, f64::max);
    (apart / size, pairs.iter().filter(|(a, b)| a == b).count())
}

/// The power of θ − θ₀ with which a construction's fraction grows, by least squares on logarithms over the
/// places where some samples changed.
fn power(moving: &Moving<'_>, construction: usize) -> String {
    let (_, curve) = &moving.crossings[construction];
    let logs: Vec<[f64; 2]> = curve.iter().filter(|p| p[1] > 0.0).map(|p| p.map(f64::ln)).collect();
    let count = logs.len() as f64;
    let [x, y] = [0, 1].map(|axis| logs.iter().map(|p| p[axis]).sum::<f64>() / count);
    let (xy, xx) = logs.iter().fold((0.0, 0.0), |(xy, xx), p| {
        let d = p[0] - x;
        (xy + d * (p[1] - y), xx + d * d)
    });
    format!("{:.1}", xy / xx)
}

/// Sizes of all terms.
fn table(Results { tent, boxed, .. }: &Results) -> Table {
    let sizes = |values: fn(&Terms) -> Vec<f64>| [tent, boxed].map(|terms| root_mean_square(&values(terms)));
    let rows = [
        ("interior term", sizes(|terms| terms.interior.clone())),
        ("edge integral", sizes(|terms| terms.edge.clone())),
        ("area integral less pixel-edge flux", sizes(|terms| terms.area.clone())),
        ("pixel-edge flux", sizes(|terms| terms.flux.clone())),
        ("area integral less flux − edge integral", sizes(|terms| difference(&terms.area, &terms.edge))),
    ];
    Table::of(
        rows,
        &[
            ("quantity (root mean square over pixels)", &|(name, _)| (*name).into()),
            ("tent filter", &|(_, [tent, _])| (*tent).into()),
            ("box filter", &|(_, [_, boxed])| (*boxed).into()),
        ],
    )
}
