//! The clock of comparisons: processor time, which other programs on the machine hardly disturb.

/// Started by [`Clock::start`].
#[derive(Clone, Copy, Debug)]
pub(crate) struct Clock(f64);

/// The same for what one thread does by itself, whatever the others do; started by [`ThreadClock::start`].
#[derive(Clone, Copy, Debug)]
pub(crate) struct ThreadClock(f64);

impl ThreadClock {
    /// Starts now, on this thread.
    pub(crate) fn start() -> Self {
        Self(thread_seconds())
    }

    /// Seconds that this thread has computed since then.
    pub(crate) fn seconds(self) -> f64 {
        thread_seconds() - self.0
    }
}

impl Clock {
    /// Starts now.
    pub(crate) fn start() -> Self {
        Self(processor_seconds())
    }

    /// Seconds that all threads of this process have computed since then, together.
    pub(crate) fn seconds(self) -> f64 {
        processor_seconds() - self.0
    }
}

#[cfg(unix)]
fn processor_seconds() -> f64 {
    seconds_of(rustix::time::ClockId::ProcessCPUTime)
}

#[cfg(unix)]
fn thread_seconds() -> f64 {
    seconds_of(rustix::time::ClockId::ThreadCPUTime)
}

#[cfg(unix)]
fn seconds_of(clock: rustix::time::ClockId) -> f64 {
    let time = rustix::time::clock_gettime(clock);
    time.tv_sec as f64 + 1e-9 * time.tv_nsec as f64
}

/// Without such a clock: the time that passed, as if every thread had been busy.
#[cfg(not(unix))]
fn processor_seconds() -> f64 {
    thread_seconds() * rayon::current_num_threads() as f64
}

/// Without such a clock: the time that passed.
#[cfg(not(unix))]
fn thread_seconds() -> f64 {
    use std::sync::LazyLock;
    use std::time::Instant;
    static START: LazyLock<Instant> = LazyLock::new(Instant::now);
    START.elapsed().as_secs_f64()
}
