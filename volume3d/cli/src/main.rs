//! The command line `volume3d`: one file per command, and shared files.

mod budget;
mod check;
mod contact;
mod file_kind;
mod fit;
mod gradient;
mod info;
mod lint;
mod memory;
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

/// Renders Mitsuba 3 scenes and differentiates the images with respect to geometry, camera, lights and
/// materials. The default methods are unbiased: a pilot run with few samples chooses between warped-area
/// sampling and edge sampling. Warped-area sampling computes its warp field from a list of the scene's edges,
/// or with --field rays from auxiliary rays.
#[derive(Debug, Parser)]
#[command(name = "volume3d", version, after_long_help = EXAMPLES)]
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

Exit status: 0: success; 1: a file, a scene or a request is invalid, a check fails, or a result is not \
finite; 2: the command line is invalid; 3: noise leaves a check undecided; 130: Ctrl-C; 143: SIGTERM; \
129: SIGHUP. Output files are replaced atomically: at any time a file has its old contents or is complete.";

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
    // From here on a signal does not end the program, so that the last message is printed once.
    let _ = signals::hold();
    match done {
        Ok(report) => {
            let mut out = std::io::stdout();
            match out.write_all(report.text.as_bytes()).and_then(|()| out.flush()) {
                // A closed pipe is not an error: its reader has stopped.
                Err(error) if error.kind() != std::io::ErrorKind::BrokenPipe => {
                    fail(&anyhow!("cannot write to standard output: {error}"))
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

/// Escapes control characters except newlines: text quoted from a file may contain commands for the terminal.
fn printable(text: &str) -> String {
    let keep = |c: char| c == '\n' || !c.is_control();
    text.chars().map(|c| if keep(c) { c.to_string() } else { c.escape_default().to_string() }).collect()
}

/// A usage error in clap's format, with the usage line of its command.
fn usage_error(error: &Usage) -> clap::Error {
    let mut whole = Options::command();
    whole.build();
    match whole.find_subcommand_mut(error.command) {
        Some(command) => command.error(error.kind, &error.message),
        None => whole.error(error.kind, &error.message),
    }
}
