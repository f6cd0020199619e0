//! `volume3d tune`.

mod advice;
mod allowance;
mod filters;
mod law;
mod picture;
mod settings;
mod statistics;
mod study;
mod table;

use std::path::PathBuf;

use clap::Args;
use clap::error::ErrorKind;
use volume3d::gradient::Tangent;
use volume3d::io::write_bytes;

use self::advice::{Target, Tuned, advice};
use self::allowance::{Allowance, Limit};
use self::law::Law;
use self::settings::settings;
use self::statistics::Measure;
use self::study::{Outcome as Fate, Reference, Study, all_samples};
use super::comparison::TOLERATED;
use super::contact;
use super::movement::{Moves, change};
use super::output::{check_distinct, check_file};
use super::report::{Outcome, Report, usage};
use super::session::{RunOptions, SceneOptions, check_size};
use super::signals;
use super::spp::samples;

/// Measures bias, noise and time of every method on a scene, and names the setting for a time or an error.
///
/// Along one change every setting of `volume3d gradient` that is worth it is run 16 times, with seeds of its own, at 1, 4, 16, …
/// samples a pixel, and compared with a reference: the better of two unbiased methods, of other samples than all it judges.
/// Noise of the runs and of the reference is taken off a bias, whose own error is known from leaving out runs one by one. What
/// is refused on this scene is listed with its reason.
///
/// The error of a gradient image is the root mean square, over pixels and channels, of its difference from the true
/// gradient, relative to the root mean square of that: 5% is 0.05. It is predicted by error² = bias² + noise² · spp/N.
///
/// Samples are stratified in 8 groups: from 16 spp on noise falls a little faster than that. Another pixel filter is another gradient, and
/// often a much less noisy one: the study says how much noise each has.
///
/// A scene with long tails fools a short study. Where in some runs one sample carries much of the whole, that is said,
/// and errors of that setting are larger than stated.
///
/// The wall time of all is --budget, but for the first run of a kind, which tells how long it takes; the reference has 30% of it. With the same
/// --seed every number but times has the same bits; time decides only how far sample numbers go. With --spp it
/// decides nothing.
#[derive(Args, Debug)]
#[command(after_long_help = EXAMPLES)]
pub(super) struct Options {
    #[command(flatten)]
    scene: SceneOptions,
    #[command(flatten)]
    moves: Moves,
    /// Names the setting with the least error within this time. Several are told one after another. 10 unless this or
    /// --error is given.
    #[arg(long, value_name = "T,…", value_delimiter = ',', value_parser = positive, allow_negative_numbers = true)]
    seconds: Vec<f64>,
    /// Names the fastest setting with this error: 0.05 is 5% of the gradient, root mean squares.
    #[arg(long, value_name = "E,…", value_delimiter = ',', value_parser = positive, allow_negative_numbers = true)]
    error: Vec<f64>,
    /// Wall time of the study, in seconds.
    #[arg(long, value_name = "SECONDS", default_value_t = 60.0, value_parser = positive, allow_negative_numbers = true)]
    budget: f64,
    /// Instead of a time: the most samples a pixel of every setting. The reference has four times as many.
    #[arg(long, value_name = "N", value_parser = samples, conflicts_with = "budget")]
    spp: Option<usize>,
    /// A picture of error against time: points as measured, lines as predicted.
    #[arg(short, long, value_name = "TUNE.svg")]
    output: Option<PathBuf>,
    /// Every number of the study, a row for each setting and number of samples.
    #[arg(long, value_name = "TUNE.csv")]
    csv: Option<PathBuf>,
    #[command(flatten)]
    run: RunOptions,
}

const EXAMPLES: &str = "\
Examples:
  volume3d tune scene.xml --move box:translate:1,0,0
  volume3d tune scene.xml --move box:translate:1,0,0 --error 0.1,0.03 -o tune.svg --csv tune.csv --budget 300";

/// What is named unless anything is asked for: the best setting within so many seconds.
const SECONDS: f64 = 10.0;

fn positive(text: &str) -> Result<f64, String> {
    let number = text.parse().ok().filter(|x: &f64| *x > 0.0 && x.is_finite());
    number.ok_or_else(|| "expected a positive, finite number".to_owned())
}

