//! Cost of removing the bias.

use flatland::estimator::{Construction, Method, WarpedArea};
use flatland::warp::{Debias, Warp};

use super::target::{KAPPA, Target};
use crate::context::Context;
use crate::figures::common::median;
use crate::ratio::Ratio;
use crate::seeds::seed_of;

/// Rays of the consistent estimator used as the baseline of the schemes.
pub(super) const RAYS: usize = 16;

/// A debiasing scheme.
pub(super) struct Scheme {
    pub(super) original: bool,
    pub(super) debias: Debias,
    /// Variance × rays of a sample, the mean over batches.
    pub(super) cost: Ratio,
    /// The median over batches.
    pub(super) median: f64,
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
    let (count, budget) = context.spend((16, 10_000), (32, 1_000_000));
    let scheme = |(index, (original, debias)): (usize, (bool, Debias))| {
        // An equal number of rays for every scheme, so that none looks steadier for having drawn more.
        let samples = (f64::from(budget) / (debias.expected_rays() + 1.0)) as usize;
        let base = if original { Warp::original(RAYS) } else { Warp::default() };
        let warp = Warp { debias, ..base };
        let batch = |batch| {
            let seed = seed_of(context.seed(), &[5, 4, index as u64, batch]);
            let (_, spread) = target.measure(1, samples, |_| warped(warp, samples, seed))?;
            Ok(spread.variance * spread.rays)
        };
        let costs = (0..count).map(batch).collect::<anyhow::Result<Vec<f64>>>()?;
        Ok(Scheme { original, debias, cost: Ratio::of_runs(&costs), median: median(&costs) })
    };
    list.into_iter().enumerate().map(scheme).collect()
}

/// Warped area with auxiliary rays at the study's κ.
pub(super) fn warped(warp: Warp, samples: usize, seed: u64) -> Box<dyn Method> {
    let construction = Construction::Auxiliary { warp, kappa: KAPPA };
    Box::new(WarpedArea { samples, construction, seed, ..WarpedArea::default() })
}

/// The scheme's name in the figure.
pub(in crate::figures) fn name(debias: Debias) -> String {
    match debias {
        Debias::Consistent { rays } => format!("consistent, {rays} rays (biased)"),
        Debias::RussianRoulette { rays, tail } => format!("roulette: {rays} rays, tail {tail}"),
        Debias::Multilevel { rays, first, ratio } => format!("multilevel: {rays} rays, {first}, {ratio}"),
    }
}
