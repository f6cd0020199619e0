//! `volume3d check`.

use std::fmt::Write as _;
use std::time::Instant;

use clap::Args;
use clap::error::ErrorKind;
use volume3d::check::{Check, Checked, Estimate, RESOLUTION, RUNS, Slope, Verdict};
use volume3d::gradient::Tangent;

use super::contact;
use super::gradient::step;
use super::method::MethodOptions;
use super::missing::left_out;
use super::movement::{Moves, change};
use super::one_sided::one_sided;
use super::report::{Outcome, Report, usage};
use super::session::{Bar, RunOptions, SceneOptions, check_size, located};
use super::signals::stop_if_asked;
use super::spp::samples;

/// Validates a gradient: compares the method with central finite differences at several steps.
///
/// Both estimate one number, the weighted total of the gradient image. The weights, between -1 and 1, come
/// from a third, independent estimate of the gradient, so that parts of opposite sign do not cancel. Standard
/// errors are those of 16 independent runs; they include noise that pixels share. All steps use the same
/// random numbers.
///
/// The table lists for each step the slope by finite differences, its standard error, a bound on its error
/// due to the step, z (the difference between method and slope in standard errors), and the relative
/// difference. Large steps are biased. Small steps are noisy: few samples, or none, see a silhouette move.
/// Every step except the largest therefore has bounds on the true slope. They allow for the noise of 16 runs,
/// for samples like the largest one that was seen, for a change of the brightest pixel that no sample saw,
/// and for an error that falls at least in proportion to the step, whatever its sign. The second largest
/// step allows for the whole difference from the largest.
///
/// The verdict is DIFFER if the method is outside the bounds of any step. This happens in at most one of 900
/// checks of a correct gradient.
///
/// At a bound of a parameter's range, such as a radiance of 0 or a roughness of 1, finite differences are
/// one-sided; a line says so.
///
/// The verdict is AGREE if the narrowest bounds are within a tenth of the slope, and OPEN if noise or steps
/// leave wider ones: then raise --spp as advised. It is NOTHING CHANGES if neither the method nor finite
/// differences see a change.
///
/// Exit status: 0 for AGREE; 1 for DIFFER and NOTHING CHANGES; 3 for OPEN.
///
/// Example: volume3d check scene.xml --move box:translate:1,0,0 --spp 1024
#[derive(Args, Debug)]
pub(super) struct Options {
    #[command(flatten)]
    scene: SceneOptions,
    #[command(flatten)]
    moves: Moves,
    #[command(flatten)]
    method: MethodOptions,
    /// Steps of finite differences [default: the fastest parameter moves by 3e-2, 1e-2, 3e-3, 1e-3 and 3e-4
    /// of the scene's size, of a radian, or of a unit of radiance, intensity, reflectance or roughness]. The
    /// largest is left out if it leaves the range of a parameter.
    #[arg(long, value_name = "H,…", value_delimiter = ',', value_parser = step, allow_negative_numbers = true)]
    steps: Vec<f64>,
    /// Samples per pixel, the sum over all 16 runs.
    #[arg(long, value_name = "N", default_value_t = 256, value_parser = samples)]
    spp: usize,
    #[command(flatten)]
    run: RunOptions,
}

