"""The back end ``ray``: nodes, workers and drivers die, the object store is small; the bytes stay the same.

Needs the extra ray: ``make test-all`` installs it.
"""

import os
import signal
from collections.abc import Iterator, Sequence
from functools import partial
from pathlib import Path
from typing import Any

import pytest
from backends import CALLS, calls, contents, jobs_of, note_calls, start_driver, sweep_jobs

from flockesc_env.jobs import Backend, Cache, Job, find_backend, run
from flockesc_env.jobs.job import Outcomes

ray = pytest.importorskip("ray", reason="ray is not installed (extra ray)")
cluster_utils = pytest.importorskip("ray.cluster_utils")

STORE = {"object_store_memory": 78 * 1024**2}
"""The least that Ray takes."""


@pytest.fixture(scope="module")
def cluster(tmp_path_factory: pytest.TempPathFactory) -> Iterator[Any]:
    """Yield a cluster on this machine: a head without cores, and two nodes of one."""
    with pytest.MonkeyPatch.context() as patch:
        note_calls(tmp_path_factory.mktemp("cluster"), patch)
        patch.setenv("RAY_USAGE_STATS_ENABLED", "0")
        made = cluster_utils.Cluster()
        try:
            made.add_node(num_cpus=0, include_dashboard=False, **STORE)
            for _ in range(2):
                made.add_node(num_cpus=1, **STORE)
            made.wait_for_nodes(120)
            yield made
        finally:
            made.shutdown()


@pytest.fixture
def noted(cluster: Any) -> Path:
    folder = Path(os.environ[CALLS])
    for path in folder.iterdir():
        path.unlink()
    return folder


@pytest.fixture(autouse=True)
def connected(cluster: Any, noted: Path) -> Iterator[None]:
    ray.init(cluster.address, log_to_driver=False)
    yield
    ray.shutdown()


def disturbed(after: int, event: Any) -> Backend:
    """Return the back end ``ray`` with an event after some results."""

    def backend(jobs: Sequence[Job], cache: Cache) -> Outcomes:
        for count, outcome in enumerate(find_backend("ray")(jobs, cache), start=1):
            yield outcome
            if count == after:
                event()

    return backend


def serial_bytes(jobs: list[Job], folder: Path) -> dict[str, bytes]:
    run(jobs, Cache(folder), find_backend("serial"))
    return contents(folder)


def test_results_are_the_same_bytes(cluster: Any, tmp_path: Path) -> None:
    run(sweep_jobs(), Cache(tmp_path / "cache"), find_backend("ray"))
    assert contents(tmp_path / "cache") == serial_bytes(sweep_jobs(), tmp_path / "serial")


def test_a_node_dies(cluster: Any, tmp_path: Path, noted: Path) -> None:
    jobs = jobs_of("slow_square", 12)
    [node, _] = cluster.worker_nodes
    kill = partial(cluster.remove_node, node, allow_graceful=False)
    run(jobs, Cache(tmp_path / "cache"), disturbed(3, kill))
    cluster.add_node(num_cpus=1, **STORE)
    again = calls(noted) - len(jobs)
    print("jobs done again after a node died:", again)
    assert again <= 2  # what ran on the node
    assert contents(tmp_path / "cache") == serial_bytes(jobs, tmp_path / "serial")


def test_a_worker_dies(cluster: Any, tmp_path: Path, noted: Path) -> None:
    found = run(jobs_of("dies_once", 12), Cache(tmp_path / "cache"), find_backend("ray"))
    assert [int(result["square"]) for result in found] == [number**2 for number in range(12)]
    assert calls(noted) == 13


@pytest.mark.parametrize("stop", [signal.SIGKILL, signal.SIGINT])
def test_the_driver_stops(cluster: Any, tmp_path: Path, noted: Path, stop: int) -> None:
    jobs = jobs_of("square", 60)
    driver = start_driver("square", 60, tmp_path / "cache", f"ray:{cluster.address}")
    while len(contents(tmp_path / "cache")) < 10:
        assert driver.poll() is None
    driver.send_signal(stop)
    err = driver.communicate(timeout=60)[1]
    kept = len(contents(tmp_path / "cache"))
    assert 10 <= kept < 60
    if stop == signal.SIGINT:
        assert f"KeyboardInterrupt: {kept} of 60 jobs are finished" in err
    run(jobs, Cache(tmp_path / "cache"), find_backend("ray"))
    again = calls(noted) - len(jobs)
    print(f"jobs done again after the driver stopped ({signal.Signals(stop).name}):", again)
    assert again <= 20
    assert contents(tmp_path / "cache") == serial_bytes(jobs, tmp_path / "serial")
