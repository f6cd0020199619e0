//! `volume3d check`.

use std::fmt::Write as _;
use std::time::Instant;

use clap::Args;
use clap::error::ErrorKind;
use flatland::random::stream;
use glam::DVec3;
use rand::Rng;
use volume3d::gradient::{Contribution, Estimator, FiniteDifference, GradientError, OneSided, Tangent};
use volume3d::scene::Scene;

use super::comparison::{Estimate, RESOLUTION, RUNS, Slope, Verdict, verdict};
use super::contact;
use super::extent;
use super::gradient::step;
use super::method::{MethodOptions, chosen};
use super::missing::left_out;
use super::movement::{Moves, change};
use super::one_sided::one_sided;
use super::report::{Outcome, Report, usage};
use super::session::{Bar, RunOptions, SceneOptions, check_size, located, silent};
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
/// and for an error that falls at least in proportion to the step.
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

/// Samples per pixel of the weights, which may be noisy.
const WEIGHT_SAMPLES: usize = 16;

/// Keys of the random streams of the three estimates, and of the pilot that chooses the method.
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
    let mut steps = options.steps.clone();
    if steps.is_empty() {
        steps = extent::steps_after_a_larger(&loaded.scene, &change);
    }
    steps.sort_by(|a, b| b.total_cmp(a));
    steps.dedup();

    let start = Instant::now();
    let mut check = Check::new(options, &loaded.scene, &change, steps.len() + 1);
    let weights = check.weights(steps[0])?;
    let (method, slopes) = check.estimates(&steps, &weights)?;
    let mut text = check.messages;
    text += &contact::parted(&loaded.scene, &change.positions);
    stop_if_asked()?;
    table(&mut text, method, &slopes);
    let outcome = conclude(&mut text, verdict(method, &slopes), check.samples * RUNS);
    let _ =
        writeln!(text, "{} spp in {RUNS} runs, {:.2} s", check.samples * RUNS, start.elapsed().as_secs_f64());
    Ok(Report { text, outcome })
}

/// The data that all estimates share.
struct Check<'a> {
    options: &'a Options,
    scene: &'a Scene,
    change: &'a Tangent,
    /// Samples per pixel of one run.
    samples: usize,
    bar: Bar,
    messages: String,
}

/// The results of all runs of an estimate.
#[derive(Default)]
struct Runs {
    /// The weighted total of each run.
    totals: Vec<f64>,
    /// The sample of each run that contributes most to the gradient.
    largest: Vec<Option<Contribution>>,
    /// The largest sum of the channels' absolute values over pixels and runs.
    brightest: f64,
    /// The reason if finite differences are one-sided.
    one_sided: Option<OneSided>,
}

impl Runs {
    /// The largest contribution of one sample.
    fn largest(&self) -> f64 {
        self.largest.iter().flatten().map(|sample| sample.amount).fold(0.0, f64::max)
    }
}

/// The most that one sample like the largest would contribute to the mean of all runs at a step. A
/// discontinuity that a larger step saw and this one did not would be divided by this step, so its
/// contribution is scaled by the ratio of steps. A smooth change is seen at both steps, as the same largest
/// sample, and is not scaled.
fn grain(steps: &[f64], runs: &[Runs], of: usize) -> f64 {
    let place = |sample: Contribution| (sample.column, sample.row, sample.sample);
    let of_run = |r: usize| {
        let own = runs[of].largest[r];
        let larger = (0..of).filter_map(|j| runs[j].largest[r].map(|sample| (steps[j] / steps[of], sample)));
        let missed = larger.filter(|(_, sample)| own.map(place) != Some(place(*sample)));
        let missed = missed.map(|(ratio, sample)| ratio * sample.amount);
        missed.fold(own.map_or(0.0, |sample| sample.amount), f64::max)
    };
    (0..RUNS).map(of_run).fold(0.0, f64::max) / RUNS as f64
}

impl<'a> Check<'a> {
    fn new(options: &'a Options, scene: &'a Scene, change: &'a Tangent, estimates: usize) -> Self {
        let samples = options.spp.div_ceil(RUNS);
        let bar = Bar::new(estimates * RUNS, "check");
        Self { options, scene, change, samples, bar, messages: String::new() }
    }

    /// A rough gradient image divided by the root mean square of its channels that are not 0, and clamped to
    /// ±1.
    ///
    /// Where discontinuities move, the variance of differences is proportional to |gradient|, which varies
    /// over the image; the weights let all changing pixels count alike. No sample counts more than in the
    /// image itself.
    fn weights(&self, step: f64) -> Result<Vec<DVec3>, GradientError> {
        let seed = self.seed(WEIGHTS, 0);
        let method = FiniteDifference { samples: WEIGHT_SAMPLES, step, seed };
        let image = method.forward(self.scene, self.change, &silent())?.gradient;
        let channels = || image.pixels.iter().flat_map(DVec3::to_array).filter(|c| *c != 0.0);
        let (sum, count) = channels().fold((0.0, 0.0), |(sum, count), c| (sum + c * c, count + 1.0));
        if count == 0.0 {
            return Ok(vec![DVec3::ONE; image.pixels.len()]);
        }
        let range: f64 = f64::sqrt(sum / count);
        Ok(image.pixels.iter().map(|p| (*p / range).clamp(DVec3::NEG_ONE, DVec3::ONE)).collect())
    }

