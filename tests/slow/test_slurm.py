"""The back end ``slurm`` on a real cluster on this machine, with and without accounting: faults."""

import csv
import os
from pathlib import Path

import pytest
from backends import contents, note_calls
from slurm_cluster import obstacle, processes, slurm_cluster
from slurm_faults import FAULTS, Ended, play

from flockesc_env.jobs import Cache, Job, find_backend, run

RESULTS = os.environ.get("SLURM_FAULTS")
"""A CSV file that gets the seconds of docs/cluster.md."""
COMMAND = (
    "SLURM_FAULTS=results/cluster/slurm_faults.csv python -m pytest tests/slow/test_slurm.py --numprocesses 2"
)
JOBS = [Job("backends:held_square", (number,)) for number in range(12)]
pytestmark = pytest.mark.skipif(obstacle() is not None, reason=str(obstacle()))


@pytest.mark.parametrize("accounting", [False, True], ids=["without accounting", "with accounting"])
def test_faults(
    accounting: bool, tmp_path: Path, monkeypatch: pytest.MonkeyPatch, subtests: pytest.Subtests
) -> None:
    """One test, because the faults of a cluster are played at the same time."""
    note_calls(tmp_path, monkeypatch)
    run(JOBS, Cache(tmp_path / "serial"), find_backend("serial"))
    files = contents(tmp_path / "serial")
    expected = {job.arguments[0]: (f"{job.key}.npz", files[f"{job.key}.npz"]) for job in JOBS}
    folder = tmp_path / "cluster"
    folder.mkdir()
    with slurm_cluster(folder, accounting=accounting) as cluster:
        ends = play(cluster, folder)
        version = cluster.ask("sinfo", "--version").split()[-1]
    with subtests.test("no process is left"):
        assert not processes(f"SLURM_CONF={folder / 'slurm.conf'}")
        assert not processes(folder=folder)
    if RESULTS:
        note(Path(RESULTS), accounting, version, ends)
    for fault, end in ends.items():
        with subtests.test(fault):
            assert end.seconds < 300, end.error
            found = contents(end.cache)
            if fault == "scancel of two tasks":
                assert "6 of 12 jobs failed; the results of all others are kept" in end.error
                # The report shows five failures.
                assert end.error.count("was cancelled; run the same again to continue") == 5
                assert found == dict(expected[number] for number in range(3, 9))
                assert len(list((end.cache / "slurm").glob("*_submission.sh"))) == 1
            elif fault == "job kills its worker":
                assert "1 of 6 jobs failed" in end.error
                assert "backends:dies(1,):\narray task" in end.error
                assert len(found) == 5
            elif fault == "Ctrl-C":
                assert "KeyboardInterrupt: 0 of 6 jobs are finished" in end.error
                assert not found
            else:
                assert end.code == 0, end.error
                assert found == dict(expected[number] for number in range(6))


def note(path: Path, accounting: bool, version: str, ends: dict[str, Ended]) -> None:
    rows = [[fault, accounting, round(ends[fault].seconds), version, COMMAND] for fault in FAULTS]
    path.parent.mkdir(parents=True, exist_ok=True)
    header = [] if path.exists() else [["fault", "accounting", "seconds", "slurm", "command"]]
    with path.open("a", newline="") as file:
        csv.writer(file, lineterminator="\n").writerows(header + rows)
