//! Ctrl-C, SIGTERM and SIGHUP end the program in order.
//!
//! Computations check whether to stop. Preparations of a scene do not, and may take minutes: while nothing
//! would be lost, the program exits shortly after a signal, wherever it is.

use std::io::Write as _;
use std::sync::atomic::{AtomicBool, AtomicI32, Ordering};
use std::sync::{Mutex, MutexGuard, PoisonError};
use std::time::Duration;

use anyhow::Context as _;
use volume3d::check::CheckError;
use volume3d::gradient::{GradientError, Stopped};
use volume3d::optimize::ObjectiveError;
use volume3d::tune::TuneError;

/// Set by the first signal.
pub(super) static STOP: AtomicBool = AtomicBool::new(false);

/// The exit status after Ctrl-C, 128 + SIGINT; for other signals it is 128 + their number.
const INTERRUPTED: i32 = 130;

/// The exit status to use.
static STATUS: AtomicI32 = AtomicI32::new(INTERRUPTED);

/// Time for the program to end in order.
const MOMENT: Duration = Duration::from_millis(500);

/// The message printed if the program exits wherever it is; nothing while files are written or a state must
/// be kept.
static FAREWELL: Mutex<Option<String>> = Mutex::new(None);

/// The message of a run that ends without a result.
pub(super) const NOTHING: &str = "stopped; nothing was written";

fn farewell() -> MutexGuard<'static, Option<String>> {
    FAREWELL.lock().unwrap_or_else(PoisonError::into_inner)
}

/// Listens for signals. A second one ends the program at once.
pub(super) fn listen() -> anyhow::Result<()> {
    release(NOTHING);
    platform::listen().context("cannot listen for signals")
}

fn received(status: i32) {
    STATUS.store(status, Ordering::Relaxed);
    if STOP.swap(true, Ordering::Relaxed) {
        std::process::exit(status);
    }
    std::thread::spawn(move || {
        std::thread::sleep(MOMENT);
        // While this lock is held, no writing can begin.
        let farewell = farewell();
        if let Some(words) = &*farewell {
            let _ = writeln!(std::io::stderr(), "{words}");
            std::process::exit(status);
        }
    });
}

/// The exit status after a signal.
pub(super) fn status() -> u8 {
    STATUS.load(Ordering::Relaxed) as u8
}

/// Whether a signal was received.
pub(super) fn is_asked() -> bool {
    STOP.load(Ordering::Relaxed)
}

/// An error if a signal was received.
pub(super) fn stop_if_asked() -> Result<(), Stopped> {
    if is_asked() { Err(Stopped) } else { Ok(()) }
}

/// Whether an error is due to a signal.
pub(super) fn is_stop(error: &anyhow::Error) -> bool {
    let objective = error.downcast_ref::<ObjectiveError>().and_then(|e| match e {
        ObjectiveError::Gradient(e) => Some(e),
        _ => None,
    });
    let check = error.downcast_ref::<CheckError>().and_then(|e| match e {
        CheckError::Gradient(e) => Some(e),
        _ => None,
    });
    let tune = error.downcast_ref::<TuneError>().and_then(|e| match e {
        TuneError::Gradient(e) => Some(e),
        _ => None,
    });
    let gradient = objective.or(check).or(tune).or(error.downcast_ref());
    error.is::<Stopped>() || matches!(gradient, Some(GradientError::Stopped(_)))
}

/// From here on, a signal does not exit the program wherever it is, because files are written or a state must
/// be kept. An error if a signal was received before.
pub(super) fn hold() -> Result<(), Stopped> {
    *farewell() = None;
    stop_if_asked()
}

/// From here on, a signal exits the program with this message, because nothing would be lost.
pub(super) fn release(words: &str) {
    *farewell() = Some(words.to_owned());
}

#[cfg(unix)]
mod platform {
    use signal_hook::consts::{SIGHUP, SIGINT, SIGTERM};
    use signal_hook::iterator::Signals;

    pub(super) fn listen() -> std::io::Result<()> {
        let mut signals = Signals::new([SIGINT, SIGTERM])?;
        // `nohup` ignores it, so that its program outlives the terminal.
        if !is_ignored(SIGHUP) {
            signals.add_signal(SIGHUP)?;
        }
        std::thread::Builder::new().spawn(move || {
            signals.forever().for_each(|signal| super::received(128 + signal));
        })?;
        Ok(())
    }

    /// As reported by Linux; true if not reported.
    fn is_ignored(signal: i32) -> bool {
        let status = std::fs::read_to_string("/proc/self/status").unwrap_or_default();
        let mask = status.lines().find_map(|line| line.strip_prefix("SigIgn:"));
        mask.and_then(|mask| u64::from_str_radix(mask.trim(), 16).ok())
            .is_none_or(|mask| mask & (1 << (signal - 1)) != 0)
    }
}

#[cfg(not(unix))]
mod platform {
    pub(super) fn listen() -> Result<(), ctrlc::Error> {
        ctrlc::set_handler(|| super::received(super::INTERRUPTED))
    }
}
