//! The command line: images, derivatives of images, and what one wants to know before trusting them.

mod cli;

use std::process::ExitCode;

fn main() -> ExitCode {
    cli::main()
}
