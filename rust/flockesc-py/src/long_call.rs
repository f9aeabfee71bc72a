//! Calls that may take long: they answer Ctrl-C at once and report their progress.

use std::sync::atomic::{AtomicBool, Ordering};
use std::thread;
use std::time::Duration;

use flockesc_core::Progress;
use pyo3::prelude::*;

use crate::errors::{CoreError, worker_died};

const POLL: Duration = Duration::from_millis(50);

/// Runs `work` on a thread of its own, while this one looks for signals and calls `report(done)`.
///
/// A signal handler that raises (Ctrl-C) or a `report` that raises cancels the work; the exception
/// is passed on once the work has stopped. The last call of `report` comes when all is done.
pub(crate) fn long_call<T: Send>(
    py: Python<'_>,
    report: Option<&Bound<'_, PyAny>>,
    work: impl FnOnce(&Progress) -> flockesc_core::Result<T> + Send,
) -> PyResult<T> {
    let progress = Progress::default();
    let has_returned = AtomicBool::new(false);
    let (watched, returned, watcher) = (&progress, &has_returned, thread::current());
    thread::scope(|scope| {
        let worker = scope.spawn(move || {
            let outcome = work(watched);
            returned.store(true, Ordering::Release);
            watcher.unpark();
            outcome
        });
        let mut raised = Ok(());
        // A worker that panicked is finished without having returned.
        while raised.is_ok() && !returned.load(Ordering::Acquire) && !worker.is_finished() {
            py.detach(|| thread::park_timeout(POLL));
            raised = py.check_signals().and_then(|()| {
                report.map_or(Ok(()), |report| report.call1((watched.done(),)).map(drop))
            });
        }
        if raised.is_err() {
            watched.cancel();
        }
        let outcome = py.detach(|| worker.join()).map_err(|_| worker_died())?;
        raised?;
        let outcome = outcome.map_err(CoreError::from)?;
        if let Some(report) = report {
            report.call1((watched.done(),))?;
        }
        Ok(outcome)
    })
}
