"""Run jobs by a back end, with one progress bar."""

import re
from collections.abc import Callable, Iterable, Sequence
from contextlib import closing
from functools import partial
from multiprocessing import current_process
from pathlib import Path
from typing import Any

from flockesc_env.common.checks import as_flag, as_floats, as_instance, as_path, as_text
from flockesc_env.common.errors import InputError, JobError, shown
from flockesc_env.common.extras import require
from flockesc_env.common.files import check_writable
from flockesc_env.common.progress import progress_bar
from flockesc_env.jobs.job import Arrays, Cache, Job, Outcome, Outcomes, import_name
from flockesc_env.jobs.processes import processes

Backend = Callable[[Sequence[Job], Cache], Outcomes]
"""Runs jobs; yields an outcome for each of them, in any order, once its results are in the cache."""

BACKENDS = "serial, processes[:N], ray[:ADDRESS] or slurm[:KEY=VALUE,..]"
_NUMBER = re.compile(r"[0-9]{1,18}")
_SHOWN_FAILURES = 5
_SHOWN_CHARACTERS = 1000  # of the arguments of a training run


def serial(jobs: Sequence[Job], cache: Cache) -> Outcomes:
    """Run one job after another in this process."""
    for job in jobs:
        yield Outcome(job, cache.keep(job, job.attempt()), 1)


def find_backend(spec: str) -> Backend:
    """Return the back end that a text such as ``"processes:4"`` names; Ray and SLURM need their extras."""
    name, _, rest = as_text(spec, "backend").partition(":")
    if spec == "serial":
        return serial
    if name == "processes" and current_process().daemon:
        raise InputError("backend", "serial in a daemonic process, which cannot have children", shown(spec))
    if name == "processes" and (not rest or (_NUMBER.fullmatch(rest) and int(rest) > 0)):
        return partial(processes, workers=int(rest) if rest else None)
    if name == "ray":
        require("ray", ["ray"])
        from flockesc_env.jobs.ray import ray_tasks  # heavy, and of an extra

        return partial(ray_tasks, address=rest or None)
    pairs = [pair.partition("=") for pair in rest.split(",")] if rest else []
    if name == "slurm" and all(key and value for key, _, value in pairs):
        require("slurm", ["submitit"])
        from flockesc_env.jobs.slurm import slurm

        options = {key: int(value) if _NUMBER.fullmatch(value) else value for key, _, value in pairs}
        return partial(slurm, **options)  # type: ignore[arg-type]  # submitit checks them
    raise InputError("backend", f"one of {BACKENDS}", shown(spec))


def run(
    jobs: Sequence[Job], cache: Cache, backend: Backend, *, title: str = "Jobs", progress: bool = False
) -> list[Arrays]:
    """Run the jobs that the cache lacks, the longest first; return the results of all, in their order.

    A job is computed again only if its file in the cache is damaged. ``title`` stands before the progress
    bar, which ``progress`` shows even if stderr is not a terminal. Errors are those of ``run_jobs``.
    """
    unique = {job.key: job for job in jobs}
    results = {key: done for key, job in unique.items() if (done := cache.find(job)) is not None}
    queue = sorted((unique[key] for key in unique if key not in results), key=lambda job: -job.seconds)
    if queue:
        check_writable(cache.folder / ".part")
    failures = list[Outcome]()
    finished, ended, total = 0, 0.0, sum(job.seconds for job in queue)
    form = "{desc}: {percentage:3.0f}% {bar}{postfix} [{elapsed}, {remaining} left]"
    with progress_bar(title, total, always=progress, form=form) as report:
        try:
            with closing(backend(queue, cache)) as outcomes:
                for outcome in outcomes:
                    failures += [outcome] if outcome.error is not None else []
                    finished += outcome.error is None
                    ended += outcome.job.seconds
                    counts = f"{finished} finished, {outcome.running} running, {len(failures)} failed"
                    report(ended, total, counts)
        except KeyboardInterrupt:
            # Ctrl-C may come between a result and its count.
            finished = sum(job in cache for job in queue)
            kept = f"{finished} of {len(queue)} jobs are finished and kept in {cache.folder}"
            raise KeyboardInterrupt(f"{kept}; run the same again to continue") from None
    if failures:
        failed = f"{len(failures)} of {len(queue)} jobs failed"
        lines = [f"{failed}; the results of all others are kept in {cache.folder}"]
        for job, error, _ in failures[:_SHOWN_FAILURES]:
            lines += [f"{job.function}{shown(job.arguments, _SHOWN_CHARACTERS)}:", str(error).rstrip()]
        if len(failures) > _SHOWN_FAILURES:
            lines.append(f".. and {len(failures) - _SHOWN_FAILURES} more")
        raise JobError("\n".join(lines))
    return [results.pop(job.key, {}) or cache.get(job) for job in jobs]


def run_jobs(
    function: Callable[..., Any],
    arguments: Iterable[tuple[Any, ...]],
    *,
    cache: str | Path,
    backend: str = "processes",
    seconds: float = 1.0,
    progress: bool = False,
) -> list[Arrays]:
    """Call a pure function with many tuples of arguments; return its results in their order.

    The function runs in other processes, maybe on other machines: it is a function of a module that they can
    import, takes plain data and returns arrays by name. A result is kept under a hash of the function's name,
    its arguments and the compiled core. Use another folder after you change the function.

    Args:
        function: returns a dict of arrays or numbers.
        arguments: a tuple for each call; ``Job.arguments`` names the types.
        cache: folder of the results; calls with results in it are not repeated.
        backend: "serial", "processes[:N]", "ray[:ADDRESS]" or "slurm:KEY=VALUE,..".
        seconds: estimated time of one call.
        progress: whether to show a progress bar even if stderr is not a terminal.

    Raises:
        JobError: if calls fail, with their arguments and tracebacks; the results of all others are kept.
        KeyboardInterrupt: on Ctrl-C; finished results are kept.

    docs/long-work.md has an example.
    """
    name = import_name(function, "function", "a function of a module that other processes can import")
    estimate, is_shown = float(as_floats(seconds, "seconds", (), least=0.0)), as_flag(progress, "progress")
    jobs = [
        Job(name, tuple(as_instance(call, f"arguments[{index}]", tuple)), estimate)
        for index, call in enumerate(arguments)
    ]
    return run(jobs, Cache(as_path(cache, "cache")), find_backend(backend), progress=is_shown)
