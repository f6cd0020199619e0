//! Several starts: short fits from points around the first start; the best is kept.

use std::f64::consts::{PI, TAU};
use std::fmt::Write as _;

use anyhow::{anyhow, bail};
use flatland::random::{open01, stream};
use glam::DVec3;
use indicatif::ProgressBar;
use rand::Rng;
use volume3d::gradient::{Estimator, render};
use volume3d::io::{read_text, write_bytes};
use volume3d::optimize::{Fit, FitError, Group, Quantity, read_checkpoint, write_checkpoint};
use volume3d::scene::Scene;

use super::super::session::silent;
use super::config::Config;
use super::folder::Folder;
use super::problem::reverse;
use super::progress;

/// Number of random points per start; the best of them become starts.
const LOOKED_AT_EACH: usize = 16;

/// A short fit has 1/4 of all steps, at least 10.
const SHORT: (u64, u64) = (4, 10);

/// The largest number of views used to compare points.
const COMPARED: usize = 8;

/// Keys of random streams, distinct from those of the fit.
const PLACES: u64 = 1 << 35;
const LOOKS: u64 = (1 << 35) + 1;

/// Default distance of other starts from the first, in learning rates.
const RATES: f64 = 10.0;

/// A start, with the losses before and after its short fit.
struct Attempt {
    place: usize,
    before: f64,
    after: f64,
}

/// The start that is best after a short fit, with a table of all. Results are saved in the run's folder, so
/// that a resumed run has the same bits.
pub(super) fn best(
    config: &Config,
    fit: &Fit,
    scene: &mut Scene,
    folder: &Folder,
    (estimator, fingerprint): (Estimator, u32),
) -> anyhow::Result<(Vec<f64>, String)> {
    let (kept, table) = (folder.start_path("best")?, folder.file("starts.txt"));
    if let (Some(state), Ok(text)) = (read_checkpoint(&kept, fingerprint)?, read_text(&table)) {
        return Ok((state.x, text));
    }
    let spreads: Vec<f64> = fit
        .parameters()
        .groups()
        .iter()
        .zip(&config.parameters)
        .map(|(group, p)| spread(group, p.spread, p.rate))
        .collect();
    if spreads.iter().all(|spread| *spread == 0.0) {
        bail!(
            "starts = {}, but no parameter has a spread: set spread = … of a [[parameter]], the distance between starts",
            config.starts
        );
    }
    let steps = (config.steps / SHORT.0).max(SHORT.1).min(config.steps);
    let count = config.starts;
    let bar = progress::bar("starts", (count * LOOKED_AT_EACH) as u64 + count as u64 * steps);
    let places = count * LOOKED_AT_EACH;
    let mut losses = vec![];
    for place in 0..places {
        let x = at(fit, &spreads, config.seed, place);
        losses.push(loss(fit, scene, &x, config.gradient.spp)?);
        bar.inc(1);
    }
    // The configured start is always one of them.
    let mut order: Vec<usize> = (1..places).collect();
    order.sort_by(|a, b| losses[*a].total_cmp(&losses[*b]));
    let chosen = std::iter::once(0).chain(order).take(count);
    let mut attempts: Vec<(Attempt, Vec<f64>)> = vec![];
    for (number, place) in chosen.enumerate() {
        let path = folder.start_path(&format!("{:02}", number + 1))?;
        let x = at(fit, &spreads, config.seed, place);
        let fresh = fit.clone().starting_at(x).of_steps(steps);
        let mut short = match read_checkpoint(&path, fingerprint)? {
            Some(state) => fresh.resumed(state, scene).map_err(|why| anyhow!("{}: {why}", path.display()))?,
            None => fresh,
        };
        bar.set_message(format!("start {} of {count}", number + 1));
        let end = to_end(&mut short, scene, estimator.clone(), &bar);
        write_checkpoint(&path, short.state(), fingerprint)?;
        end?;
        let x = short.result().to_vec();
        // With more samples than the points were compared with, and different ones.
        let after = loss(fit, scene, &x, 4 * config.gradient.spp)?;
        attempts.push((Attempt { place, before: losses[place], after }, x));
    }
    bar.finish_and_clear();
    let (attempts, mut values): (Vec<Attempt>, Vec<Vec<f64>>) = attempts.into_iter().unzip();
    let best =
        (0..count).min_by(|&a, &b| attempts[a].after.total_cmp(&attempts[b].after)).unwrap_or_default();
    let (x, text) = (values.swap_remove(best), listed(&attempts, steps, best));
    write_bytes(&table, text.as_bytes())?;
    write_checkpoint(&kept, fit.clone().starting_at(x.clone()).state(), fingerprint)?;
    Ok((x, text))
}

