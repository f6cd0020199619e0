//! `volume3d fit`.

mod config;
mod curve;
mod folder;
mod message;
mod numbers;
mod parameter;
mod parse;
mod pictures;
mod placed_scene;
mod problem;
mod progress;
mod quality;
mod report;
mod result;
mod starts;
mod views;

use std::path::PathBuf;
use std::time::{Duration, Instant};

use anyhow::anyhow;
use clap::Args;
use volume3d::gradient::{Estimator, GradientError};
use volume3d::optimize::{Fit, FitError, ObjectiveError, Record, Times};
use volume3d::scene::Scene;

use self::folder::Folder;
use self::problem::{Problem, reverse};
use super::report::{Outcome, Report};
use super::session::{Threads, lost, say, silent};
use super::signals::{self, is_stop};

/// Fits parameters of a scene to pictures.
///
/// CONFIG.toml names the initial scene, the parameters to fit and the
/// pictures. Paths are relative to its folder. A minimal example:
///
///   scene = "start.xml"
///   steps = 100
///
///   [[view]]
///   target = "photo.png"
///
///   [[parameter]]
///   name = "bunny.translation"
///   rate = 0.02
///
/// `volume3d fit --example > fit.toml` writes an example that runs,
/// with all keys explained; `volume3d new bunny.obj` writes a scene
/// and a fit for a mesh. Names of parameters are those of `--wrt` of
/// `volume3d gradient`; `volume3d info SCENE` lists the objects.
///
/// PNG targets are clamped to 1, and renderings are not: use targets
/// with smaller values, or OpenEXR. The optimiser is Adam; the library
/// also has L-BFGS.
///
/// Files in RUN: report.html (all results), views.png (overview),
/// fit.xml (the fitted scene, with its meshes), result.toml (values,
/// units, and poses as matrices), loss.csv and loss.svg (the loss of
/// every step), and pictures of every view. One process at a time can
/// use RUN; it locks RUN/lock. The state is saved every few seconds:
/// after an interruption at any time, the same command continues, and
/// ends with the same bits. To continue after the end, raise `steps`
/// and run the same command.
///
/// A warning says that the fit has not reached its pictures if the
/// residual is far above the noise. The exit status is then still 0,
/// and result.toml has `reached = false`.
#[derive(Args, Debug)]
#[command(verbatim_doc_comment)]
pub(super) struct Options {
    /// The configuration.
    #[arg(value_name = "CONFIG.toml", required_unless_present = "example")]
    config: Option<PathBuf>,
    /// The folder of the run. It is created if necessary; a run that
    /// it contains is continued.
    #[arg(short, long, value_name = "RUN", required_unless_present = "example")]
    output: Option<PathBuf>,
    /// Prints a configuration with all keys, which runs in the folder
    /// of the scene.xml of `volume3d new bunny.obj -o .`
    #[arg(long, exclusive = true)]
    example: bool,
    #[command(flatten)]
    threads: Threads,
}

/// Interrupted by a signal after the state was saved.
#[derive(Debug, thiserror::Error)]
#[error("stopped after step {done} of {steps}; the same command continues from there")]
pub(super) struct Interrupted {
    done: u64,
    steps: u64,
}

/// The interval at which the state is saved.
const KEEP_EVERY: Duration = Duration::from_secs(5);

pub(super) fn run(options: &Options) -> anyhow::Result<Report> {
    let (Some(path), Some(output), false) = (&options.config, &options.output, options.example) else {
        return Ok(Report { text: parse::EXAMPLE.to_owned(), outcome: Outcome::Good });
    };
    options.threads.begin()?;
    let Problem { config, text, mut scene, fit, fingerprint, files } = Problem::read(path, output)?;
    signals::hold()?;
    let folder = Folder::open(output, &text, &files)?;
    // Views replace the camera of the scene; the fitted scene is written with the original one.
    let own = (scene.description().camera.clone(), scene.description().film);
    let kept = folder.state(fingerprint)?;
    fit.apply(&mut scene)?;
    let done = kept.as_ref().map_or(0, |state| state.records.len() as u64);
    signals::release(&Interrupted { done, steps: config.steps }.to_string());
    let stopped = interrupted(done, &config);
    let (estimator, chosen) = problem::chosen(&config, &fit, &mut scene).map_err(stopped)?;
    let is_new = kept.is_none();
    if is_new {
        say(&problem::missed(&config, &fit, &scene)?);
        say(&problem::contacts(&fit, &scene));
        problem::check_views(&config, &fit, &mut scene).map_err(stopped)?;
    }
    let mut table = String::new();
    let fit = if config.starts > 1 {
        signals::hold().map_err(|e| stopped(e.into()))?;
        let (x, found) = starts::best(&config, &fit, &mut scene, &folder, (estimator.clone(), fingerprint))
            .map_err(stopped)?;
        table = found;
        fit.starting_at(x)
    } else {
        fit
    };
    let begin = fit.state().x.clone();
    let mut fit = match kept {
        Some(state) => fit
            .resumed(state, &mut scene)
            .map_err(|why| anyhow!("{}: {why}", folder.state_path().display()))?,
        None => fit,
    };
    fit.apply(&mut scene)?;
    let mut text = chosen + &table;
    if is_new {
        signals::hold().map_err(|e| stopped(e.into()))?;
        folder.begin(&fit, &mut scene).map_err(stopped)?;
    } else {
        text += &format!("continues after step {} of {}\n", fit.steps_taken(), config.steps);
    }
    signals::hold().map_err(|e| stopped(e.into()))?;
    let from = fit.steps_taken();
    let (start, before) = (Instant::now(), scene.trace_counts());
    let ended = steps(&config, &mut fit, &mut scene, &folder, (estimator, fingerprint));
    // After a stopped step, a signal might still exit the program wherever it is.
    let _ = signals::hold();
    folder.keep(&fit, fingerprint)?;
    ended?;
    text += &times(fit.times(), fit.steps_taken() - from, start.elapsed());
    text += &doubts(&fit);
    let taken = fit.steps_taken() - from;
    text += &lost(scene.trace_counts() - before, samples(&config, &fit, taken));
    let (words, warning) = folder
        .finish(&config, (&fit, &begin, &table), &mut scene, own)
        .map_err(interrupted(fit.steps_taken(), &config))?;
    say(&warning);
    text += &words;
    Ok(Report { text, outcome: Outcome::Good })
}

