//! `figures peers`: our methods on scenes with stored measurements of other systems, at equal time.

mod case;
mod comparison;
mod record;
#[cfg(test)]
mod tests;

use std::path::{Path, PathBuf};
use std::sync::atomic::{AtomicBool, Ordering};
use std::time::Duration;

use anyhow::{Context as _, anyhow, bail, ensure};
use clap::Args;
use indicatif::ProgressBar;
use volume3d::gradient::{GradientError, GradientImage, Progress, Stopped};

use self::case::{Case, FilterName, Group, Normals, mean, word};
use self::comparison::Comparison;
use self::record::{Records, Row, Stored};
use crate::context::{style, told};
use crate::output::{write_bytes, write_csv};
use crate::seeds::seed_of;
use crate::space::{Clock, Compared, METHODS, Method, Task};

/// Stop flag, set by Ctrl-C.
static STOP: AtomicBool = AtomicBool::new(false);
/// Exit code after an interruption, as shells use.
pub(crate) const INTERRUPTED: u8 = 130;

/// Measures our methods on the scenes of a folder, and compares them at equal time with what is stored of
/// others.
///
/// A scene NAME stands in SCENES/NAME as NAME.xml, NAME_smooth.xml (interpolated normals) and theta.json, its
/// reference in `NAME_FILTER[_vn]_{img,grad,varmean}.npy`. Measured rows are kept in OUT/peers_runs.csv: a
/// run that was interrupted goes on where it was. The tables are OUT/peers.csv and OUT/peers.md.
#[derive(Args, Debug)]
pub(crate) struct Options {
    /// The folder of scenes.
    #[arg(long, value_name = "DIR")]
    scenes: PathBuf,
    /// The folder of reference images; SCENES/ref unless given.
    #[arg(long, value_name = "DIR")]
    reference: Option<PathBuf>,
    /// What other systems were measured to do; SCENES/results.csv unless given.
    #[arg(long, value_name = "FILE.csv")]
    results: Option<PathBuf>,
    /// The times to compare at, in seconds.
    #[arg(long, value_name = "T,…", value_delimiter = ',', default_value = "2,20", value_parser = positive)]
    times: Vec<f64>,
    /// Only these scenes.
    #[arg(long, value_name = "NAME,…", value_delimiter = ',')]
    only: Vec<String>,
    /// Only these normals.
    #[arg(long, value_enum, value_delimiter = ',')]
    normals: Vec<Normals>,
    /// Only these filters.
    #[arg(long, value_enum, value_delimiter = ',')]
    filters: Vec<FilterName>,
    /// Only these methods.
    #[arg(long, value_name = "METHOD,…", value_delimiter = ',', value_parser = keys())]
    methods: Vec<String>,
    /// Samples a pixel; each method's own number, for about equal times, unless given.
    #[arg(long, value_parser = clap::value_parser!(u32).range(1..))]
    samples: Option<u32>,
    /// Independent runs of each method.
    #[arg(long, default_value_t = 4, value_parser = clap::value_parser!(u32).range(3..=1000))]
    runs: u32,
    /// Threads to compute with: as many as the stored rows had cores.
    #[arg(long, default_value_t = 2, value_parser = clap::value_parser!(u32).range(1..=1024))]
    threads: u32,
    /// The seed of every random number.
    #[arg(long, default_value_t = 1)]
    seed: u32,
    /// Measures again what has been measured with the same settings, perhaps by an older program.
    #[arg(long)]
    again: bool,
    /// The folder to write to; it is made if there is none.
    #[arg(long, value_name = "DIR", default_value = "figures/out/peers")]
    out: PathBuf,
}

fn positive(text: &str) -> Result<f64, String> {
    text.trim().parse().ok().filter(|t: &f64| *t > 0.0 && t.is_finite()).ok_or("must be positive".to_owned())
}

fn keys() -> clap::builder::PossibleValuesParser {
    METHODS.iter().map(|method| method.key).collect::<Vec<_>>().into()
}

/// Whether a list of choices, where an empty list means everything, contains this one.
fn chosen<T: PartialEq>(choices: &[T], value: &T) -> bool {
    choices.is_empty() || choices.contains(value)
}

/// Makes the missing measurements, and writes the tables.
pub(crate) fn run(options: &Options) -> anyhow::Result<()> {
    let references = options.reference.clone().unwrap_or_else(|| options.scenes.join("ref"));
    let groups = options.groups(&Group::all(&references)?)?;
    let results = options.results.clone().unwrap_or_else(|| options.scenes.join("results.csv"));
    let stored = Stored::read(&results)?;
    let mut records = Records::open(options.out.join("peers_runs.csv"))?;
    let stop = || {
        if STOP.swap(true, Ordering::Relaxed) {
            std::process::exit(i32::from(INTERRUPTED));
        }
    };
    ctrlc::set_handler(stop).context("cannot listen for Ctrl-C")?;
    let threads = rayon::ThreadPoolBuilder::new().num_threads(options.threads as usize).build();
    let threads = threads.map_err(|e| anyhow!("cannot start {} threads: {e}", options.threads))?;
    let refused = threads.install(|| options.measure(&references, &groups, &mut records));
    let refused = refused.map_err(|error| match error.downcast_ref::<Stopped>() {
        Some(_) => error.context(format!("{} keeps what was measured", records.path.display())),
        None => error,
    })?;
    options.write(&groups, &records, &stored)?;
    for refusal in refused {
        println!("not measured: {refusal}");
    }
    Ok(())
}

