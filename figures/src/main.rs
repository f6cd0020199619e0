//! Regenerates every figure and study: pictures, the data behind them, and a gallery page.

mod context;
mod explore;
mod figures;
mod gallery;
mod output;
mod peers;
mod plot;
mod prose;
mod ratio;
mod seeds;
mod space;

use std::path::PathBuf;
use std::process::ExitCode;

use anyhow::Context as _;
use clap::builder::{PossibleValue, PossibleValuesParser};
use clap::{Parser, Subcommand};
use volume3d::gradient::Stopped;

use context::{Context, Quality};

/// Draws the figures of warped-area sampling and writes a gallery page, index.html, that explains them.
///
/// Every number shown is computed by the run. The same seed gives the same numbers on any number of threads,
/// but for times, which are the machine's.
#[derive(Debug, Parser)]
#[command(version, args_conflicts_with_subcommands = true)]
struct Options {
    #[command(subcommand)]
    command: Option<Command>,
    /// Which figure to draw.
    #[arg(value_parser = choices(), default_value = "all")]
    figure: String,
    /// How many samples to spend: draft takes a few minutes, full much longer.
    #[arg(long, value_enum, default_value = "draft")]
    quality: Quality,
    /// The folder to write to; it is made if there is none.
    #[arg(long, default_value = "figures/out")]
    out: PathBuf,
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
    let one = |(index, figure): (usize, &figures::Figure)| {
        PossibleValue::new(figure.name).help(format!("Figure {}: {}", index + 1, figure.about))
    };
    std::iter::once(all).chain(figures::ALL.iter().enumerate().map(one)).collect::<Vec<_>>().into()
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
    let chosen = figures::ALL.iter().enumerate();
    let chosen: Vec<_> = chosen.filter(|(_, f)| ["all", f.name].contains(&options.figure.as_str())).collect();
    std::fs::create_dir_all(&options.out)
        .with_context(|| format!("cannot make the folder {}", options.out.display()))?;
    let context = Context::new(options.quality, options.out.clone(), options.seed, chosen.len());
    let mut sections = vec![];
    for (index, figure) in chosen {
        let name = format!("{} {}", index + 1, figure.name);
        sections.push((index + 1, context.figure(&name, || (figure.draw)(&context))?));
    }
    let opening = prose::Prose::new(figures::INTRODUCTION, &[])?.section(
        "opening",
        vec![],
        output::Table::default(),
    )?;
    gallery::write(&options.out, &opening, &sections, &context.drawings())?;
    context.finish(&options.out.join("index.html"));
    Ok(())
}
