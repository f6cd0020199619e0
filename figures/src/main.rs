//! Regenerates every figure and study: pictures, the data behind them, and a gallery page.

mod accuracy;
mod context;
mod explore;
mod figures;
mod gallery;
mod output;
mod peers;
mod pictures;
mod plot;
mod prose;
mod ratio;
mod record;
mod seeds;
mod space;

use std::path::PathBuf;
use std::process::ExitCode;
use std::time::Instant;

use anyhow::{Context as _, ensure};
use clap::builder::{PossibleValue, PossibleValuesParser};
use clap::{Parser, Subcommand};
use volume3d::gradient::Stopped;

use context::{Context, Quality};
use gallery::{Gallery, Section};

/// Draws the figures of warped-area sampling and writes a gallery page, index.html, that explains them.
///
/// Every number shown is computed by the run. The same seed gives the same numbers on any number of threads,
/// but for times, which are the machine's.
#[derive(Debug, Parser)]
#[command(version, args_conflicts_with_subcommands = true)]
struct Options {
    #[command(subcommand)]
    command: Option<Command>,
    /// Which figures to draw.
    #[arg(value_parser = choices(), default_value = "all")]
    figures: Vec<String>,
    /// How many samples to spend: draft takes a few minutes, full much longer.
    #[arg(long, value_enum, default_value = "draft")]
    quality: Quality,
    /// Replaces the recorded results of long studies by those of this run, of short or full quality.
    #[arg(long)]
    record: bool,
    /// The folder to write to; it is made if there is none.
    #[arg(long, default_value = "figures/out")]
    out: PathBuf,
    /// Folder of the pages of `cargo doc`, as seen from the gallery's: the guide and the API are linked.
    #[arg(long, value_name = "FOLDER")]
    documentation: Option<String>,
    /// The seed of every random number.
    #[arg(long, default_value_t = 1)]
    seed: u64,
}

#[derive(Debug, Subcommand)]
enum Command {
    Explore(explore::Options),
    Peers(Box<peers::Options>),
}

/// The names of all figures with their descriptions.
fn choices() -> PossibleValuesParser {
    let all = PossibleValue::new("all").help("Every figure, and the gallery page");
    let some =
        PossibleValue::new("accuracy").help("Those of the page on speed against accuracy, and that page");
    let one = |(index, figure): (usize, &figures::Figure)| {
        PossibleValue::new(figure.name).help(format!("Figure {}: {}", index + 1, figure.about))
    };
    [all, some].into_iter().chain(figures::ALL.iter().enumerate().map(one)).collect::<Vec<_>>().into()
}

fn main() -> ExitCode {
    let options = Options::parse();
    let done = match &options.command {
        Some(Command::Explore(options)) => explore::run(options),
        Some(Command::Peers(peers)) => peers::run(peers),
        None => run(&options),
    };
    match done {
        Ok(()) => ExitCode::SUCCESS,
        Err(error) if error.is::<Stopped>() => {
            eprintln!("{error:#}");
            ExitCode::from(peers::INTERRUPTED)
        }
        Err(error) => {
            eprintln!("error: {error:#}");
            ExitCode::FAILURE
        }
    }
}

fn run(options: &Options) -> anyhow::Result<()> {
    let is_chosen = |f: &figures::Figure| {
        options.figures.iter().any(|name| match name.as_str() {
            "all" => true,
            "accuracy" => accuracy::FIGURES.contains(&f.name),
            name => name == f.name,
        })
    };
    let chosen: Vec<_> = figures::ALL.iter().enumerate().filter(|(_, f)| is_chosen(f)).collect();
    let is_study = matches!(options.quality, Quality::Short | Quality::Full);
    ensure!(!options.record || is_study, "--record needs --quality short or --quality full");
    std::fs::create_dir_all(&options.out)
        .with_context(|| format!("cannot make the folder {}", options.out.display()))?;
    let usual = chosen.iter().map(|(_, figure)| figure.seconds).collect();
    let context = Context::new(options.quality, options.out.clone(), options.seed, usual);
    let mut sections = vec![];
    for (index, figure) in chosen {
        let title = format!("{} {}", index + 1, figure.name);
        sections.push((index + 1, context.figure(&title, || section(&context, figure, options.record))?));
    }
    let (folder, drawings) = (context.out(), context.drawings());
    let names = figures::ALL.map(|figure| figure.name);
    let documentation = options.documentation.as_deref();
    let gallery = Gallery { folder, drawings: &drawings, names: &names, sections: &sections, documentation };
    let part = |text, id| prose::Prose::new(text, &[])?.section(id, vec![], output::Table::default());
    let page = if accuracy::write(&gallery)? && options.figures == ["accuracy"] {
        accuracy::FILE
    } else {
        "index.html"
    };
    gallery.write(&part(figures::INTRODUCTION, "opening")?, &part(figures::LECTURE, "lecture")?)?;
    context.finish(&options.out.join(page));
    Ok(())
}

/// A figure's part of the page. Of a study, a draft shows recorded results beside one small scene.
fn section(context: &Context, figure: &figures::Figure, is_recorded: bool) -> anyhow::Result<Section> {
    let Some(study) = &figure.study else { return (figure.draw)(context) };
    if context.quality() != Quality::Draft {
        let (start, clock) = (Instant::now(), space::Clock::start());
        let section = (figure.draw)(context)?;
        if is_recorded {
            let seconds = [start.elapsed().as_secs_f64(), clock.seconds()];
            let origin = record::Origin::new(context.seed(), seconds, context.quality() == Quality::Full);
            record::write(figure.name, &section, context.out(), &context.drawings(), origin)?;
        }
        return Ok(section);
    }
    let live = (study.live)(context)?;
    let Some((section, drawings)) = record::read(figure.name, study.text, context.out())? else {
        return Ok(live);
    };
    context.add_drawings(drawings);
    Ok(Section { live: Some(Box::new(live)), ..section })
}
