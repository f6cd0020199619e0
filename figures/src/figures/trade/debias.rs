//! What it costs to remove the bias.

use flatland::estimator::{Construction, WarpedArea};
use flatland::warp::{Debias, Warp};

use super::target::{KAPPA, Spread, Target, seed_of};
use crate::context::Context;
pub(super) use crate::ratio::Ratio;

/// Rays of the consistent estimator that the schemes are compared with.
pub(super) const RAYS: usize = 16;

/// A scheme, with the spread of each of its batches.
pub(super) struct Scheme {
    pub(super) original: bool,
    pub(super) debias: Debias,
    batches: Vec<Spread>,
}

impl Scheme {
    /// Variance × rays of every batch.
    fn costs(&self) -> impl Iterator<Item = f64> {
        self.batches.iter().map(|b| b.variance * b.rays)
    }

    /// The mean of variance × rays over batches, with its standard error.
    pub(super) fn cost(&self) -> Ratio {
        Ratio::of_runs(&self.costs().collect::<Vec<_>>())
    }

    /// The median of variance × rays over batches.
    pub(super) fn median(&self) -> f64 {
        let mut costs: Vec<f64> = self.costs().collect();
        costs.sort_by(f64::total_cmp);
        0.5 * (costs[(costs.len() - 1) / 2] + costs[costs.len() / 2])
    }

    /// cost / reference, first-order errors of both.
    pub(super) fn relative(&self, reference: &Self) -> Ratio {
        self.cost().over(reference.cost())
    }
}

/// The schemes compared: consistent at 16 rays first for either weight, the default weight first.
pub(super) fn schemes(context: &Context, target: &Target) -> anyhow::Result<Vec<Scheme>> {
    let multilevel = |rays, first, ratio| Debias::Multilevel { rays, first, ratio };
    let roulette = |rays, tail| Debias::RussianRoulette { rays, tail };
    let consistent = Debias::Consistent { rays: RAYS };
    let list = [
        (false, consistent),
        (false, Debias::default()),
        (false, multilevel(8, 0.36, 0.37)),
        (false, multilevel(4, 0.5, 0.25)),
        (false, roulette(4, 1.5)),
        (true, consistent),
        (true, Debias::default()),
        (true, multilevel(16, 0.35, 0.35)),
        (true, roulette(16, 1.5)),
    ];
    list.into_iter()
        .enumerate()
        .map(|(i, (original, debias))| scheme(context, target, i, original, debias))
        .collect()
}

fn scheme(
    context: &Context,
    target: &Target,
    index: usize,
    original: bool,
    debias: Debias,
) -> anyhow::Result<Scheme> {
    let (count, budget) = context.spend((16, 10_000), (32, 1_000_000));
    // As many rays for every scheme, so that none looks steadier for having drawn more.
    let samples = (f64::from(budget) / (debias.expected_rays() + 1.0)) as usize;
    let base = if original { Warp::original(RAYS) } else { Warp::default() };
    let warp = Warp { debias, ..base };
    let batches = (0..count)
        .map(|batch| {
            let seed = seed_of(context.seed(), &[5, 4, index as u64, batch]);
            let method = WarpedArea {
                samples,
                construction: Construction::Auxiliary { warp, kappa: KAPPA },
                seed,
                ..WarpedArea::default()
            };
            Ok(target.measure(1, samples, |_| method)?.1)
        })
        .collect::<anyhow::Result<_>>()?;
    Ok(Scheme { original, debias, batches })
}

/// What the scheme is called in the figure.
pub(in crate::figures) fn name(debias: Debias) -> String {
    match debias {
        Debias::Consistent { rays } => format!("consistent, {rays} rays (biased)"),
        Debias::RussianRoulette { rays, tail } => format!("roulette: {rays} rays, tail {tail}"),
        Debias::Multilevel { rays, first, ratio } => format!("multilevel: {rays} rays, {first}, {ratio}"),
    }
}