impl Options {
    /// What to name a setting for, in order.
    fn targets(&self) -> Vec<Target> {
        let seconds = self.seconds.iter().map(|&t| Target::Seconds(t));
        let all: Vec<Target> = seconds.chain(self.error.iter().map(|&e| Target::Error(e))).collect();
        if all.is_empty() { vec![Target::Seconds(SECONDS)] } else { all }
    }
}

pub(super) fn run(options: &Options) -> anyhow::Result<Report> {
    if options.moves.moves.is_empty() {
        let text = "say what changes: --move".to_owned();
        return Err(usage("tune", ErrorKind::MissingRequiredArgument, text));
    }
    let files = [(&options.output, "svg", "the picture"), (&options.csv, "csv", "the table")];
    let mut outputs = vec![];
    for (path, ending, what) in files {
        if let Some(path) = path {
            check_file(path, ending, what)?;
            outputs.push(path.as_path());
        }
    }
    options.run.begin()?;
    let loaded = options.scene.load()?;
    check_distinct(&outputs, &loaded.files)?;
    let scene = &loaded.scene;
    check_size(options.scene.path(), scene.size())?;
    let change = change(scene, &options.moves.moves)?;
    if change == Tangent::still(scene) {
        let text = "NOTHING CHANGES: all rates of --move are 0, or their sum is\n".to_owned();
        return Ok(Report { text, outcome: Outcome::Bad });
    }

    let settings = settings(scene, &change)?;
    let limit = match options.spp {
        Some(most) => Limit::Samples { most, all: all_samples(settings.len(), most) },
        None => Limit::Seconds(options.budget),
    };
    let allowance = Allowance::new(limit);
    let study = Study { scene, change: &change, seed: options.run.seed, allowance: &allowance };
    let reference = study.reference()?;
    if let Some(report) = unusable(&reference) {
        return Ok(report);
    }
    let filters = filters::compared(&study, &reference)?;
    let outcomes = study.climb(&settings, &reference)?;
    signals::hold()?;

    let tuned: Vec<Tuned<'_>> = settings
        .iter()
        .zip(&outcomes)
        .filter_map(|(setting, outcome)| {
            let Fate::Measured(rungs) = outcome else { return None };
            let heavy = rungs.last().is_some_and(|r| r.heavy > 0);
            Some(Tuned { setting, law: Law::of(rungs, setting.unbiased)?, heavy })
        })
        .collect();
    if tuned.is_empty() {
        let needed = (2 * settings.len()) as f64 * reference.seconds / reference.samples as f64;
        let text =
            format!("OPEN: nothing was measured; --budget {:.0} or so is enough for it\n", needed.max(1.0));
        return Ok(Report { text, outcome: Outcome::Open });
    }
    let mut text = table::table(&settings, &outcomes, options.seconds.first().copied().unwrap_or(SECONDS));
    text += &table::legend(&reference);
    text += &filters;
    text += &table::warnings(&settings, &outcomes, &reference);
    text += &contact::parted(scene, &change.positions);
    for target in options.targets() {
        text += &advice(&tuned, target, &options.scene, &options.moves.moves);
    }
    if let Some(path) = &options.csv {
        write_bytes(path, &table::csv(&settings, &outcomes, &reference)?)?;
        text += &format!("wrote {}\n", path.display());
    }
    if let Some(path) = &options.output {
        write_bytes(path, picture::svg(&settings, &outcomes)?.as_bytes())?;
        text += &format!("wrote {}\n", path.display());
    }
    text += &format!("{:.1} s in all\n", allowance.spent());
    Ok(Report { text, outcome: Outcome::Good })
}

/// Why nothing can be judged by a reference, if so.
fn unusable(reference: &Reference) -> Option<Report> {
    if reference.images.are_zero() {
        let text = "NOTHING CHANGES: every pixel's derivative is exactly 0; what moves is not seen, nor is its shadow\n";
        return Some(Report { text: text.to_owned(), outcome: Outcome::Bad });
    }
    let Measure { value, error } = reference.images.power();
    if value > TOLERATED * error {
        return None;
    }
    let text = format!(
        "OPEN: the gradient is lost in the noise of the reference ({}, {} spp): nothing can be judged by it; raise --budget\n",
        reference.setting.options, reference.samples
    );
    Some(Report { text, outcome: Outcome::Open })
}