impl Options {
    /// The groups to measure.
    fn groups(&self, all: &[Group]) -> anyhow::Result<Vec<Group>> {
        if let Some(name) = self.only.iter().find(|name| all.iter().all(|group| group.scene != **name)) {
            let mut names: Vec<&str> = all.iter().map(|group| group.scene.as_str()).collect();
            names.dedup();
            bail!("there is no reference of a scene “{name}”, only of {}", names.join(", "));
        }
        let wanted = |g: &&Group| {
            chosen(&self.only, &g.scene)
                && chosen(&self.normals, &g.normals)
                && chosen(&self.filters, &g.filter)
        };
        let groups: Vec<Group> = all.iter().filter(wanted).cloned().collect();
        ensure!(!groups.is_empty(), "no reference has the scenes, normals and filters that were chosen");
        Ok(groups)
    }

    fn methods(&self) -> impl Iterator<Item = &'static Method> {
        METHODS.iter().filter(|method| chosen(&self.methods, &method.key.to_owned()))
    }

    /// A row with the settings of a measurement to be made.
    fn settings(&self, group: &Group, method: &Method) -> Row {
        let Group { scene, normals, filter } = group.clone();
        Row {
            scene,
            normals,
            filter,
            method: method.key.to_owned(),
            spp: self.samples.map_or(method.samples, |samples| samples as usize),
            runs: self.runs as usize,
            seed: self.seed,
            threads: self.threads as usize,
            ..Row::default()
        }
    }

    /// Makes the missing measurements, and returns those that are impossible with the reason.
    fn measure(
        &self,
        references: &Path,
        groups: &[Group],
        records: &mut Records,
    ) -> anyhow::Result<Vec<String>> {
        let missing = |group: &Group, records: &Records| -> Vec<&'static Method> {
            let known = |method: &Method| records.find(&self.settings(group, method)).is_some();
            self.methods().filter(|method| self.again || !known(method)).collect()
        };
        let count: usize = groups.iter().map(|group| missing(group, records).len()).sum();
        let all = groups.len() * self.methods().count();
        if count < all {
            println!("{} of {all} rows are kept from {}", all - count, records.path.display());
        }
        let bar = ProgressBar::new(count as u64)
            .with_style(style("{pos}/{len} {bar:24} {elapsed} gone, {eta} to go  {msg}"));
        bar.enable_steady_tick(Duration::from_millis(200));
        let mut refused = vec![];
        for group in groups {
            let methods = missing(group, records);
            if methods.is_empty() {
                continue;
            }
            let case = Case::load(&self.scenes, references, group)?;
            for method in methods {
                match self.row(&case, self.settings(group, method), method, &bar) {
                    Ok(row) => records.add(row)?,
                    Err(GradientError::Stopped(stopped)) => return Err(stopped.into()),
                    Err(error) => refused.push(format!("{group}: {}: {error}", method.name)),
                }
                bar.inc(1);
            }
        }
        bar.finish_and_clear();
        Ok(refused)
    }

    /// Measures one method on one case.
    fn row(
        &self,
        case: &Case,
        settings: Row,
        method: &Method,
        bar: &ProgressBar,
    ) -> Result<Row, GradientError> {
        let Row { scene, normals, filter, .. } = &settings;
        let what = format!("{scene} {} {}: {}", word(*normals), word(*filter), method.name);
        let mut images: Vec<GradientImage> = vec![];
        let clock = Clock::start();
        for run in 0..settings.runs {
            let task = Task {
                scene: &case.scene,
                change: &case.change,
                samples: settings.spp,
                step: case.step,
                seed: seed_of(settings.seed.into(), &[run as u64]),
            };
            let progress: Progress =
                told(bar, &format!("{what}, run {}", run + 1)).until(|| STOP.load(Ordering::Relaxed));
            images.push(method.estimate(&task, &progress)?);
        }
        let runs = settings.runs as f64;
        let seconds = clock.seconds() / runs / settings.threads as f64;
        let non_finite = images.iter().map(|image| image.non_finite.len()).sum();
        let auxiliary_rays =
            images.iter().map(|image| image.auxiliary_rays).sum::<u64>() / settings.runs as u64;
        let radiance = images.iter().map(|image| mean(&image.image.pixels)).sum::<glam::DVec3>() / runs;
        let gradients: Vec<_> = images.into_iter().map(|image| image.gradient.pixels).collect();
        let Compared { variance, bias2, slope, .. } = Compared::new(&gradients, &case.reference);
        Ok(Row {
            seconds,
            rel_variance: variance.value,
            rel_variance_error: variance.error,
            rel_bias2: bias2.value,
            rel_bias2_error: bias2.error,
            slope: slope.value,
            slope_error: slope.error,
            reference_noise: case.reference.floor / case.reference.power(),
            radiance_ratio: radiance.element_sum() / case.radiance.element_sum(),
            auxiliary_rays,
            non_finite,
            ..settings
        })
    }

    /// Writes and prints the tables.
    fn write(&self, groups: &[Group], records: &Records, stored: &[Stored]) -> anyhow::Result<()> {
        let comparison = |group: &Group| {
            let rows = self.methods().filter_map(|method| records.find(&self.settings(group, method)));
            Comparison::new(group, &rows.collect::<Vec<_>>(), stored, &self.times)
        };
        let comparisons: Vec<Comparison> = groups.iter().map(comparison).collect();
        let text = comparison::markdown(&comparisons, &self.times, self.threads as usize);
        write_bytes(&self.out.join("peers.md"), text.as_bytes())?;
        write_csv(&self.out.join("peers.csv"), &comparison::table(&comparisons, &self.times))?;
        println!("{text}");
        Ok(())
    }
}
