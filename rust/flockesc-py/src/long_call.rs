//! Long-running calls, which can be interrupted by Ctrl-C and report their progress.

use std::process;
use std::sync::Arc;
use std::sync::mpsc::{RecvTimeoutError, channel};
use std::thread;
use std::time::Duration;

use flockesc_core::{Error, Progress};
use pyo3::exceptions::PyRuntimeError;
use pyo3::marker::Ungil;
use pyo3::prelude::*;

use crate::errors::CoreError;

/// Interval between checks for signals.
const POLL: Duration = Duration::from_millis(50);

/// Time that a step may still take after a signal. With [`POLL`] it is less than the 0.2 s within which Ctrl-C takes effect.
pub(crate) const GRACE: Duration = Duration::from_millis(100);

/// Smallest number of visited agents for a call in its own thread. Such a call takes milliseconds, and
/// starting the thread takes about 1 % of that.
pub(crate) const LONG: usize = 1 << 18;

/// Smallest number of visited agents for a call that releases the GIL. A shorter call takes a few
/// microseconds, and releasing the GIL would take longer: two threads with such calls were half as fast as
/// one.
const SHORT: usize = 1 << 8;

/// Runs `work`, which visits `visits` agents. A long call can be interrupted.
pub(crate) fn run<T: Send + 'static>(
    py: Python<'_>,
    visits: usize,
    work: impl FnOnce(&Progress) -> flockesc_core::Result<T> + Send + 'static,
) -> PyResult<T> {
    if visits < LONG {
        let outcome = maybe_detach(py, visits, || work(&Progress::default()));
        Ok(outcome.map_err(CoreError::from)?)
    } else {
        long_call(py, None, work)
    }
}

/// Runs `work`, which visits `visits` agents, on `state`. A long call can be interrupted, because it runs on
/// a clone.
pub(crate) fn read<S: Clone + Send + 'static, T: Send + 'static>(
    py: Python<'_>,
    state: &S,
    visits: usize,
    work: impl FnOnce(&S, &Progress) -> flockesc_core::Result<T> + Send + 'static,
) -> PyResult<T> {
    let state = state.clone();
    run(py, visits, move |progress| work(&state, progress))
}

/// Runs `work`, which visits `visits` agents and changes `state`. A long call can be interrupted, and then
/// changes nothing.
pub(crate) fn change<S: Clone + Send + 'static, T: Send + 'static>(
    py: Python<'_>,
    state: &mut S,
    visits: usize,
    work: impl FnOnce(&mut S, &Progress) -> flockesc_core::Result<T> + Send + 'static,
) -> PyResult<T> {
    if visits < LONG {
        let outcome = maybe_detach(py, visits, || work(state, &Progress::default()));
        return Ok(outcome.map_err(CoreError::from)?);
    }
    let mut changed = state.clone();
    let (changed, result) = long_call(py, None, move |progress| {
        let result = work(&mut changed, progress)?;
        Ok((changed, result))
    })?;
    *state = changed;
    Ok(result)
}

/// Runs `work`, which visits `visits` agents, and releases the GIL if there are many.
pub(crate) fn maybe_detach<T: Ungil>(
    py: Python<'_>,
    visits: usize,
    work: impl FnOnce() -> T + Ungil,
) -> T {
    if visits < SHORT {
        work()
    } else {
        py.detach(work)
    }
}

/// Runs `work` in a new thread, while the calling thread checks for signals and calls `report(done)`.
///
/// An exception from a signal handler (Ctrl-C) or from `report` is raised at once, and cancels the work after
/// its current model step. The last call of `report` comes after the end of the work.
pub(crate) fn long_call<T: Send + 'static>(
    py: Python<'_>,
    report: Option<&Bound<'_, PyAny>>,
    work: impl FnOnce(&Progress) -> flockesc_core::Result<T> + Send + 'static,
) -> PyResult<T> {
    long_step(py, report, Duration::ZERO, work).map_err(|(error, _)| error)
}

/// As [`long_call`], but waits up to `grace` for the end of the work after an exception from a signal handler. The error
/// is that exception, with the result of the work if it has ended.
pub(crate) fn long_step<T: Send + 'static>(
    py: Python<'_>,
    report: Option<&Bound<'_, PyAny>>,
    grace: Duration,
    work: impl FnOnce(&Progress) -> flockesc_core::Result<T> + Send + 'static,
) -> Result<T, (PyErr, Option<T>)> {
    let progress = Arc::new(Progress::default());
    let _cancel = CancelOnDrop(Arc::clone(&progress));
    let report = |progress: &Progress| match report {
        Some(report) => report.call1((progress.done(),)).map(drop),
        None => Ok(()),
    };
    let (sender, mut receiver) = channel();
    let watched = Arc::clone(&progress);
    let spawned = thread::Builder::new().spawn(move || {
        // Sending fails if the call was interrupted and the receiver was dropped.
        let _ = sender.send(work(&watched));
    });
    if let Err(error) = spawned {
        let expected = "a number of threads that the system can start";
        let error = CoreError::from(Error::input("num_threads", expected, error));
        return Err((error.into(), None));
    }
    let caller = process::id();
    let mut receive = |timeout| {
        let receiver = &mut receiver;
        py.detach(move || receiver.recv_timeout(timeout))
    };
    loop {
        match receive(POLL) {
            Ok(outcome) => {
                report(&progress).map_err(|error| (error, None))?;
                return outcome.map_err(|error| (CoreError::from(error).into(), None));
            }
            Err(RecvTimeoutError::Timeout) => {}
            Err(RecvTimeoutError::Disconnected) => {
                let message = "a worker thread of flockesc_env panicked; please report this bug";
                return Err((PyRuntimeError::new_err(message), None));
            }
        }
        if let Err(error) = py.check_signals() {
            return Err((error, receive(grace).ok().and_then(Result::ok)));
        }
        report(&progress).map_err(|error| (error, None))?;
        if process::id() != caller {
            let message = "the process was forked during this call; only the parent process can finish the call";
            return Err((PyRuntimeError::new_err(message), None)); // by a callback or a signal handler
        }
    }
}

/// Cancels the work of a worker thread when its call ends, also by an exception.
struct CancelOnDrop(Arc<Progress>);

impl Drop for CancelOnDrop {
    fn drop(&mut self) {
        self.0.cancel();
    }
}

/// Marks the process as forked. Python calls it in every child process after a fork.
#[pyfunction]
pub(crate) fn forked() {
    flockesc_core::bindings::forked();
}
