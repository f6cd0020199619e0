//! `volume3d tune`.

mod advice;
mod picture;
mod settings;
mod table;

use std::path::PathBuf;

use clap::Args;
use clap::error::ErrorKind;
use volume3d::gradient::Tangent;
use volume3d::io::write_bytes;
use volume3d::tune::{Limit, Setting, Target, Tune, TuneError};

use self::advice::advice;
use self::settings::options;
use super::contact;
use super::movement::{Moves, change};
use super::output::{check_distinct, check_file};
use super::report::{Outcome, Report, usage};
use super::session::{Bar, RunOptions, SceneOptions, check_size};
use super::signals;
use super::spp::samples;

/// Measures bias, noise and time of every method on a scene, and recommends a setting for a time or an error.
///
/// Each setting of `volume3d gradient` that is worth it is run 16 times along the change, with different
/// seeds, with 1, 4, 16, … samples per pixel. The results are compared with a reference: the better of two
/// unbiased methods, from independent samples. Biases are estimated without the noise of the runs and of the
/// reference; their standard errors are those of the jackknife. Methods that refuse the scene are listed with
/// the reason.
///
/// The error of a gradient image is the root mean square, over pixels and channels, of its difference from
/// the true gradient, divided by the root mean square of the true gradient: 5% is 0.05. The prediction for N
/// spp is error² = bias² + noise² · spp/N.
///
/// Samples are stratified in 8 groups: from 16 spp on, noise falls slightly faster than predicted. Another
/// pixel filter has another gradient, often with much less noise: a line compares the noise of filters.
///
/// Heavy tails mislead a short study: if one sample carries much of the result in some runs, a line says so,
/// and the errors of that setting are larger than stated.
///
/// The study takes about --budget in wall time, 30% of it for the reference. It may exceed it by the first
/// run of each kind, which measures the time. With the same --seed, all numbers except times have the same
/// bits; time decides only how many samples are used. With --spp, time decides nothing.
#[derive(Args, Debug)]
#[command(after_long_help = EXAMPLES)]
pub(super) struct Options {
    #[command(flatten)]
    scene: SceneOptions,
    #[command(flatten)]
    moves: Moves,
    /// Recommends the setting with the smallest error within this time, or several times [default: 10 without
    /// --error].
    #[arg(long, value_name = "T,…", value_delimiter = ',', value_parser = positive, allow_negative_numbers = true)]
    seconds: Vec<f64>,
    /// Recommends the fastest setting with this error, or several errors: 0.05 is 5% of the gradient, root
    /// mean square.
    #[arg(long, value_name = "E,…", value_delimiter = ',', value_parser = positive, allow_negative_numbers = true)]
    error: Vec<f64>,
    /// Wall time of the study, in seconds.
    #[arg(long, value_name = "SECONDS", default_value_t = 60.0, value_parser = positive, allow_negative_numbers = true)]
    budget: f64,
    /// Instead of a time: the largest number of samples per pixel of a setting. The reference has four times
    /// as many.
    #[arg(long, value_name = "N", value_parser = samples, conflicts_with = "budget")]
    spp: Option<usize>,
    /// A plot of error against time: points are measured, lines predicted.
    #[arg(short, long, value_name = "TUNE.svg")]
    output: Option<PathBuf>,
    /// All numbers of the study, a row per setting and number of samples.
    #[arg(long, value_name = "TUNE.csv")]
    csv: Option<PathBuf>,
    #[command(flatten)]
    run: RunOptions,
}

const EXAMPLES: &str = "\
Examples:
  volume3d tune scene.xml --move box:translate:1,0,0
  volume3d tune scene.xml --move box:translate:1,0,0 --error 0.1,0.03 -o tune.svg --csv tune.csv --budget 300";

/// The default target, in seconds.
const SECONDS: f64 = 10.0;

fn positive(text: &str) -> Result<f64, String> {
    let number = text.parse().ok().filter(|x: &f64| *x > 0.0 && x.is_finite());
    number.ok_or_else(|| "expected a positive, finite number".to_owned())
}

impl Options {
    /// The targets, in the order of their advice.
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
        let text = "NOTHING CHANGES: all rates of --move are 0, or cancel\n".to_owned();
        return Ok(Report { text, outcome: Outcome::Bad });
    }

    let tune = Tune {
        limit: options.spp.map_or(Limit::Seconds(options.budget), Limit::Samples),
        seed: options.run.seed,
    };
    let bar = Bar::new(1, "tune");
    let found = tune.run(scene, &change, &Setting::all(scene, &change), &bar.progress());
    drop(bar);
    let tuning = match found {
        Ok(tuning) => tuning,
        Err(error) => return unusable(error),
    };
    signals::hold()?;
    let mut text = table::table(&tuning.settings, options.seconds.first().copied().unwrap_or(SECONDS));
    text += &table::legend(&tuning.reference);
    text += &table::filters(&tuning.filters, &tuning.reference);
    text += &table::warnings(&tuning);
    text += &contact::parted(scene, &change.positions);
    for target in options.targets() {
        text += &advice(&tuning, target, &options.scene, &options.moves.moves);
    }
    if let Some(path) = &options.csv {
        write_bytes(path, &table::csv(&tuning)?)?;
        text += &format!("wrote {}\n", path.display());
    }
    if let Some(path) = &options.output {
        write_bytes(path, picture::svg(&tuning.settings)?.as_bytes())?;
        text += &format!("wrote {}\n", path.display());
    }
    text += &format!("{:.1} s in total\n", tuning.seconds);
    Ok(Report { text, outcome: Outcome::Good })
}

/// The report if settings cannot be compared.
fn unusable(error: TuneError) -> anyhow::Result<Report> {
    let (text, outcome) = match error {
        TuneError::Nothing => (format!("NOTHING CHANGES: {error}\n"), Outcome::Bad),
        TuneError::Noise { setting, samples } => {
            let setting = options(setting);
            let text = format!(
                "OPEN: the noise of the reference ({setting}, {samples} spp) hides the gradient, so nothing can be compared \
                 with it; raise --budget\n"
            );
            (text, Outcome::Open)
        }
        TuneError::Budgeted { seconds } => {
            (format!("OPEN: nothing was measured; --budget {seconds:.0} or so is enough\n"), Outcome::Open)
        }
        other => return Err(other.into()),
    };
    Ok(Report { text, outcome })
}
