"""The back end ``processes``: worker processes of this machine. The driver writes the results."""

import os
import signal
import threading
from collections.abc import Iterator, Sequence
from concurrent.futures import ProcessPoolExecutor, as_completed
from concurrent.futures.process import BrokenProcessPool
from contextlib import contextmanager, suppress
from multiprocessing import get_context, parent_process

from flockesc_env.common.errors import InputError
from flockesc_env.jobs.job import Cache, Job, Outcome, Outcomes

ATTEMPTS = 4
"""A job whose worker process died so often has failed; so have all if so many pools finish none."""

_SAFE_PATH, _ONLY_AT_START = "PYTHONSAFEPATH", "workers of flockesc_env"

_DIED = (
    f"its worker process died {ATTEMPTS} times: out of memory? A script that runs jobs needs"
    ' `if __name__ == "__main__":`'
)


def processes(jobs: Sequence[Job], cache: Cache, workers: int | None = None) -> Outcomes:
    """Run jobs in worker processes; None: one per core.

    When a worker dies, its pool ends with it. The jobs that may have run then are tried again, after all
    others and at last one at a time, so that a job that kills its process fails alone.
    """
    cores = len(os.sched_getaffinity(0)) if hasattr(os, "sched_getaffinity") else os.cpu_count() or 1
    workers = workers or cores
    missing = {job.key: job for job in jobs}
    deaths = dict.fromkeys(missing, 0)
    in_vain = 0  # pools in a row that finished no job
    while missing:
        before = len(missing)
        queue = sorted(missing, key=deaths.__getitem__)
        width = min(1 if deaths[queue[0]] > 1 else workers, len(queue))
        with _pool(width) as pool:
            futures = {}
            with _interrupts_blocked(), suppress(BrokenProcessPool):
                for key in queue:
                    futures[pool.submit(Job.attempt, missing[key])] = key
            for future in as_completed(futures):
                error = future.exception()
                if isinstance(error, BrokenProcessPool):
                    continue
                job = missing.pop(futures.pop(future))  # results take memory
                found = future.result() if error is None else repr(error)
                yield Outcome(job, cache.keep(job, found), min(width, len(missing)))
        in_vain = in_vain + 1 if len(missing) == before else 0
        left = [key for key in queue if key in missing]
        for key in left[:width]:  # jobs start in their order
            deaths[key] += 1
        for key in left:
            if deaths[key] == ATTEMPTS or in_vain == ATTEMPTS:
                yield Outcome(missing.pop(key), _DIED, len(missing))


@contextmanager
def _pool(workers: int) -> Iterator[ProcessPoolExecutor]:
    """Yield a pool; on exit, workers that still run are killed.

    A worker starts without the working folder in its path, so that a file such as ``types.py`` there does not
    replace a module of Python; then it takes the driver's path. A system that does not allow so many
    processes, or none, raises ``InputError``.
    """
    _check_threads(workers)
    os.environ.setdefault(_SAFE_PATH, _ONLY_AT_START)
    try:
        pool = ProcessPoolExecutor(workers, get_context("spawn"), _start_worker)
    except (ImportError, OSError) as error:
        _drop_safe_path()
        expected = "serial on a system without semaphores for processes (is /dev/shm writable?)"
        raise InputError("backend", expected, error) from None
    try:
        with one_thread_each():
            yield pool
    finally:
        _drop_safe_path()
        for process in list((pool._processes or {}).values()):
            process.kill()
        pool.shutdown(cancel_futures=True)


def _check_threads(workers: int) -> None:
    """Check that the system can start the threads and processes of a pool; its limit counts both alike.

    The executor waits forever if one of its own threads cannot start.
    """
    count, end, started = 3 * (workers + 1), threading.Event(), list[threading.Thread]()
    try:
        for _ in range(count):
            started.append(threading.Thread(target=end.wait))
            started[-1].start()
    except RuntimeError as error:
        started.pop()
        expected = f"fewer processes or serial: {workers} take {count} threads and processes (see ulimit -u)"
        raise InputError("backend", expected, error) from None
    finally:
        end.set()
        for thread in started:
            thread.join()


@contextmanager
def _interrupts_blocked() -> Iterator[None]:
    """Block Ctrl-C. Workers inherit the mask, so it reaches the driver alone; Windows has no masks."""
    if not hasattr(signal, "pthread_sigmask"):
        yield
        return
    unblocked = signal.pthread_sigmask(signal.SIG_BLOCK, {signal.SIGINT})
    try:
        yield
    finally:
        signal.pthread_sigmask(signal.SIG_SETMASK, unblocked)


def _start_worker() -> None:
    """Let the worker end with the driver, even if that is killed."""
    _drop_safe_path()
    threading.Thread(target=_end_with_driver, daemon=True).start()


def _drop_safe_path() -> None:
    if os.environ.get(_SAFE_PATH) == _ONLY_AT_START:
        del os.environ[_SAFE_PATH]


def _end_with_driver() -> None:
    driver = parent_process()
    assert driver is not None  # noqa: S101, workers are children
    driver.join()
    os._exit(1)


@contextmanager
def one_thread_each() -> Iterator[None]:
    """Let processes that start in the block have one thread of BLAS and torch."""
    before = os.environ.get("OMP_NUM_THREADS")
    os.environ["OMP_NUM_THREADS"] = "1"
    try:
        yield
    finally:
        os.environ.pop("OMP_NUM_THREADS")
        if before is not None:
            os.environ["OMP_NUM_THREADS"] = before
