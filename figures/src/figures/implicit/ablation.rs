//! What is left of the bias, against the steps a ray may take.

use flatland::sdf::exact::Silhouette;
use flatland::sdf::fields::{BangaruField, TracedField, ViciniField};
use flatland::sdf::{End, Tracer, View};
use flatland::warp::Circle as Directions;
use glam::DVec2;

use super::world::World;

/// One set of parameters.
pub(super) struct Setting {
    pub(super) name: String,
    /// (steps, relative error of the derivative).
    pub(super) points: Vec<[f64; 2]>,
}

/// Bisections of a silhouette: to rounding.
const BISECTIONS: usize = 48;

/// The bias of Σ dα/dθ over the ends of the discs before the black background, relative to the sum of magnitudes.
///
/// The field is an exact function of ω, so that the area integral of white discs on black is V at the
/// last rays that hit: what it gets wrong there is all its bias.
fn bias(world: &World, field: &impl TracedField<Directions>, steps: usize) -> anyhow::Result<f64> {
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

/// Twice as many steps each time.
pub(super) fn steps(most: usize) -> Vec<usize> {
    std::iter::successors(Some(25), |n| Some(2 * n)).take_while(|n| *n <= most).collect()
}

fn setting(
    world: &World,
    name: String,
    field: &impl TracedField<Directions>,
    most: usize,
) -> anyhow::Result<Setting> {
    let points = steps(most).into_iter().map(|n| Ok([n as f64, bias(world, field, n)?]));
    Ok(Setting { name, points: points.collect::<anyhow::Result<_>>()? })
}

/// Bangaru et al. with several γ.
pub(super) fn gammas(world: &World, most: usize) -> anyhow::Result<Vec<Setting>> {
    let with = |gamma: f64| {
        let field = BangaruField { gamma, ..BangaruField::default() };
        setting(world, format!("γ = {gamma}"), &field, most)
    };
    [1.0, 1.5, 2.0, 3.0, 6.0].into_iter().map(with).collect()
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
        found.push(setting(world, format!("Vicini, ε = {epsilon}"), &field, most)?);
    }
    Ok(found)
}
