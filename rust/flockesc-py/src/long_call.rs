//! Calls that may take long: they answer Ctrl-C at once and report their progress.

use std::process;
use std::sync::Arc;
use std::sync::mpsc::{Receiver, RecvTimeoutError, channel};
use std::thread;
use std::time::Duration;

use flockesc_core::Progress;
use pyo3::marker::Ungil;
use pyo3::prelude::*;

use crate::errors::{CoreError, forked_within, worker_died};

const POLL: Duration = Duration::from_millis(50);

/// Agents visited from which on a call is watched: it takes milliseconds, of which starting a thread is about a hundredth.
pub(crate) const LONG: usize = 1 << 18;

/// Agents visited below which a call keeps the interpreter: handing it to another thread and getting it back takes longer
/// than the few microseconds of such a call, and two threads that did so were half as fast as one.
const SHORT: usize = 1 << 8;

/// Runs `work`, which visits so many agents; other threads run Python meanwhile, if it takes long enough.
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

/// Runs `work` on a thread of its own, while this one looks for signals and calls `report(done)`.
///
/// A signal handler that raises (Ctrl-C) or a `report` that raises gives the work up: the exception is passed on at
/// once, and the thread ends with the step of the model that it is at. The last call of `report` comes when all is
/// done.
pub(crate) fn long_call<T: Send + 'static>(
    py: Python<'_>,
    report: Option<&Bound<'_, PyAny>>,
    work: impl FnOnce(&Progress) -> flockesc_core::Result<T> + Send + 'static,
) -> PyResult<T> {
    let outcome = LongCall::start(work)?.finish(py, report)?;
    Ok(outcome.map_err(CoreError::from)?)
}

/// Work on a thread of its own, which is told to stop when this is dropped.
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
            // Nobody receives what was given up.
            let _ = sender.send(work(&watched));
        })?;
        Ok(Self {
            progress,
            outcome,
            process: process::id(),
        })
    }

    /// Waits for the outcome; looks for signals and reports meanwhile, and passes on what they raise.
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

    /// The outcome, if it comes in time.
    pub(crate) fn wait(&mut self, py: Python<'_>, patience: Duration) -> PyResult<Option<T>> {
        let outcome = &mut self.outcome;
        match py.detach(move || outcome.recv_timeout(patience)) {
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
