//! Error of V against the silhouettes' velocity at the last rays that hit, by the maximum number of steps of
//! a ray, and the steepness of V.

use flatland::random::{open01, stream};
use flatland::sdf::exact::Silhouette;
use flatland::sdf::fields::{BangaruField, TracedField, ViciniField};
use flatland::sdf::{End, Sdf, Tracer, View};
use flatland::warp::{Circle as Directions, LinearField as _};
use glam::DVec2;

use super::world::{REACH, World};
use crate::plot::number;
use crate::ratio::Ratio;
use crate::seeds::seed_of;

/// One set of parameters.
pub(super) struct Setting {
    pub(super) name: String,
    /// (steps, relative error of V at the last rays that hit).
    pub(super) points: Vec<[f64; 2]>,
}

/// γ of the studies.
const GAMMAS: [f64; 5] = [1.0, 1.5, 2.0, 3.0, 6.0];
/// Independent runs of the mean square of ∇·V.
const RUNS: usize = 8;

/// The mean square of ∇·V over directions that hit, with one γ.
pub(super) struct Steepness {
    pub(super) gamma: f64,
    pub(super) square: Ratio,
}

/// Number of bisections of a silhouette, which suffices for rounding accuracy.
const BISECTIONS: usize = 48;

/// Σ |V − v|/Σ |v| over the ends of the discs before the black background, with V at the last rays that hit
/// and v the silhouettes' angular velocities.
///
/// The field is an exact function of ω. The area integral of ∇·V over an interval of rays that hit is V at
/// its ends, so that the error of V there is the entire bias for such discs of uniform brightness.
fn error_of_last_hits(
    world: &World,
    field: &impl TracedField<Directions>,
    steps: usize,
) -> anyhow::Result<f64> {
    let tracer = Tracer { max_steps: steps, far: 8.0, ..Tracer::default() };
    let (mut wrong, mut size) = (0.0, 0.0);
    // Ends towards the black background: inside is the brighter side.
    let ends = world.silhouettes()?.into_iter().filter(|s| s.before == 0.0 || s.after == 0.0);
    for silhouette in ends {
        let inward = if silhouette.after > silhouette.before { 1.0 } else { -1.0 };
        let found = world.rate(field, tracer, last_hit(world, tracer, &silhouette, inward));
        wrong += (found - silhouette.rate).abs();
        size += silhouette.rate.abs();
    }
    Ok(wrong / size)
}

/// The outermost direction, near a silhouette, that still hits within the steps allowed.
fn last_hit(world: &World, tracer: Tracer, silhouette: &Silhouette, inward: f64) -> f64 {
    let view = View { tracer, ..world.scene.view() };
    let hits =
        |offset: f64| view.trace(DVec2::from_angle(silhouette.angle + inward * offset)).end == End::Hit;
    let (mut out, mut inside) = (0.0, 0.05);
    for _ in 0..BISECTIONS {
        let middle = 0.5 * (out + inside);
        if hits(middle) { inside = middle } else { out = middle }
    }
    silhouette.angle + inward * inside
}

fn setting(
    world: &World,
    name: String,
    field: &impl TracedField<Directions>,
    most: usize,
) -> anyhow::Result<Setting> {
    // Twice as many steps each time.
    let steps = std::iter::successors(Some(25), |n| Some(2 * n)).take_while(|n| *n <= most);
    let points = steps.map(|n| Ok([n as f64, error_of_last_hits(world, field, n)?]));
    Ok(Setting { name, points: points.collect::<anyhow::Result<_>>()? })
}

/// Bangaru et al. with several γ.
pub(super) fn gammas(world: &World, most: usize) -> anyhow::Result<Vec<Setting>> {
    let with = |gamma: f64| {
        let field = BangaruField { gamma, ..BangaruField::default() };
        setting(world, format!("γ = {gamma}"), &field, most)
    };
    GAMMAS.into_iter().map(with).collect()
}

/// The variance due to each γ: E (∇·V)² over directions that hit. It diverges logarithmically towards
/// silhouettes, from inside, so that it depends slightly on the number of directions.
pub(super) fn steepness(world: &World, count: usize, seed: u64) -> Vec<Steepness> {
    let of = |gamma: f64| {
        let field = BangaruField { gamma, ..BangaruField::default() };
        let run = |run: usize| mean_square(world, &field, count, seed_of(seed, &[9, 1, run as u64]));
        Steepness { gamma, square: Ratio::of_runs(&(0..RUNS).map(run).collect::<Vec<_>>()) }
    };
    GAMMAS.into_iter().map(of).collect()
}

/// The mean of (∇·V)² over those of `count` directions that hit.
fn mean_square(world: &World, field: &BangaruField, count: usize, seed: u64) -> f64 {
    let view = world.scene.view();
    let mut rng = stream(seed, &[]);
    let (mut sum, mut hits) = (0.0, 0);
    for _ in 0..count {
        let trace = view.trace(DVec2::from_angle(REACH * (2.0 * open01(&mut rng) - 1.0)));
        if trace.end == End::Hit {
            let form = field.form_of::<Directions>(&view, &trace);
            let found = form.field(|x| world.scene.shape().rate(*x, &world.direction));
            sum += found.divergence * found.divergence;
            hits += 1;
        }
    }
    sum / f64::from(hits.max(1))
}

/// Bangaru et al. with several λ, and Vicini et al. with several ε.
pub(super) fn lambdas(world: &World, most: usize) -> anyhow::Result<Vec<Setting>> {
    let with = |lambda: f64| {
        let field = BangaruField { lambda, ..BangaruField::default() };
        setting(world, format!("λ = {lambda}"), &field, most)
    };
    let mut found: Vec<Setting> = [0.01, 0.1, 1.0].into_iter().map(with).collect::<anyhow::Result<_>>()?;
    for epsilon in [1e-3, 1e-6] {
        let field = ViciniField { epsilon, ..ViciniField::default() };
        found.push(setting(world, format!("Vicini, ε = {}", number(epsilon)), &field, most)?);
    }
    Ok(found)
}
