//! The numbers of `forms.md`.

use super::Results;
use super::animation::SWING;
use super::crossing::{AUXILIARY_RAYS, KERNEL_WIDTH};
use super::exact::{STEP, Terms, difference};
use super::sampled::SETTLED;
use super::scene::SIDE;
use crate::figures::common::{largest, root_mean_square};
use crate::output::Table;
use crate::plot::number;
use crate::prose::Prose;

/// The text on one derivative in its forms.
pub(super) fn prose(results: &Results<'_>) -> anyhow::Result<Prose> {
    let Results { tent, boxed, central, estimate, gaussian, pairs, .. } = results;
    let (worst, equal) = agreement(pairs);
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
            ("worst", &number(worst)),
            ("equal", &equal),
            ("pairs", &pairs.len()),
            ("none", &power(results, 0)),
            ("direct", &power(results, 1)),
            ("aware", &power(results, 2)),
            ("oracle", &power(results, 3)),
            ("side", &SIDE),
            ("step", &number(STEP)),
            ("rays", &number(estimate.rays_per_sample())),
            ("settled", &number(SETTLED)),
            ("kernel_width", &number(KERNEL_WIDTH)),
            ("auxiliary_rays", &AUXILIARY_RAYS),
            ("swing", &number(SWING)),
        ],
    )
}

fn worst_residual(results: &Results<'_>) -> f64 {
    let residual = |terms: &Terms| largest(&difference(&terms.area, &terms.edge));
    residual(&results.tent).max(residual(&results.boxed))
}

/// The largest difference of two forms relative to the largest sample, and how many agree to the bit.
fn agreement(pairs: &[(f64, f64)]) -> (f64, usize) {
    let size = pairs.iter().map(|(a, _)| a.abs()).fold(0.0, f64::max);
    let apart = pairs.iter().map(|(a, b)| (a - b).abs()).fold(0.0, f64::max);
    (apart / size, pairs.iter().filter(|(a, b)| a == b).count())
}

/// The power of θ − θ₀ with which a construction's fraction grows, by least squares on logarithms over
/// the places where some samples changed.
fn power(results: &Results<'_>, construction: usize) -> String {
    let (_, curve) = &results.crossings[construction];
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
pub(super) fn table(Results { tent, boxed, .. }: &Results<'_>) -> Table {
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
