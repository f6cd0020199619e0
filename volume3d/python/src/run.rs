//! Work outside Python's global lock, which Ctrl-C ends.

use std::any::Any;
use std::panic::{AssertUnwindSafe, catch_unwind};
use std::sync::atomic::{AtomicBool, AtomicUsize, Ordering};
use std::sync::mpsc::{RecvTimeoutError, sync_channel};
use std::sync::{Arc, Mutex, PoisonError};
use std::time::Duration;

use pyo3::exceptions::PyValueError;
use pyo3::prelude::*;
use rayon::{ThreadPool, ThreadPoolBuilder};
use volume3d::gradient::Progress;

use crate::errors::InternalError;

/// Interval at which signals are handled and progress is reported.
const INTERVAL: Duration = Duration::from_millis(50);

/// The threads of one process.
struct Threads {
    process: u32,
    /// The number asked for; 0 is one per core.
    asked: usize,
    pool: Arc<ThreadPool>,
}

/// A forked child has none of its parent's threads, so the pool belongs to a process.
static THREADS: Mutex<Option<Threads>> = Mutex::new(None);

/// The pool of this process, with as many threads as `asked`, or as before.
fn pool(asked: Option<usize>) -> PyResult<Arc<ThreadPool>> {
    let process = std::process::id();
    let mut threads = THREADS.lock().unwrap_or_else(PoisonError::into_inner);
    let before = threads.as_ref().map_or(0, |threads| threads.asked);
    let asked = asked.unwrap_or(before);
    if let Some(current) = threads.take() {
        if current.process != process {
            // Its threads belong to the parent: to drop the pool would wait for them.
            std::mem::forget(current);
        } else if current.asked == asked {
            let pool = Arc::clone(&current.pool);
            *threads = Some(current);
            return Ok(pool);
        }
    }
    let pool = ThreadPoolBuilder::new().num_threads(asked).build();
    let pool = Arc::new(pool.map_err(|error| PyValueError::new_err(error.to_string()))?);
    *threads = Some(Threads { process, asked, pool: Arc::clone(&pool) });
    Ok(pool)
}

/// Sets the number of threads of this process; 0 is one per core.
#[pyfunction]
pub(crate) fn set_num_threads(py: Python<'_>, threads: usize) -> PyResult<()> {
    py.detach(|| pool(Some(threads)))?;
    Ok(())
}

/// The number of threads of this process.
#[pyfunction]
pub(crate) fn num_threads(py: Python<'_>) -> PyResult<usize> {
    Ok(py.detach(|| pool(None))?.current_num_threads())
}

/// Runs `work` on the pool, without the global lock. A signal that raises an exception in Python, such as
/// Ctrl-C, cancels the work, and so does an exception of `report`, which is called with the numbers of steps
/// done and in total. A panic becomes an [`InternalError`].
pub(crate) fn run<T: Send>(
    py: Python<'_>,
    report: Option<&Py<PyAny>>,
    work: impl FnOnce(&Progress) -> T + Send,
) -> PyResult<T> {
    let pool = py.detach(|| pool(None))?;
    let (stop, done, total) =
        (Arc::new(AtomicBool::new(false)), Arc::new(AtomicUsize::new(0)), Arc::new(AtomicUsize::new(0)));
    let progress = {
        let (stop, done, total) = (Arc::clone(&stop), Arc::clone(&done), Arc::clone(&total));
        let start = move |steps| {
            total.fetch_add(steps, Ordering::Relaxed);
        };
        let step = move || {
            done.fetch_add(1, Ordering::Relaxed);
        };
        Progress::new(start, step).until(move || stop.load(Ordering::Relaxed))
    };
    let attend = || {
        Python::attach(|py| {
            py.check_signals()?;
            let counts = (done.load(Ordering::Relaxed), total.load(Ordering::Relaxed));
            report.map_or(Ok(()), |report| report.call1(py, counts).map(drop))
        })
    };
    let (result, exception) = py.detach(|| {
        std::thread::scope(|scope| {
            let (send, receive) = sync_channel(1);
            scope.spawn(move || {
                let result = catch_unwind(AssertUnwindSafe(|| pool.install(|| work(&progress))));
                // The receiver waits for it.
                let _ = send.send(result);
            });
            let mut exception = None;
            loop {
                match receive.recv_timeout(INTERVAL) {
                    Ok(result) => return (Some(result), exception),
                    Err(RecvTimeoutError::Disconnected) => return (None, exception),
                    Err(RecvTimeoutError::Timeout) if exception.is_none() => {
                        if let Err(raised) = attend() {
                            stop.store(true, Ordering::Relaxed);
                            exception = Some(raised);
                        }
                    }
                    Err(RecvTimeoutError::Timeout) => {}
                }
            }
        })
    });
    if let Some(exception) = exception {
        return Err(exception);
    }
    if report.is_some() {
        attend()?;
    }
    match result {
        Some(Ok(value)) => Ok(value),
        Some(Err(panic)) => Err(InternalError::new_err(words(&*panic))),
        None => Err(InternalError::new_err("a thread ended without a result")),
    }
}

/// The message of a panic.
fn words(panic: &(dyn Any + Send)) -> String {
    let text = panic.downcast_ref::<&str>().map(|text| (*text).to_owned());
    let text = text.or_else(|| panic.downcast_ref::<String>().cloned()).unwrap_or_default();
    format!("{text} (a fault of volume3d, please report it)")
}
