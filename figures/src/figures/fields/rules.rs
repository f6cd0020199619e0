//! Measurements of the two rules of a warp field: continuity, and agreement with the boundary velocity.

use flatland::moments::Moments;
use flatland::random::stream;
use glam::DVec2;
use rayon::prelude::*;

use super::constructions::Construction;
use super::example::{Site, WIDTH, cells};
use crate::ratio::Ratio;

/// Half the distance between the two points of a pair, in kernel widths.
pub(super) const OFFSET: f64 = 1e-5;
/// Tolerance on a kept rule in standard errors; 5 make a false alarm in a few hundred points rare.
pub(super) const SIGMAS: f64 = 5.0;
/// Allowed change of a continuous field over a pair, relative to the largest boundary speed: where
/// silhouettes of different motions come near each other it is steep.
pub(super) const SLACK: f64 = 100.0 * OFFSET;

/// Whether a measured number may be zero.
fn vanishes(measured: Ratio) -> bool {
    measured.value.abs() <= SIGMAS * measured.error + SLACK
}

/// The larger magnitude.
fn larger(one: Ratio, other: Ratio) -> Ratio {
    if other.value.abs() > one.value.abs() { other } else { one }
}

/// Measurements on one pair of points, relative to the largest boundary speed.
#[derive(Clone, Copy, Debug)]
pub(super) struct Pair {
    /// |V⁺ − V⁻|.
    pub(super) jump: Ratio,
    /// (V − v)·n on the occluder's side and on the other.
    pub(super) mismatch: [Ratio; 2],
}

/// Measurements of one construction.
pub(super) struct Record {
    /// Pairs at every site of the silhouettes.
    pub(super) silhouettes: Vec<Pair>,
    pub(super) largest_jump: Ratio,
    pub(super) largest_mismatch: Ratio,
    /// Mean mismatch, with the standard error of one site's.
    pub(super) mean_mismatch: Ratio,
    pub(super) continuous: bool,
    pub(super) consistent: bool,
}

impl Record {
    pub(super) fn new(construction: &Construction<'_>, sites: &[Site], speed: f64, seed: u64) -> Self {
        let measure = |list: &[Site], purpose: u64| -> Vec<Pair> {
            let pairs = list.par_iter().enumerate();
            pairs.map(|(i, site)| measure(construction, site, speed, (seed, [purpose, i as u64]))).collect()
        };
        let silhouettes = measure(sites, 2);
        let elsewhere = measure(&borders(), 3);
        let jumps = || silhouettes.iter().chain(&elsewhere).map(|pair| pair.jump);
        let mismatches = || silhouettes.iter().map(|pair| pair.mismatch[0]);
        let mean = |f: fn(Ratio) -> f64| mismatches().map(f).sum::<f64>() / silhouettes.len() as f64;
        Self {
            largest_jump: jumps().fold(Ratio::default(), larger),
            largest_mismatch: mismatches().fold(Ratio::default(), larger),
            mean_mismatch: Ratio { value: mean(|m| m.value.abs()), error: mean(|m| m.error) },
            continuous: jumps().all(vanishes),
            consistent: mismatches().all(vanishes),
            silhouettes,
        }
    }
}

/// Pairs away from silhouettes: the middles of the sides of kernel cells, where the rotation method passes
/// from one kernel to the next.
fn borders() -> Vec<Site> {
    // Every second cell, as on a chessboard; its right and lower side.
    let black = cells().filter(|(cell, _)| (cell[0] + cell[1]) % 2 == 0);
    let sides = black.flat_map(|(_, centre)| {
        [DVec2::X, DVec2::Y].map(|outward| {
            let at = centre + 0.5 * WIDTH * outward;
            Site { at, outward, velocity: DVec2::ZERO, half: DVec2::ZERO }
        })
    });
    sides.collect()
}

/// Compares the field just inside and just outside; both use the same random numbers, which leaves the mean
/// of their difference unchanged and reduces its error.
fn measure(
    construction: &Construction<'_>,
    site: &Site,
    speed: f64,
    (seed, [purpose, index]): (u64, [u64; 2]),
) -> Pair {
    let (field, repeats) = &construction.measured;
    let step = OFFSET * WIDTH * site.outward;
    let mut sums = [Moments::default(); 4];
    for repeat in 0..*repeats {
        let [inside, outside] = [site.at - step, site.at + step]
            .map(|u| field.at(u, &mut stream(seed, &[purpose, index, repeat as u64])).0.value / speed);
        let difference = outside - inside;
        let miss = |value: DVec2| (value - site.velocity / speed).dot(site.outward);
        let values = [difference.x, difference.y, miss(inside), miss(outside)];
        sums.iter_mut().zip(values).for_each(|(sum, value)| sum.push(value));
    }
    let [x, y, inside, outside] = sums.map(|sum| measured(sum, *repeats));
    let jump = Ratio { value: x.value.hypot(y.value), error: x.error.hypot(y.error) };
    Pair { jump, mismatch: [inside, outside] }
}

/// Exactly known fields are measured once.
fn measured(moments: Moments, repeats: usize) -> Ratio {
    let error = if repeats > 1 { moments.standard_error() } else { 0.0 };
    Ratio { value: moments.mean(), error }
}
