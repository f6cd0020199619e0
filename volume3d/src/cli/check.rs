//! `volume3d check`.

use std::fmt::Write as _;
use std::time::Instant;

use clap::Args;
use clap::error::ErrorKind;
use flatland::random::stream;
use glam::DVec3;
use rand::Rng;
use volume3d::gradient::{FiniteDifference, GradientError, Tangent};
use volume3d::io::signed_range;
use volume3d::scene::Scene;

use super::comparison::{Estimate, RESOLUTION, Slope, TOLERATED, Verdict, verdict};
use super::extent;
use super::gradient::step;
use super::method::{Estimator, MethodOptions};
use super::missing::left_out;
use super::movement::{Moves, change};
use super::session::{Bar, RunOptions, SceneOptions, located, silent, stop_if_asked};
use super::spp::samples;
use super::{Outcome, Report, contact, usage};

/// Validates a gradient: the method against central finite differences, at several steps.
///
/// Both estimate one number, the weighted total of the gradient image. Its weights are a third, independent estimate of
/// the gradient, so that parts of opposite sign do not cancel and every pixel counts as it should. The error of that
/// number is taken from 16 independent runs, so that noise which pixels have in common is counted in full; all steps see
/// the same random numbers.
///
/// The table gives for every step the slope by finite differences, z (how many standard errors the method is off), and
/// the relative difference. Large steps are biased by ~ step², small ones are noisy; the verdict uses the step with the
/// smallest sum of both.
///
/// AGREE means that no difference of a tenth of the slope or more is left: four standard errors and what the step
/// explains are less than that. OPEN means that noise or steps leave more; raise --spp as it says. Where neither the
/// method nor differences see any change there is nothing to check, and that is said.
///
/// Exit status: 0 if they agree; 1 if they differ, or nothing changes; 3 if it is open.
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
    /// Steps of finite differences; unless given, those at which the fastest parameter moves by 1e-2, 3e-3, 1e-3 and
    /// 3e-4 of the scene's size, of a radian, or of a unit of radiance, intensity, reflectance or roughness.
    #[arg(long, value_name = "H,…", value_delimiter = ',', value_parser = step, allow_negative_numbers = true)]
    steps: Vec<f64>,
    /// Samples a pixel, in all runs together.
    #[arg(long, value_name = "N", default_value_t = 256, value_parser = samples)]
    spp: usize,
    #[command(flatten)]
    run: RunOptions,
}

/// Independent runs of each estimate.
const RUNS: usize = 16;

/// Samples a pixel of the weights: they may be noisy.
const WEIGHT_SAMPLES: usize = 16;

/// What tells the seeds of the three estimates apart.
const WEIGHTS: u64 = 1;
const METHOD: u64 = 2;
const CHOICE: u64 = 4;
const DIFFERENCES: u64 = 3;

pub(super) fn run(options: &Options) -> anyhow::Result<Report> {
    options.method.check("check", false)?;
    let error = |kind, text: &str| Err(usage("check", kind, text.to_owned()));
    if options.moves.moves.is_empty() {
        return error(ErrorKind::MissingRequiredArgument, "say what changes: --move");
    }
    if options.method.is_finite_difference() {
        let text = "finite differences are what others are checked against; name another --method";
        return error(ErrorKind::ArgumentConflict, text);
    }
    options.run.begin()?;
    let loaded = options.scene.load()?;
    let change = change(&loaded.scene, &options.moves.moves)?;
    if change == Tangent::still(&loaded.scene) {
        let text = "NOTHING CHANGES: all rates of --move are 0, or their sum is\n".to_owned();
        return Ok(Report { text, outcome: Outcome::Bad });
    }
    let mut steps =
        if options.steps.is_empty() { extent::steps(&loaded.scene, &change) } else { options.steps.clone() };
    steps.sort_by(|a, b| b.total_cmp(a));
    steps.dedup();

    let start = Instant::now();
    let mut check = Check::new(options, &loaded.scene, &change, steps.len() + 1);
    let weights = check.weights(steps[0])?;
    let method = Estimate::of(&check.method(&weights)?);
    let totals: Vec<Vec<f64>> =
        steps.iter().map(|&h| check.differences(h, &weights)).collect::<Result<_, _>>()?;
    let slopes = slopes(&steps, &totals);
    let mut text = check.messages;
    text += &contact::parted(&loaded.scene, &change.positions);
    stop_if_asked()?;
    table(&mut text, method, &slopes);
    let outcome = conclude(&mut text, verdict(method, &slopes), check.samples * RUNS);
    let _ =
        writeln!(text, "{} spp in {RUNS} runs, {:.2} s", check.samples * RUNS, start.elapsed().as_secs_f64());
    Ok(Report { text, outcome })
}

/// What all estimates share.
struct Check<'a> {
    options: &'a Options,
    scene: &'a Scene,
    change: &'a Tangent,
    /// Samples a pixel of one run.
    samples: usize,
    bar: Bar,
    messages: String,
}

impl<'a> Check<'a> {
    fn new(options: &'a Options, scene: &'a Scene, change: &'a Tangent, estimates: usize) -> Self {
        let samples = options.spp.div_ceil(RUNS);
        let bar = Bar::new(estimates * RUNS, "check");
        Self { options, scene, change, samples, bar, messages: String::new() }
    }

    /// A rough gradient image, without its few largest values, which are noise more often than not.
    fn weights(&self, step: f64) -> Result<Vec<DVec3>, GradientError> {
        let seed = self.seed(WEIGHTS, 0);
        let method = FiniteDifference { samples: WEIGHT_SAMPLES, step, seed };
        let image = method.forward(self.scene, self.change, &silent())?.gradient;
        let range = DVec3::splat(signed_range(&image));
        if range.x == 0.0 {
            return Ok(vec![DVec3::ONE; image.pixels.len()]);
        }
        Ok(image.pixels.iter().map(|p| p.clamp(-range, range)).collect())
    }

