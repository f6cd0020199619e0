//! `volume3d fit`.

mod config;
mod curve;
mod folder;
mod numbers;
mod parameter;
mod problem;
mod report;
mod views;

use std::path::PathBuf;
use std::time::{Duration, Instant};

use anyhow::anyhow;
use clap::Args;
use indicatif::{ProgressBar, ProgressStyle};
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
/// CONFIG.toml says from which scene to start, what to fit, and to which pictures; relative paths in it are from its folder. The
/// shortest that does something:
///
///   scene = "start.xml"
///   steps = 100
///   [reference]                       # or [[view]] with target = "photo.exr"
///   scene = "truth.xml"
///   [[parameter]]
///   name = "block.translation"
///   rate = 0.02
///
/// All that there is; what is said to be a default need not be written:
///
///   seed = 0                          # the default
///   define = { res = "64" }           # for $res in the scene
///   views_per_step = 4                # all, unless given
///   pixels_per_view = 1024            # chosen anew in every step; all, unless given; not for the
///                                     # multiscale loss
///   silhouettes = 2                   # only pixels so near to a silhouette count; all, unless
///                                     # given
///   background = [0, 0, 0]            # under transparent pictures; a constant sky, unless given
///   loss = { kind = "multiscale", levels = 5 }     # the default; or l1, l2, relative with epsilon
///   gradient = { method = "auto", spp = 16, image_spp = 16 }  # the default: a pilot chooses
///                                                             # before the first step
///   schedule = { kind = "cosine", end = 0 }        # the default; or constant, exponential with
///                                                  # end
///   parameter_mean = 0.95             # none, unless given: what is reported and written at the
///                                     # end is the mean of about so many last steps,
///                                     # 1/(1 − 0.95), for rates that do not end at 0
///   [reference]
///   scene = "truth.xml"               # rendered from the camera of each view; its own, if there
///                                     # is a single view without one
///   define = { res = "64" }
///   spp = 1024                        # the default
///   [[view]]                          # one for each picture
///   name = "front"
///   target = "front.png"              # rendered from the reference, unless given
///   encoding = "linear"               # or "srgb": what its integers mean, if not what its file
///                                     # says (cICP, sRGB, gAMA of a PNG)
///   layer = "ViewLayer.Combined"      # of an OpenEXR target: which of several layers, or one
///                                     # channel by the whole of its name
///   weights = "mask.png"              # multiplies the difference of each pixel; 0 to 1, not sRGB
///   mask = "object.png"               # white where the shape of [masks] is seen; for [masks] only
///   origin = [0, 1, 4]                # the scene's camera, unless given
///   look_at = [0, 0, 0]
///   up = [0, 1, 0]                    # the default
///   fov = 40                          # degrees, horizontal
///   width = 128                       # the scene's film, unless given
///   height = 128
///   [[parameter]]                     # named as by --wrt of `volume3d gradient`
///   name = "bunny.vertex_positions"
///   rate = 0.01                       # of Adam, in units of the parameter: about the size of a
///                                     # step
///   large_steps = 20                  # smooth steps of vertices (Nicolet et al. 2021), with one
///                                     # step size; 1 for SHAPE.sdf of a grid
///   redistance = false                # for SHAPE.sdf of a grid: true makes it distances again
///                                     # after every step
///   refine = [80, 160]                # for SHAPE.sdf of a grid: steps after which it has half the
///                                     # spacing, and steps half the rate;
///                                     # of a network: after which its grid has
///   finish = 200                      # for SHAPE.sdf of a network: steps after which it is traced
///                                     # itself, a hundred times slower; never, unless given
///   uniform = false                   # the default; true: one step size without smoothing
///   beta1 = 0.9                       # of Adam: how slowly gradients are forgotten, and their
///                                     # squares
///   beta2 = 0.999
///   clamp = 0.01                      # none, unless given: larger derivatives are cut to it,
///                                     # counted, and biased
///   tie = ["lamp.radiance", "bulb.intensity"]  # others that have the same values, at first those
///                                     # of the first; instead of a name, or besides
///   pivot = [0, 0, 0]                 # of a rotation or scale; the mean of all vertices, or where
///                                     # a light or implicit surface stands, unless given
///   bounds = [0, 1]                   # those of the parameter, unless given
///   start = [0.1, 0, 0]               # where the scene is, unless given
///   [dtu]                             # in the place of views: photographs, masks and cameras as
///                                     # of DTU and IDR
///   folder = "scan65"                 # image/*.png, mask/*.png, cameras.npz; the scene is in the
///                                     # coordinates of its unit ball
///   views = [0, 5, 9]                 # all, unless given
///   cut = false                       # the default; true: outside of masks is the background
///   [masks]                           # besides pictures, as IDR does; then method = "interior"
///                                     # leaves silhouettes to it
///   shape = "thing"                   # an implicit surface
///   center = [0, 0, 0]                # of a ball that it is in, in scene units
///   radius = 1
///   weight = 100                      # in that ball's units, unless given; alpha = 50, doubled
///                                     # five times; samples = 100
///   [[regularizer]]
///   shape = "bunny"
///   kind = "laplacian"                # or edge-length, normal-consistency; eikonal for a network,
///                                     # weight 0.1
///   weight = 0.1
///
/// PNG targets end at 1, and renderings do not: keep pictures below, or take OpenEXR. Steps are those of Adam; L-BFGS is in the
/// library.
///
/// RUN gets the configuration, the loss of every step (loss.csv, loss.svg), pictures of every view, the
/// fitted scene (fit.xml) with its meshes, and report.html, which shows it all. One process at a time is at
/// a run: it locks RUN/lock. The state is kept every few seconds: killed at any moment, the same command
/// goes on, and ends with the same bits. Image and gradient of a step never share samples, so that the
/// gradient of a squared loss is unbiased.
#[derive(Args, Debug)]
#[command(verbatim_doc_comment)]
pub(super) struct Options {
    /// What to fit, and to what.
    #[arg(value_name = "CONFIG.toml")]
    config: PathBuf,
    /// The folder of the run; it is made if there is none, and gone on with if it has begun.
    #[arg(short, long, value_name = "RUN")]
    output: PathBuf,
    #[command(flatten)]
    threads: Threads,
}

