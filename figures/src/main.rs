//! Regenerates every figure and study: pictures, the data behind them, and a gallery page.

mod context;
mod figures;
mod gallery;
mod output;
mod peers;
mod plot;
mod prose;
mod ratio;
mod space;

use std::path::PathBuf;
use std::process::ExitCode;

use anyhow::Context as _;
use clap::{Parser, Subcommand, ValueEnum};
use volume3d::gradient::Stopped;

use context::{Context, Quality};
use figures::Name;
use gallery::Gallery;

/// Draws the figures of warped-area sampling and writes a gallery page, index.html, that explains
/// them.
///
/// Every number shown is computed by the run. The same seed gives the same pictures on any number of
/// threads.
#[derive(Debug, Parser)]
#[command(version, args_conflicts_with_subcommands = true)]
struct Options {
    #[command(subcommand)]
    command: Option<Command>,
    /// Which figure to draw.
    #[arg(value_enum, default_value = "all")]
    figure: Choice,
    /// How many samples to spend: draft takes a minute or two, full much longer.
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
    Peers(peers::Options),
}

#[derive(Clone, Copy, Debug, ValueEnum)]
enum Choice {
    /// Every figure, and the gallery page.
    All,
    /// Figure 1: every construction of the warp field on one scene.
    Fields,
    /// Figure 2: the three attempts along a line across a silhouette.
    Attempts,
    /// Figure 3: Reynolds, divergence and reparameterised forms of one derivative.
    Forms,
    /// Figure 4: edge sampling and warped area as a scene grows.
    Edges,
    /// Figure 5: bias, variance and time: the trade.
    Trade,
    /// Figure 6: a real drawing and its gradient image.
    Drawing,
    /// Figure 7: a flat world, a path with its auxiliary rays, and the derivative of a shadow.
    Transport,
    /// Figure 8: edge sampling and warped area as a glossy lobe narrows.
    Specular,
    /// Figure 9: implicit shapes: fields from the points of sphere tracing.
    Implicit,
    /// Figure 10: bias and variance along paths, for shadows and two bounces.
    PathBias,
    /// Figure 11: a mesh in a room, and the gradient image of its motion, term by term.
    Mesh,
    /// Figure 12: variance and bias of every method on cylinders and foliage that rotate.
    Motions,
}

fn main() -> ExitCode {
    let options = Options::parse();
    let done = match &options.command {
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
    let chosen = match options.figure {
        Choice::All => Name::ALL.to_vec(),
        Choice::Fields => vec![Name::Fields],
        Choice::Attempts => vec![Name::Attempts],
        Choice::Forms => vec![Name::Forms],
        Choice::Edges => vec![Name::Edges],
        Choice::Trade => vec![Name::Trade],
        Choice::Drawing => vec![Name::Drawing],
        Choice::Transport => vec![Name::Transport],
        Choice::Specular => vec![Name::Specular],
        Choice::Implicit => vec![Name::Implicit],
        Choice::PathBias => vec![Name::PathBias],
        Choice::Mesh => vec![Name::Mesh],
        Choice::Motions => vec![Name::Motions],
    };
    std::fs::create_dir_all(&options.out)
        .with_context(|| format!("cannot make the folder {}", options.out.display()))?;
    let context = Context::new(options.quality, options.out.clone(), options.seed, chosen.len());
    let mut gallery = Gallery::new("Warped-area sampling", prose::html(figures::INTRODUCTION)?);
    for name in chosen {
        let section = context.figure(name.title(), || name.draw(&context))?;
        gallery = gallery.section(name.number(), section);
    }
    gallery.write(&options.out)?;
    context.finish(&options.out.join("index.html"));
    Ok(())
}
