//! The result of a command: its final text and outcome; errors in the use of options.

use std::fmt;
use std::process::ExitCode;

use clap::error::ErrorKind;

/// The text that a command prints at its end, and its outcome.
pub(crate) struct Report {
    pub(crate) text: String,
    pub(crate) outcome: Outcome,
}

/// The outcome of a command that ran to its end.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Outcome {
    /// Success; a check agrees.
    Good,
    /// A check fails, or a result is not finite.
    Bad,
    /// The noise of the samples allowed leaves a check undecided.
    Open,
}

impl From<Outcome> for ExitCode {
    fn from(outcome: Outcome) -> Self {
        match outcome {
            Outcome::Good => Self::SUCCESS,
            Outcome::Bad => Self::FAILURE,
            Outcome::Open => Self::from(OPEN),
        }
    }
}

/// The exit status of a check that noise leaves undecided.
const OPEN: u8 = 3;

/// Options that exclude or require one another; printed like the errors of the option parser.
#[derive(Debug)]
pub(crate) struct Usage {
    pub(crate) command: &'static str,
    pub(crate) kind: ErrorKind,
    pub(crate) message: String,
}

impl fmt::Display for Usage {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(&self.message)
    }
}

impl std::error::Error for Usage {}

/// A usage error of a command.
pub(crate) fn usage(command: &'static str, kind: ErrorKind, message: String) -> anyhow::Error {
    Usage { command, kind, message }.into()
}