/// Ended by a signal, with nothing lost.
#[derive(Debug, thiserror::Error)]
#[error("stopped after step {done} of {steps}; the same command goes on from there")]
pub(super) struct Interrupted {
    done: u64,
    steps: u64,
}

/// How long a state may be out of date.
const KEEP_EVERY: Duration = Duration::from_secs(5);

pub(super) fn run(options: &Options) -> anyhow::Result<Report> {
    options.threads.begin()?;
    let Problem { config, text, mut scene, fit, fingerprint, files } =
        Problem::read(&options.config, &options.output)?;
    signals::hold()?;
    let folder = Folder::open(&options.output, &text, &files)?;
    // Views look at the scene with cameras of their own, but it is written with its own.
    let own = (scene.description().camera.clone(), scene.description().film);
    let kept = folder.state(fingerprint)?;
    fit.apply(&mut scene)?;
    let done = kept.as_ref().map_or(0, |state| state.records.len() as u64);
    signals::release(&Interrupted { done, steps: config.steps }.to_string());
    let stopped = interrupted(done, &config);
    let (estimator, chosen) = problem::chosen(&config, &fit, &mut scene).map_err(stopped)?;
    let is_new = kept.is_none();
    let mut fit = match kept {
        Some(state) => fit
            .resumed(state, &mut scene)
            .map_err(|why| anyhow!("{}: {why}", folder.state_path().display()))?,
        None => fit,
    };
    fit.apply(&mut scene)?;
    let mut text = chosen;
    if is_new {
        say(&problem::missed(&config, &fit, &scene)?);
        say(&problem::contacts(&fit, &scene));
        problem::check_views(&config, &fit, &mut scene).map_err(stopped)?;
        signals::hold().map_err(|e| stopped(e.into()))?;
        folder.begin(&fit, &mut scene).map_err(stopped)?;
    } else {
        text += &format!("goes on after step {} of {}\n", fit.steps_taken(), config.steps);
    }
    signals::hold().map_err(|e| stopped(e.into()))?;
    let from = fit.steps_taken();
    let (start, before) = (Instant::now(), scene.trace_counts());
    let ended = steps(&config, &mut fit, &mut scene, &folder, (estimator, fingerprint));
    // A step that was stopped may have left it to be ended wherever it is.
    let _ = signals::hold();
    folder.keep(&fit, fingerprint)?;
    ended?;
    text += &times(fit.times(), fit.steps_taken() - from, start.elapsed());
    text += &doubts(&fit);
    let taken = fit.steps_taken() - from;
    text += &lost(scene.trace_counts() - before, samples(&config, &fit, taken));
    let (camera, film) = own;
    text += &folder
        .finish(&config, &fit, &mut scene, camera, film)
        .map_err(interrupted(fit.steps_taken(), &config))?;
    Ok(Report { text, outcome: Outcome::Good })
}

