"""Every back end gives the same bytes after any process dies; a second call runs the missing jobs."""

import os
import signal
import subprocess
import sys
import time
from collections.abc import Callable, Iterator
from contextlib import suppress
from functools import partial
from importlib.util import find_spec
from operator import itemgetter
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest
from backends import SQUARE, calls, contents, jobs_of, note_calls, square, start_driver, sweep_jobs
from cli_runs import SMALL_FLAGS, npz, small_files

from flockesc_env.common.errors import InputError
from flockesc_env.jobs import Cache, Job, JobError, find_backend, run, run_jobs

NUMBERS = [(number,) for number in range(12)]
needs_submitit = pytest.mark.skipif(not find_spec("submitit"), reason="no submitit (extra slurm)")
BACKENDS = ["serial", "processes:2", pytest.param("slurm:cluster=local", marks=needs_submitit)]
Start = Callable[[str, int], "subprocess.Popen[str]"]
CALL = 'run_jobs(own, [(n,) for n in range(99)], cache="cache", backend="processes:1")'
OWN = "from flockesc_env.jobs import run_jobs\ndef own(n): return {'x': n}\n"
GUARDED = f'{OWN}if __name__ == "__main__":\n    print(len({CALL}))'
SCRIPTS = {
    **dict.fromkeys(("my-scan.py", "01_scan.py", "scan v2.py"), (GUARDED, [])),
    "scan.v2.py": (GUARDED, ["scan.v2.py, which is not found as the module 'scan.v2': rename it"]),
    "safe.py": (GUARDED, ["safe.py, which is not found as the module 'safe': rename it"]),
    # Workers are not started for ever.
    "unguarded.py": (OWN + CALL, ["99 of 99 jobs failed", 'needs `if __name__ == "__main__":`']),
}
DAMAGES: list[Callable[[bytes, bytes], bytes]] = [
    lambda whole, _: b"",
    lambda whole, _: whole[: len(whole) // 2],
    lambda whole, _: whole[:-1],
    lambda whole, _: bytes(len(whole)),
    lambda whole, _: whole[:40] + bytes([whole[40] ^ 1]) + whole[41:],
    lambda whole, _: whole[:-40],
    lambda _, other: other,
    lambda _, other: npz(square=np.array(np.nan)),
]
"""Empty, truncated, zeros, a flipped bit, without a hash, of another job, arrays of another kind."""


@pytest.fixture(autouse=True)
def noted(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    return note_calls(tmp_path, monkeypatch)


def squares(results: list[dict[str, Any]]) -> list[int]:
    return [int(result["square"]) for result in results]


@pytest.mark.parametrize("backend", BACKENDS)
def test_results_are_the_same_bytes_in_the_order_of_the_jobs(backend: str, tmp_path: Path) -> None:
    jobs = sweep_jobs()
    direct = [job.run() for job in jobs]
    found = run(jobs, Cache(tmp_path / "cache"), find_backend(backend))
    for one, other in zip(direct, found, strict=True):
        assert one.keys() == other.keys()
        assert all(one[name].tobytes() == other[name].tobytes() for name in one)
    run(jobs, Cache(tmp_path / "serial"), find_backend("serial"))
    assert contents(tmp_path / "cache") == contents(tmp_path / "serial")


@pytest.mark.parametrize("backend", BACKENDS)
def test_a_failed_job_is_named_and_the_others_finish(backend: str, tmp_path: Path, noted: Path) -> None:
    with pytest.raises(
        JobError, match=r"(?s)2 of 4 jobs failed.*backends:fails\(1,\).*Zero.*odd 1"
    ) as caught:
        run(jobs_of("fails", 4), Cache(tmp_path / "cache"), find_backend(backend))
    assert "odd 3" in str(caught.value)
    assert len(contents(tmp_path / "cache")) == 2
    with pytest.raises(JobError, match="2 of 2 jobs failed"):
        run(jobs_of("fails", 4), Cache(tmp_path / "cache"), find_backend(backend))
    assert calls(noted) == 6


@pytest.mark.parametrize("backend", BACKENDS[1:])
def test_a_worker_dies(backend: str, tmp_path: Path, noted: Path) -> None:
    found = run(jobs_of("dies_once"), Cache(tmp_path / "cache"), find_backend(backend))
    assert squares(found) == [number**2 for (number,) in NUMBERS]
    assert calls(noted, 5) == 2
    stored = (tmp_path / "stored").read_text().split()
    kept = Cache(tmp_path / "cache")
    numbers = [n for n, job in enumerate(jobs_of("dies_once")) if kept.path(job).name in stored]
    assert len(numbers) == len(stored)
    assert all(calls(noted, number) == 1 for number in numbers)  # a stored result is not computed again


@pytest.mark.parametrize("backend", BACKENDS)
def test_a_job_that_exits_or_returns_no_arrays_fails_alone(backend: str, tmp_path: Path) -> None:
    *jobs, long = jobs_of("misbehaves", 7)
    with pytest.raises(JobError, match="results: expected the name of an array of at most 65,531 bytes, got"):
        run([long], Cache(tmp_path / "cache"), find_backend(backend))
    with pytest.raises(JobError, match="5 of 6 jobs failed") as caught:
        run(jobs, Cache(tmp_path / "cache"), find_backend(backend))
    for text in ("got 1", "got 'file'", "got 'x.npy'", "got None", "SystemExit: done"):
        assert text in str(caught.value)
    assert len(contents(tmp_path / "cache")) == 1


@pytest.mark.parametrize("backend", BACKENDS[:2])
def test_a_result_that_cannot_be_written_fails_alone(backend: str, tmp_path: Path) -> None:
    jobs, kept = [Job("backends:large", (1,)), *jobs_of("square", 3)], Cache(tmp_path / "cache")
    kept.path(jobs[1]).mkdir(parents=True)
    with (
        small_files(10_000),
        pytest.warns(UserWarning, match="got a folder, a damaged file"),
        pytest.raises(JobError, match="2 of 4 jobs failed") as caught,
    ):
        run(jobs, kept, find_backend(backend))
    for text in ("backends:large(1,):\nits results cannot be written: [Errno 27] File too", "square(0,)"):
        assert text in str(caught.value)
    assert all(job in kept for job in jobs[2:])


@pytest.mark.parametrize(
    "function",
    [partial(square, 1), "".join, itemgetter(0), lambda _: {}, None, "backends:square"],
    ids=["partial", "method", "object", "lambda", "None", "str"],
)
def test_a_function_that_others_cannot_import_is_refused(function: Any, tmp_path: Path) -> None:
    with pytest.raises(InputError, match="function: expected a function of a module"):
        run_jobs(function, [(1,)], cache=tmp_path)


def test_a_job_that_always_kills_its_worker_fails_alone(tmp_path: Path) -> None:
    with pytest.raises(JobError, match=r"1 of 6 jobs failed[^:]*\nbackends:dies\(1,\)"):
        run(jobs_of("dies", 6), Cache(tmp_path / "cache"), find_backend("processes:2"))
    assert len(contents(tmp_path / "cache")) == 5


def ran(*command: object) -> "subprocess.CompletedProcess[str]":
    return subprocess.run(list(map(str, command)), capture_output=True, text=True, check=False)  # noqa: S603


def test_a_file_named_like_a_module_of_python_does_not_replace_it_in_workers(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.chdir(tmp_path)
    Path("types.py").touch()
    flags = ["--interaction-ranges", 5, "--seeds", "0:1", *SMALL_FLAGS, "--backend", "processes:1"]
    ended = ran(Path(sys.executable).with_name("flockesc"), "sweep", *flags, "--cache", "cache")
    assert ended.returncode == 0, ended.stderr


@pytest.mark.parametrize("name", SCRIPTS)
def test_a_script_works_or_is_told_why(name: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.chdir(tmp_path)
    script, causes = SCRIPTS[name]
    (tmp_path / name).write_text(script)
    if name == "safe.py":
        monkeypatch.setenv("PYTHONSAFEPATH", "1")
    ended = ran(sys.executable, tmp_path / name)
    assert (ended.returncode, ended.stdout) == ((1, "") if causes else (0, "99\n")), ended.stderr
    assert all(cause in ended.stderr for cause in causes)


def refuse(error: Exception) -> Callable[..., Any]:
    def call(*_: object) -> None:
        raise error

    return call


def test_a_system_without_workers_or_stderr(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """Daemonic processes, limits on processes and a read-only /dev/shm are refused, and serial works."""
    cache = tmp_path / "cache"
    for name, value in (
        ("driver.current_process", lambda: SimpleNamespace(daemon=True)),
        ("processes.threading.Thread.start", refuse(RuntimeError("can't start new thread"))),
        ("processes.ProcessPoolExecutor", refuse(OSError(30, "Read-only file system"))),
    ):
        with monkeypatch.context() as patch:
            patch.setattr(f"flockesc_env.jobs.{name}", value)
            patch.setattr("tqdm.tqdm.monitor_interval", 0)
            with pytest.raises(InputError, match=r"backend: expected .*serial"):
                run_jobs(square, NUMBERS, cache=cache, backend="processes:2")
    monkeypatch.setattr(sys, "stderr", None)
    assert squares(run_jobs(square, NUMBERS[:2], cache=cache, backend="serial", progress=True)) == [0, 1]


@pytest.fixture
def start(tmp_path: Path) -> Iterator[Start]:
    """Start drivers; none outlives the test."""
    drivers = []

    def start(backend: str, count: int) -> subprocess.Popen[str]:
        drivers.append(start_driver("square", count, tmp_path / "cache", backend))
        return drivers[-1]

    yield start
    for driver in drivers:
        with suppress(ProcessLookupError):
            os.killpg(driver.pid, signal.SIGKILL)


def wait_for(driver: subprocess.Popen[str], folder: Path, count: int) -> None:
    has_ended = False
    while len(contents(folder)) < count:
        assert not has_ended, driver.communicate()
        has_ended = driver.poll() is not None
        time.sleep(0.001)


@pytest.mark.parametrize("backend", BACKENDS[1:])
def test_the_driver_is_killed(backend: str, tmp_path: Path, noted: Path, start: Start) -> None:
    numbers = [(n,) for n in range(60)]
    driver = start(backend, len(numbers))
    wait_for(driver, tmp_path / "cache", 5)
    driver.kill()
    outlives = backend.startswith("slurm")  # its task ends later, and then closes the pipes
    if not outlives:
        driver.communicate(timeout=60)
    kept = Cache(tmp_path / "cache")
    stored = [n for n in range(60) if kept.path(Job(SQUARE, (n,))).exists()]
    found = run_jobs(square, numbers, cache=tmp_path / "cache", backend=backend)
    driver.communicate(timeout=60)
    assert squares(found) == [n**2 for (n,) in numbers]
    assert len(stored) >= 5
    assert all(calls(noted, number) == 1 for number in stored)
    run_jobs(square, numbers, cache=tmp_path / "again", backend="serial")
    assert contents(tmp_path / "cache") == contents(tmp_path / "again")


@pytest.mark.parametrize("backend", ["serial", "processes:2"])
def test_ctrl_c_keeps_what_is_finished_and_says_how_to_continue(
    backend: str, tmp_path: Path, start: Start
) -> None:
    driver = start(backend, 200)
    wait_for(driver, tmp_path / "cache", 5)
    os.killpg(driver.pid, signal.SIGINT)
    out, err = driver.communicate(timeout=60)
    kept = len(contents(tmp_path / "cache"))
    assert out == ""
    assert f"KeyboardInterrupt: {kept} of 200 jobs are finished" in err
    assert "run the same again to continue" in err
    assert err.count("Traceback") == 1  # the driver's; workers end silently


def test_two_drivers_share_a_cache(tmp_path: Path, start: Start) -> None:
    drivers = [start("serial", 60) for _ in range(2)]
    for driver in drivers:
        assert driver.communicate(timeout=60)[0] == "done\n"
    assert len(contents(tmp_path / "cache")) == 60
    assert len(list((tmp_path / "cache").iterdir())) == 60  # nothing unfinished is left
    run_jobs(square, [(n,) for n in range(60)], cache=tmp_path / "alone", backend="serial")
    assert contents(tmp_path / "cache") == contents(tmp_path / "alone")


@pytest.mark.parametrize("backend", BACKENDS)
def test_another_engine_is_refused_by_name(backend: str, tmp_path: Path) -> None:
    job = Job(SQUARE, (3,), engine="0123456789abcdef")
    with pytest.raises(JobError, match="engine: expected build 0123456789ab, got"):
        run([job], Cache(tmp_path), find_backend(backend))


@pytest.mark.parametrize("backend", ["processes:1", BACKENDS[2]])
def test_workers_take_one_thread(backend: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("OMP_NUM_THREADS", "7")
    [found] = run([Job("backends:threads", ())], Cache(tmp_path), find_backend(backend))
    assert (int(found["engine"]), int(found["blas"])) == (1, 1)
    assert os.environ["OMP_NUM_THREADS"] == "7"


@pytest.mark.parametrize("backend", BACKENDS)
def test_damaged_results_are_named_and_computed_again(backend: str, tmp_path: Path, noted: Path) -> None:
    jobs, kept = jobs_of("square", len(DAMAGES) + 1), Cache(tmp_path / "cache")
    run(jobs, kept, find_backend("serial"))
    whole = contents(kept.folder)
    other = kept.path(jobs[-1]).read_bytes()
    for job, damage in zip(jobs, DAMAGES, strict=False):
        kept.path(job).write_bytes(damage(kept.path(job).read_bytes(), other))
    with pytest.warns(UserWarning, match="damaged file or another job's") as warned:
        found = run(jobs, kept, find_backend(backend))
    assert squares(found) == [number**2 for number in range(len(jobs))]
    assert contents(kept.folder) == whole
    assert calls(noted) == len(jobs) + len(DAMAGES)
    assert {str(kept.path(job)) for job in jobs[:-1]} == {str(w.message).split(": ")[0] for w in warned}


def test_longest_jobs_run_first_and_equal_jobs_once(tmp_path: Path, noted: Path) -> None:
    order = []

    def backend(jobs: Any, kept: Cache) -> Any:
        order.extend(job.arguments[0] for job in jobs)
        yield from find_backend("serial")(jobs, kept)

    jobs = [Job(SQUARE, (number,), seconds) for number, seconds in ((1, 1.0), (2, 5.0), (3, 1.0), (2, 5.0))]
    for _ in range(2):
        found = run(jobs, Cache(tmp_path / "cache"), backend)
        assert squares(found) == [1, 4, 9, 4]
        assert found[1]["square"] is not found[3]["square"]
    assert order == [2, 1, 3]
    assert calls(noted) == 3
