//! The command line `volume3d`: one file for each command, and the files that they share.

mod budget;
mod check;
mod comparison;
mod contact;
mod extent;
mod file_kind;
mod fit;
mod gradient;
mod info;
mod lint;
mod memory;
mod mesh_faults;
mod method;
mod missing;
mod movement;
mod new;
mod one_sided;
mod output;
mod parameter;
mod render;
mod report;
mod reverse;
mod sdf;
mod session;
mod signals;
mod spp;
mod stage;
mod summary;
mod tune;

use std::io::Write;
use std::process::ExitCode;

use anyhow::anyhow;
use clap::{CommandFactory, Parser, Subcommand};

use report::Usage;

/// Renders Mitsuba 3 scenes and differentiates the images with respect to geometry, camera, lights and materials,
/// without bias: by warped-area sampling or edge sampling, between which a pilot of few samples chooses by default. The field of
/// warped area is made of the edges near a direction, which are listed once; --field rays lists none.
#[derive(Debug, Parser)]
#[command(version, after_long_help = EXAMPLES)]
struct Options {
    #[command(subcommand)]
    command: Command,
}

#[derive(Debug, Subcommand)]
enum Command {
    New(new::Options),
    Render(render::Options),
    Gradient(gradient::Options),
    Check(check::Options),
    Tune(tune::Options),
    Info(info::Options),
    Lint(lint::Options),
    Fit(fit::Options),
    Sdf(sdf::Options),
}

const EXAMPLES: &str = "\
Examples:
  volume3d new bunny.obj
  volume3d info scene.xml
  volume3d lint scene.xml
  volume3d render scene.xml -o image.exr --png image.png --spp 256
  volume3d gradient scene.xml --move box:translate:1,0,0 -o gradient.exr --png gradient.png
  volume3d check scene.xml --move box:translate:1,0,0
  volume3d fit fit.toml -o run
  volume3d tune scene.xml --move box:translate:1,0,0 --seconds 10
  volume3d sdf bunny.obj -o bunny.vol --resolution 64

Exit status: 0 if all went well; 1 if a file, a scene or a request cannot be dealt with, a check \
fails or a result is not finite; 2 if the command line cannot be understood; 3 if noise leaves a check open; 130 after Ctrl-C, 143 after SIGTERM, 129 after \
SIGHUP. An output file is at every moment \
what it was before, or complete.";

fn main() -> ExitCode {
    let done = match Options::parse().command {
        Command::New(options) => new::run(&options),
        Command::Render(options) => render::run(&options),
        Command::Gradient(options) => gradient::run(&options),
        Command::Check(options) => check::run(&options),
        Command::Tune(options) => tune::run(&options),
        Command::Info(options) => info::run(&options),
        Command::Lint(options) => lint::run(&options),
        Command::Fit(options) => fit::run(&options),
        Command::Sdf(options) => sdf::run(&options),
    };
    // The last message is printed once.
    let _ = signals::hold();
    match done {
        Ok(report) => {
            let mut out = std::io::stdout();
            match out.write_all(report.text.as_bytes()).and_then(|()| out.flush()) {
                // Who closed the pipe does not want to read on: no error.
                Err(error) if error.kind() != std::io::ErrorKind::BrokenPipe => {
                    fail(&anyhow!("cannot write on the standard output: {error}"))
                }
                _ => report.outcome.into(),
            }
        }
        Err(error) => fail(&error),
    }
}

fn fail(error: &anyhow::Error) -> ExitCode {
    if let Some(usage) = error.downcast_ref::<Usage>() {
        let _ = usage_error(usage).print();
        return ExitCode::from(2);
    }
    if let Some(interrupted) = error.downcast_ref::<fit::Interrupted>() {
        let _ = writeln!(std::io::stderr(), "{}", printable(&interrupted.to_string()));
        return ExitCode::from(signals::status());
    }
    if signals::is_stop(error) {
        session::say(&format!("{}\n", signals::NOTHING));
        return ExitCode::from(signals::status());
    }
    let _ = writeln!(std::io::stderr(), "error: {}", printable(&error.to_string()));
    ExitCode::FAILURE
}

/// A text without what a terminal obeys: control characters of a file that is quoted become escapes.
fn printable(text: &str) -> String {
    let keep = |c: char| c == '\n' || !c.is_control();
    text.chars().map(|c| if keep(c) { c.to_string() } else { c.escape_default().to_string() }).collect()
}

/// A usage error as clap prints its own, with the usage line of its command.
fn usage_error(error: &Usage) -> clap::Error {
    let mut whole = Options::command();
    whole.build();
    match whole.find_subcommand_mut(error.command) {
        Some(command) => command.error(error.kind, &error.message),
        None => whole.error(error.kind, &error.message),
    }
}
