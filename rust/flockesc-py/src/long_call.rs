//! Long-running calls, which can be interrupted by Ctrl-C and report their progress.

use std::process;
use std::sync::Arc;
use std::sync::mpsc::{Receiver, RecvTimeoutError, channel};
use std::thread;
use std::time::Duration;

use flockesc_core::Progress;
use pyo3::marker::Ungil;
use pyo3::prelude::*;

use crate::errors::{CoreError, forked_within, worker_died};

/// Interval between checks for signals.
const POLL: Duration = Duration::from_millis(50);

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
    let outcome = LongCall::start(work)?.finish(py, report)?;
    Ok(outcome.map_err(CoreError::from)?)
}

/// Work in its own thread. Dropping it cancels the work.
pub(crate) struct LongCall<T> {
    progress: Arc<Progress>,
    outcome: Receiver<T>,
    process: u32,
}

impl<T: Send + 'static> LongCall<T> {
    pub(crate) fn start(work: impl FnOnce(&Progress) -> T + Send + 'static) -> PyResult<Self> {
        let progress = Arc::new(Progress::default());
        let (sender, outcome) = channel();
        let watched = Arc::clone(&progress);
        thread::Builder::new().spawn(move || {
            // Sending fails if the call was cancelled and its receiver was dropped.
            let _ = sender.send(work(&watched));
        })?;
        Ok(Self {
            progress,
            outcome,
            process: process::id(),
        })
    }

    /// Waits for the outcome, checks for signals and reports progress. Returns exceptions from signal
    /// handlers and from `report`.
    pub(crate) fn finish(
        &mut self,
        py: Python<'_>,
        report: Option<&Bound<'_, PyAny>>,
    ) -> PyResult<T> {
        let report = |progress: &Progress| match report {
            Some(report) => report.call1((progress.done(),)).map(drop),
            None => Ok(()),
        };
        loop {
            let outcome = self.wait(py, POLL)?;
            if outcome.is_none() {
                py.check_signals()?;
            }
            report(&self.progress)?;
            if let Some(outcome) = outcome {
                return Ok(outcome);
            }
            if process::id() != self.process {
                return Err(forked_within());
            }
        }
    }

    /// Waits for at most `timeout` and returns the outcome, if there is one.
    pub(crate) fn wait(&mut self, py: Python<'_>, timeout: Duration) -> PyResult<Option<T>> {
        let outcome = &mut self.outcome;
        match py.detach(move || outcome.recv_timeout(timeout)) {
            Ok(outcome) => Ok(Some(outcome)),
            Err(RecvTimeoutError::Timeout) => Ok(None),
            Err(RecvTimeoutError::Disconnected) => Err(worker_died()),
        }
    }
}

impl<T> Drop for LongCall<T> {
    fn drop(&mut self) {
        self.progress.cancel();
    }
}