fn steps(
    config: &config::Config,
    fit: &mut Fit,
    scene: &mut Scene,
    folder: &Folder,
    (estimator, fingerprint): (Estimator, u32),
) -> anyhow::Result<()> {
    let style = ProgressStyle::with_template("fit {bar:32} {pos}/{len}  {msg}  {elapsed} gone, {eta} to go")
        .unwrap_or_else(|_| ProgressStyle::default_bar());
    let bar = ProgressBar::new(config.steps).with_style(style).with_position(fit.steps_taken());
    bar.reset_eta();
    bar.enable_steady_tick(Duration::from_millis(200));
    let estimate = reverse(estimator);
    let (mut kept, mut last) = (Instant::now(), Duration::ZERO);
    while !fit.is_done() {
        folder.frame(config, fit, scene).map_err(interrupted(fit.steps_taken(), config))?;
        // A long step does not look for signals while it is prepared; everything before it is saved.
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
                "step {}: {error}; the state after {done} steps is in {}, and a new folder takes another configuration",
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
            bar.set_message(format!("loss {:.3e}, rate {:.2}", record.loss, record.factor));
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

/// The message for a signal once the run has a folder: its state is saved.
fn interrupted(done: u64, config: &config::Config) -> impl Fn(anyhow::Error) -> anyhow::Error + Copy + use<> {
    let steps = config.steps;
    move |error| if is_stop(&error) { anyhow!(Interrupted { done, steps }) } else { error }
}

/// Samples of all images and gradients of so many steps.
fn samples(config: &config::Config, fit: &Fit, steps: u64) -> usize {
    let views = &fit.objective().views;
    let pixels: usize = views.iter().map(|view| view.target.pixels.len()).sum();
    let each = config.gradient.spp + fit.objective().image_samples;
    // Every view has its turn in each round.
    (pixels * each).saturating_mul(steps as usize) / fit.round().max(1)
}

/// What speaks against the result.
fn doubts(fit: &Fit) -> String {
    let mut text = String::new();
    let records = &fit.state().records;
    // Every view has its turn in a round.
    let round = fit.round().min(records.len());
    let (first, last) = (&records[..round], &records[records.len() - round..]);
    for (g, group) in fit.parameters().groups().iter().enumerate() {
        if round > 0 && last.iter().all(|record| record.norms[g] == 0.0) {
            text += &format!(
                "WARNING: the gradient by `{}` was 0 in the end: it has left the views; try a smaller rate, or bounds\n",
                group.name
            );
        }
    }
    let sum = |records: &[Record]| records.iter().map(|r| r.loss + r.penalty).sum::<f64>();
    if sum(last) > sum(first) {
        text += "WARNING: the loss is larger than at first; try smaller rates, or more samples\n";
    }
    let lost: usize = records.iter().map(|r| r.non_finite).sum();
    if lost > 0 {
        text += &format!("{lost} samples were not finite and are left out\n");
    }
    let clamped: usize = records.iter().map(|r| r.clamped).sum();
    if clamped > 0 {
        let all = records.len() * fit.state().x.len();
        text += &format!(
            "{clamped} derivatives were clamped, of about {all} in all steps: the gradients were biased\n"
        );
    }
    text
}

/// Where the time of a step went, on average.
fn times(times: Times, steps: u64, whole: Duration) -> String {
    if steps == 0 {
        return String::new();
    }
    let each = |time: Duration| time.as_secs_f64() / steps as f64;
    let Times { update, image, gradient, optimizer } = times;
    format!(
        "{steps} steps in {:.1} s; a step takes {:.4} s for images, {:.4} s for gradients, {:.4} s for the optimiser, {:.4} s to \
         bring the scene up to date\n",
        whole.as_secs_f64(),
        each(image),
        each(gradient),
        each(optimizer),
        each(update)
    )
}