fn to_end(fit: &mut Fit, scene: &mut Scene, estimator: Estimator, bar: &ProgressBar) -> anyhow::Result<()> {
    let estimate = reverse(estimator);
    fit.apply(scene)?;
    while !fit.is_done() {
        fit.step(scene, &estimate, &silent()).map_err(|error| match error {
            FitError::Objective(error) => anyhow!(error),
            error => anyhow!(error),
        })?;
        bar.inc(1);
    }
    Ok(())
}

/// The mean loss over views at x, from renderings with `samples` samples per pixel; infinite if the scene
/// does not allow x.
fn loss(fit: &Fit, scene: &mut Scene, x: &[f64], samples: usize) -> anyhow::Result<f64> {
    let (objective, parameters) = (fit.objective(), fit.parameters());
    if parameters.apply(x, scene).is_err() {
        return Ok(f64::INFINITY);
    }
    let count = objective.views.len().min(COMPARED);
    let mut sum = 0.0;
    for k in 0..count {
        let view = k * objective.views.len() / count;
        objective.look(scene, view)?;
        let image = render(scene, samples, LOOKS + view as u64, &silent())?.image;
        sum += objective.loss_between(scene, parameters, view, [&image, &objective.views[view].target])?;
    }
    Ok(sum / count.max(1) as f64)
}

/// The distance of other points from the start along a parameter. Default: π for rotations, 10 rates for
/// other poses and the camera, and 0 for materials, lights and vertices.
fn spread(group: &Group, given: Option<f64>, rate: f64) -> f64 {
    given.unwrap_or(match group.quantity {
        Quantity::Rotation { .. } => PI,
        Quantity::Translation { .. }
        | Quantity::Scale { .. }
        | Quantity::CameraTranslation
        | Quantity::CameraRotation
        | Quantity::FieldOfView => RATES * rate,
        _ => 0.0,
    })
}

/// A random point around the start; point 0 is the start itself.
fn at(fit: &Fit, spreads: &[f64], seed: u64, place: usize) -> Vec<f64> {
    let (mut x, mut step) = (fit.state().x.clone(), vec![0.0; fit.parameters().len()]);
    if place == 0 {
        return x;
    }
    for (g, (group, &spread)) in fit.parameters().groups().iter().zip(spreads).enumerate() {
        let mut random = stream(seed, &[PLACES, place as u64, g as u64]);
        let step = &mut step[group.range.clone()];
        if group.turns() {
            step.copy_from_slice(&turn(spread.min(PI), &mut random).to_array());
        } else {
            step.iter_mut().for_each(|s| *s = spread * (2.0 * open01(&mut random) - 1.0));
        }
    }
    fit.parameters().retract(&mut x, &step);
    x
}

/// A rotation vector, uniformly distributed over rotations by at most an angle.
fn turn(most: f64, random: &mut impl Rng) -> DVec3 {
    let z = 2.0 * open01(random) - 1.0;
    let (sin, cos) = (TAU * open01(random)).sin_cos();
    let radius = (1.0 - z * z).sqrt();
    // The density of the angle is proportional to 1 − cos(angle).
    let angle = loop {
        let angle = most * open01(random);
        if open01(random) * (1.0 - most.cos()) <= 1.0 - angle.cos() {
            break angle;
        }
    };
    angle * DVec3::new(radius * cos, radius * sin, z)
}

/// A table with a line per start.
fn listed(attempts: &[Attempt], steps: u64, best: usize) -> String {
    let mut text = format!("start   loss before   after {steps} steps\n");
    for (number, Attempt { place, before, after }) in attempts.iter().enumerate() {
        let what = if *place == 0 { "   as configured" } else { "" };
        let kept = if number == best { "   kept" } else { "" };
        let _ = writeln!(text, "{:5}   {before:11.3e}   {after:14.3e}{what}{kept}", number + 1);
    }
    text
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn turns_fill_their_ball_of_rotations() {
        let mut random = stream(1, &[]);
        let angles: Vec<f64> = (0..4000).map(|_| turn(PI, &mut random).length()).collect();
        // The mean angle of a uniform rotation is π/2 + 2/π, with a standard deviation of 0.65.
        let mean = angles.iter().sum::<f64>() / angles.len() as f64;
        assert!((mean - (0.5 * PI + 2.0 / PI)).abs() < 5.0 * 0.65 / 4000f64.sqrt(), "{mean}");
        assert!((0..100).all(|_| turn(0.2, &mut random).length() <= 0.2));
    }
}