    /// The weighted totals of all runs of the method.
    fn method(&mut self, weights: &[DVec3]) -> Result<Vec<f64>, GradientError> {
        // Chosen once for all runs, which have seeds of their own.
        let estimator = self.options.method.estimator(self.samples, self.seed(CHOICE, 0), None);
        let (estimator, chosen) = estimator.chosen(|p| p.for_change(self.scene, self.change, &silent()))?;
        self.messages += &chosen;
        self.totals(weights, |check, r| estimator.reseeded(check.seed(METHOD, r)))
    }

    /// The same of finite differences with one step.
    fn differences(&mut self, step: f64, weights: &[DVec3]) -> Result<Vec<f64>, GradientError> {
        self.totals(weights, |check, r| {
            let (samples, seed) = (check.samples, check.seed(DIFFERENCES, r));
            Estimator::FiniteDifference(FiniteDifference { samples, step, seed })
        })
    }

    fn totals(
        &mut self,
        weights: &[DVec3],
        estimator: impl Fn(&Self, usize) -> Estimator,
    ) -> Result<Vec<f64>, GradientError> {
        let mut totals = vec![];
        for r in 0..RUNS {
            let result = estimator(self, r).forward(self.scene, self.change, false, &silent())?;
            totals.push(result.gradient.pixels.iter().zip(weights).map(|(g, w)| g.dot(*w)).sum());
            self.messages += &located(&result.non_finite);
            if r == 0 {
                self.messages += &left_out(&result.left_out);
            }
            self.bar.step();
        }
        Ok(totals)
    }

    /// Every run's own.
    fn seed(&self, purpose: u64, run: usize) -> u64 {
        stream(self.options.run.seed, &[purpose, run as u64]).next_u64()
    }
}

/// Finite differences at all steps, from large to small, with what each is off for its step: for h and the next
/// larger H it is (F(H) − F(h))/((H/h)² − 1), whose noise counts as well. At the largest step it is what the next smaller
/// one says, times (H/h)²; a single step says nothing.
fn slopes(steps: &[f64], totals: &[Vec<f64>]) -> Vec<Slope> {
    let bias = |i: usize| {
        let (large, small) = if i == 0 { (0, 1) } else { (i - 1, i) };
        let Some(smaller) = totals.get(small) else { return f64::INFINITY };
        let square = (steps[large] / steps[small]).powi(2);
        let differences: Vec<f64> = totals[large].iter().zip(smaller).map(|(a, b)| a - b).collect();
        let Estimate { mean, error } = Estimate::of(&differences);
        let of_small = (mean.abs() + error) / (square - 1.0);
        if i == 0 { square * of_small } else { of_small }
    };
    let slope = |(i, &step): (usize, &f64)| Slope { step, estimate: Estimate::of(&totals[i]), bias: bias(i) };
    steps.iter().enumerate().map(slope).collect()
}

fn table(text: &mut String, method: Estimate, slopes: &[Slope]) {
    let Estimate { mean, error } = method;
    let _ = writeln!(text, "weighted total by the method: {mean:.5e} ± {error:.1e}\n");
    let _ = writeln!(text, "      step         slope  ± noise  ± step      z  relative difference");
    for Slope { step, estimate, bias } in slopes {
        let z = method.z(*estimate);
        let relative = 100.0 * (mean - estimate.mean) / estimate.mean;
        let relative = if relative.is_finite() { format!("{relative:.2}%") } else { "-".to_owned() };
        let Estimate { mean, error } = estimate;
        let _ =
            writeln!(text, "{step:10.3e}  {mean:12.5e}  {error:7.1e} {bias:7.1e}  {z:5.1}  {relative:>19}");
    }
    text.push('\n');
}

/// Says what the verdict is, and what to do.
fn conclude(text: &mut String, verdict: Verdict, samples: usize) -> Outcome {
    let percent = |x: f64| 100.0 * x;
    let (outcome, words) = match verdict {
        Verdict::Agrees { step, within } => {
            let within = percent(within);
            (Outcome::Good, format!("AGREE within {within:.1}%, the resolution at step {step:.1e}"))
        }
        Verdict::Differs { step, by } => {
            let by = if by.is_finite() { format!(" by {:.1}%", percent(by)) } else { String::new() };
            let than = format!("more than {TOLERATED} standard errors and what the step explains");
            (Outcome::Bad, format!("DIFFER{by} at step {step:.1e}: {than}"))
        }
        Verdict::Open { within, more } => {
            let seen = if within.is_finite() {
                format!("a difference below {:.0}% would not be seen", percent(within))
            } else {
                "no slope is seen that a difference could be compared with".to_owned()
            };
            let wanted = percent(RESOLUTION);
            let advice = match more {
                Some(more) => {
                    let spp = (more * samples as f64).ceil();
                    format!("--spp {spp:.0} or so resolves {wanted:.0}%, if tails are not heavy")
                }
                None if within.is_finite() => format!("give smaller --steps to resolve {wanted:.0}%"),
                None => {
                    "give a change that changes the image, more --spp and at least two --steps".to_owned()
                }
            };
            (Outcome::Open, format!("OPEN: {seen}; {advice}"))
        }
        Verdict::Nothing => {
            let words = "NOTHING CHANGES: by the method and by differences every pixel's derivative is exactly 0; \
                         what moves is not seen, nor is its shadow";
            (Outcome::Bad, words.to_owned())
        }
    };
    let _ = writeln!(text, "{words}");
    outcome
}