    /// The estimate of the method, and the slopes at all steps.
    fn estimates(
        &mut self,
        steps: &[f64],
        weights: &[DVec3],
    ) -> Result<(Estimate, Vec<Slope>), GradientError> {
        let method = self.method(weights)?;
        let method = Estimate::of(&method.totals, method.largest() / RUNS as f64);
        let runs: Vec<Runs> =
            steps.iter().map(|&h| self.differences(h, weights)).collect::<Result<_, _>>()?;
        let grains: Vec<f64> = (0..steps.len()).map(|i| grain(steps, &runs, i)).collect();
        let brightest = runs.iter().map(|r| r.brightest).fold(0.0, f64::max);
        // The change of one sample is divided by the distance between the two sides and by the number of
        // samples.
        let found = steps.iter().zip(&runs).filter_map(|(&step, r)| Some((step, r.one_sided.as_ref()?)));
        self.messages += &one_sided(found);
        let apart = if runs[0].one_sided.is_some() { steps[0] } else { 2.0 * steps[0] };
        let unseen = brightest / (apart * (self.samples * RUNS) as f64);
        let totals: Vec<Vec<f64>> = runs.into_iter().map(|r| r.totals).collect();
        Ok((method, Slope::of(steps, &totals, &grains, unseen)))
    }

    /// All runs of the method.
    fn method(&mut self, weights: &[DVec3]) -> Result<Runs, GradientError> {
        // The method is chosen once; each run has its own seed.
        let estimator = self.options.method.estimator(self.samples, self.seed(CHOICE, 0), None);
        let (estimator, chosen) = chosen(estimator, |p| p.for_change(self.scene, self.change, &silent()))?;
        self.messages += &chosen;
        self.runs(weights, |check, r| estimator.with_seed(check.seed(METHOD, r)))
    }

    /// All runs of finite differences with one step.
    fn differences(&mut self, step: f64, weights: &[DVec3]) -> Result<Runs, GradientError> {
        self.runs(weights, |check, r| {
            let (samples, seed) = (check.samples, check.seed(DIFFERENCES, r));
            Estimator::FiniteDifference(FiniteDifference { samples, step, seed })
        })
    }

    fn runs(
        &mut self,
        weights: &[DVec3],
        estimator: impl Fn(&Self, usize) -> Estimator,
    ) -> Result<Runs, GradientError> {
        let mut runs = Runs::default();
        for r in 0..RUNS {
            let result = estimator(self, r).forward(self.scene, self.change, &silent())?;
            runs.totals.push(result.gradient.pixels.iter().zip(weights).map(|(g, w)| g.dot(*w)).sum());
            runs.largest.push(result.largest);
            let brightness = result.image.pixels.iter().map(|p| p.abs().element_sum());
            runs.brightest = brightness.fold(runs.brightest, f64::max);
            self.messages += &located(&result.non_finite);
            if r == 0 {
                self.messages += &left_out(&result.left_out);
                runs.one_sided = result.one_sided;
            }
            self.bar.step();
        }
        Ok(runs)
    }

    /// The seed of a run.
    fn seed(&self, purpose: u64, run: usize) -> u64 {
        stream(self.options.run.seed, &[purpose, run as u64]).next_u64()
    }
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

#[cfg(test)]
mod tests {
    use clap::Parser;

    use super::*;

    #[derive(Parser)]
    struct Line {
        #[command(flatten)]
        options: Options,
    }

    /// A slightly rotated lit square that casts a shadow on another one.
    const SCENE: &str = r#"<scene version="3.0.0">
        <integrator type="path"><integer name="max_depth" value="2"/></integrator>
        <sensor type="perspective"><float name="fov" value="40"/>
            <transform name="to_world"><lookat origin="0,0,2" target="0,0,0" up="0,1,0"/></transform>
            <film type="hdrfilm"><integer name="width" value="24"/><integer name="height" value="24"/><rfilter type="tent"/></film>
        </sensor>
        <shape type="rectangle" id="square"><transform name="to_world"><scale x="0.4" y="0.35"/><rotate z="1" angle="13"/></transform></shape>
        <shape type="rectangle" id="wall"><transform name="to_world"><translate z="-0.5"/></transform></shape>
        <shape type="rectangle" id="lamp">
            <transform name="to_world"><scale value="0.5"/><rotate x="1" angle="180"/><translate x="0.9" z="2.5"/></transform>
            <emitter type="area"><rgb name="radiance" value="4 5 6"/></emitter>
        </shape>
    </scene>"#;

    /// On an ordinary scene a gradient that is 30 % too small or too large is rejected, and the correct one
    /// is not.
    #[test]
    fn a_third_is_found_on_an_ordinary_scene() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("scene.xml");
        std::fs::write(&path, SCENE).unwrap();
        for seed in ["0"] {
            let line =
                ["check", path.to_str().unwrap(), "--move", "square:translate:0.2,0.1,0.3", "--seed", seed];
            let options = Line::parse_from(line).options;
            let scene = options.scene.load().unwrap().scene;
            let change = change(&scene, &options.moves.moves).unwrap();
            let steps = extent::steps_after_a_larger(&scene, &change);
            let mut check = Check::new(&options, &scene, &change, steps.len() + 1);
            let weights = check.weights(steps[0]).unwrap();
            let (method, slopes) = check.estimates(&steps, &weights).unwrap();
            let of = |factor: f64| verdict(Estimate { mean: factor * method.mean, ..method }, &slopes);
            for (factor, differs) in [(1.0, false), (0.7, true), (1.3, true)] {
                let found = of(factor);
                println!("seed {seed}, {factor} of the gradient: {found:?}");
                assert_eq!(
                    matches!(found, Verdict::Differs { .. }),
                    differs,
                    "{factor}: {found:?}, {method:?} {slopes:?}"
                );
            }
        }
    }
}