fn steps(
    config: &config::Config,
    fit: &mut Fit,
    scene: &mut Scene,
    folder: &Folder,
    (estimator, fingerprint): (Estimator, u32),
) -> anyhow::Result<()> {
    let bar = progress::bar("fit", config.steps).with_position(fit.steps_taken());
    bar.reset_eta();
    let estimate = reverse(estimator);
    let (mut kept, mut last) = (Instant::now(), Duration::ZERO);
    while !fit.is_done() {
        folder.frame(config, fit, scene).map_err(interrupted(fit.steps_taken(), config))?;
        // A long step does not check for signals during its preparation; everything before it is saved.
        let is_long = last > KEEP_EVERY;
        if is_long {
            let (done, steps) = (fit.steps_taken(), config.steps);
            signals::release(&Interrupted { done, steps }.to_string());
        }
        let began = Instant::now();
        fit.step(scene, &estimate, &silent()).map_err(|error| {
            bar.finish_and_clear();
            let (done, place) = (fit.steps_taken(), folder.state_path());
            if is_stopped(&error) {
                return anyhow!(Interrupted { done, steps: config.steps });
            }
            anyhow!(
                "step {}: {error}; the state after {done} steps is in {}; use a new folder for another configuration",
                done + 1,
                place.display()
            )
        })?;
        last = began.elapsed();
        if is_long && signals::hold().is_err() {
            folder.keep(fit, fingerprint)?;
            return Err(anyhow!(Interrupted { done: fit.steps_taken(), steps: config.steps }));
        }
        if let Some(record) = fit.state().records.last() {
            bar.set_message(progress::message(fit, record));
        }
        bar.inc(1);
        if kept.elapsed().max(last) > KEEP_EVERY {
            folder.keep(fit, fingerprint)?;
            kept = Instant::now();
        }
    }
    folder.frame(config, fit, scene).map_err(interrupted(fit.steps_taken(), config))?;
    bar.finish_and_clear();
    Ok(())
}

fn is_stopped(error: &FitError) -> bool {
    matches!(error, FitError::Objective(ObjectiveError::Gradient(GradientError::Stopped(_))))
}

/// Converts the error of a signal to [`Interrupted`], once the run has a folder: its state is saved.
fn interrupted(done: u64, config: &config::Config) -> impl Fn(anyhow::Error) -> anyhow::Error + Copy + use<> {
    let steps = config.steps;
    move |error| if is_stop(&error) { anyhow!(Interrupted { done, steps }) } else { error }
}

/// The number of samples of all images and gradients of `steps` steps.
fn samples(config: &config::Config, fit: &Fit, steps: u64) -> usize {
    let views = &fit.objective().views;
    let pixels: usize = views.iter().map(|view| view.target.pixels.len()).sum();
    let each = config.gradient.spp + fit.objective().image_samples;
    // Each round uses every view once.
    (pixels * each).saturating_mul(steps as usize) / fit.round().max(1)
}

/// Warnings about the result.
fn doubts(fit: &Fit) -> String {
    let mut text = String::new();
    let records = &fit.state().records;
    // Each round uses every view once.
    let round = fit.round().min(records.len());
    let (first, last) = (&records[..round], &records[records.len() - round..]);
    for (g, group) in fit.parameters().groups().iter().enumerate() {
        if round > 0 && last.iter().all(|record| record.norms[g] == 0.0) {
            text += &format!(
                "WARNING: the gradient by `{}` was 0 at the end: it has left all views; try a smaller rate, or bounds\n",
                group.name
            );
        }
    }
    let sum = |records: &[Record]| records.iter().map(|r| r.loss + r.penalty).sum::<f64>();
    if sum(last) > sum(first) {
        text += "WARNING: the loss is larger than at the start; try smaller rates, or more samples\n";
    }
    let lost: usize = records.iter().map(|r| r.non_finite).sum();
    if lost > 0 {
        text += &format!("{lost} samples were not finite and are left out\n");
    }
    let clamped: usize = records.iter().map(|r| r.clamped).sum();
    if clamped > 0 {
        let all = records.len() * fit.state().x.len();
        text += &format!(
            "{clamped} of about {all} derivatives were clamped, over all steps: the gradients were biased\n"
        );
    }
    text
}

/// The mean times of a step.
fn times(times: Times, steps: u64, whole: Duration) -> String {
    if steps == 0 {
        return String::new();
    }
    let each = |time: Duration| time.as_secs_f64() / steps as f64;
    let Times { update, image, gradient, optimizer } = times;
    format!(
        "{steps} step{} in {:.1} s; per step {:.4} s for images, {:.4} s for gradients, {:.4} s for the optimiser, {:.4} s \
         for updates of the scene\n",
        if steps == 1 { "" } else { "s" },
        whole.as_secs_f64(),
        each(image),
        each(gradient),
        each(optimizer),
        each(update)
    )
}
