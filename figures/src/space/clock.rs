//! The clock of comparisons: processor time, which other programs on the machine hardly disturb.

/// A clock of the process, started by [`Clock::start`].
#[derive(Clone, Copy, Debug)]
pub(crate) struct Clock(f64);

/// A clock of one thread alone, whatever the others do; started by [`ThreadClock::start`].
#[derive(Clone, Copy, Debug)]
pub(crate) struct ThreadClock(f64);

impl ThreadClock {
    /// Starts now, on this thread.
    pub(crate) fn start() -> Self {
        Self(thread_seconds())
    }

    /// Processor seconds of this thread since the start.
    pub(crate) fn seconds(self) -> f64 {
        thread_seconds() - self.0
    }
}

impl Clock {
    /// Starts now.
    pub(crate) fn start() -> Self {
        Self(processor_seconds())
    }

    /// Processor seconds of all threads of this process since the start, together.
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

/// Fallback without such a clock: elapsed time, as if every thread had been busy.
#[cfg(not(unix))]
fn processor_seconds() -> f64 {
    thread_seconds() * rayon::current_num_threads() as f64
}

/// Fallback without such a clock: elapsed time.
#[cfg(not(unix))]
fn thread_seconds() -> f64 {
    use std::sync::LazyLock;
    use std::time::Instant;
    static START: LazyLock<Instant> = LazyLock::new(Instant::now);
    START.elapsed().as_secs_f64()
}