pub(super) fn run(options: &Options) -> anyhow::Result<Report> {
    options.method.check("check", false)?;
    let error = |kind, text: &str| Err(usage("check", kind, text.to_owned()));
    if options.moves.moves.is_empty() {
        return error(ErrorKind::MissingRequiredArgument, "say what changes: --move");
    }
    if options.method.is_finite_difference() {
        let text = "finite differences are the reference of a check; choose another --method";
        return error(ErrorKind::ArgumentConflict, text);
    }
    options.run.begin()?;
    let loaded = options.scene.load()?;
    check_size(options.scene.path(), loaded.scene.size())?;
    let change = change(&loaded.scene, &options.moves.moves)?;
    if change == Tangent::still(&loaded.scene) {
        let text = "NOTHING CHANGES: all rates of --move are 0, or cancel\n".to_owned();
        return Ok(Report { text, outcome: Outcome::Bad });
    }
    let start = Instant::now();
    let samples = options.spp.div_ceil(RUNS);
    let check = Check { samples, steps: options.steps.clone(), seed: options.run.seed };
    let bar = Bar::new(1, "check");
    let estimator = options.method.estimator(samples, options.run.seed, None);
    let checked = check.run(&loaded.scene, &change, &estimator, &bar.progress())?;
    drop(bar);
    let Checked { method, slopes, verdict, choice, .. } = checked;
    let mut text = choice.map(|choice| format!("{choice}\n")).unwrap_or_default();
    text += &located(&checked.non_finite);
    text += &left_out(&checked.left_out);
    text += &one_sided(checked.one_sided.iter().map(|(step, found)| (*step, found)));
    text += &contact::parted(&loaded.scene, &change.positions);
    stop_if_asked()?;
    table(&mut text, method, &slopes);
    let outcome = conclude(&mut text, verdict, samples * RUNS);
    let _ = writeln!(text, "{} spp in {RUNS} runs, {:.2} s", samples * RUNS, start.elapsed().as_secs_f64());
    Ok(Report { text, outcome })
}

fn table(text: &mut String, method: Estimate, slopes: &[Slope]) {
    let Estimate { mean, error, .. } = method;
    let _ = writeln!(text, "weighted total by the method: {mean:.5e} ± {error:.1e}\n");
    let _ = writeln!(text, "      step         slope  ± noise  ± step      z  relative difference");
    for slope in slopes {
        let (Slope { step, estimate, .. }, bias) = (slope, slope.bias());
        let z = method.z(*estimate);
        let relative = 100.0 * (mean - estimate.mean) / estimate.mean;
        let relative = if relative.is_finite() { format!("{relative:.2}%") } else { "-".to_owned() };
        let Estimate { mean, error, .. } = estimate;
        let bias = if bias.is_finite() { format!("{bias:7.1e}") } else { "-".to_owned() };
        let _ = writeln!(text, "{step:10.3e}  {mean:12.5e}  {error:7.1e} {bias:>7}  {z:5.1}  {relative:>19}");
    }
    text.push('\n');
}

/// Appends the verdict with advice, and returns the outcome.
fn conclude(text: &mut String, verdict: Verdict, samples: usize) -> Outcome {
    let percent = |x: f64| 100.0 * x;
    let (outcome, words) = match verdict {
        Verdict::Agrees { step, within } => {
            let within = percent(within);
            (Outcome::Good, format!("AGREE within {within:.1}%, the resolution at step {step:.1e}"))
        }
        Verdict::Differs { step, by } => {
            let by = if by.is_finite() { format!(" by {:.1}%", percent(by)) } else { String::new() };
            let than = "more than noise, unseen samples and the step's error explain";
            (Outcome::Bad, format!("DIFFER{by} at step {step:.1e}: {than}"))
        }
        Verdict::Open { within, more } => {
            let seen = if within.is_finite() {
                format!("a difference below {:.0}% would not be detected", percent(within))
            } else {
                "no slope was found to compare with".to_owned()
            };
            let wanted = percent(RESOLUTION);
            let advice = match more {
                Some(more) => {
                    let spp = (more * samples as f64).ceil();
                    format!("about --spp {spp:.0} resolves {wanted:.0}%, unless tails are heavy")
                }
                None if within.is_finite() => format!("give smaller --steps to resolve {wanted:.0}%"),
                None => {
                    "give a change that changes the image, more --spp and at least two --steps".to_owned()
                }
            };
            (Outcome::Open, format!("OPEN: {seen}; {advice}"))
        }
        Verdict::Nothing => {
            let words = "NOTHING CHANGES: the method and finite differences give exactly 0 at every pixel; \
                         neither what moves nor its shadow is visible";
            (Outcome::Bad, words.to_owned())
        }
    };
    let _ = writeln!(text, "{words}");
    outcome
}
