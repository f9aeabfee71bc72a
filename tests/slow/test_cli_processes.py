"""``flockesc`` as a process: exit codes, Ctrl-C, streams that are closed, full or unread."""

import json
import os
import re
import signal
import subprocess
import sys
from pathlib import Path

import polars as pl
import pytest
from cli_runs import FLOCKESC, SMALL_FLAGS, TIMEOUT, run_process

from flockesc_env import FlockScenario, sweep
from flockesc_env.cli.output import Exit

SWEEP = ["sweep", "--seeds", "0:1", *SMALL_FLAGS]  # without intervals, and so without notes about them


def test_a_process_ends_with_the_code_of_its_command() -> None:
    for flags, shown in (([], ""), (["--progress"], "21/21")):
        ran = run_process(*SWEEP, "--json", *flags, capture_output=True)
        assert (ran.returncode, bool(ran.stderr)) == (Exit.DONE, bool(flags))
        assert shown in ran.stderr
        assert len(json.loads(ran.stdout)["ranges"]) == 21
    ran = run_process("simulate", "fixed:-1", capture_output=True)
    assert (ran.returncode, ran.stdout) == (Exit.REFUSED, "")
    assert ran.stderr.startswith("flockesc: error: policy: expected fixed:RHO")


def test_ctrl_c_keeps_what_is_finished(tmp_path: Path) -> None:
    # A background job inherits no handler for Ctrl-C.
    script = """
import signal, sys
signal.signal(signal.SIGINT, signal.default_int_handler)
from flockesc_env.cli import main
sys.exit(main(sys.argv[1:]))
"""
    path = tmp_path / "sweep.parquet"
    grid = ["--interaction-ranges", "0", "10"]
    flags = [*grid, "--seeds", "0:10000000", "--json", "--progress", "--output", str(path)]
    command = [sys.executable, "-c", script, "sweep", *flags]
    process = subprocess.Popen(command, stdout=subprocess.PIPE, stderr=subprocess.PIPE)  # noqa: S603
    try:
        assert process.stderr is not None
        # The bar counts runs; the first chunks are small and surely done by a few hundred.
        shown = b""
        while not any(int(count) > 300 for count in re.findall(rb"(\d+)/20000000", shown)):
            shown += os.read(process.stderr.fileno(), 4096)
        process.send_signal(signal.SIGINT)
        out, err = process.communicate(timeout=TIMEOUT)
    finally:
        process.kill()
    assert process.returncode == Exit.INTERRUPTED
    document = json.loads(out)
    finished = document["seeds"]["stop"]
    assert document["interrupted"]
    assert 0 < finished < 10_000_000
    assert f"interrupted after {finished} of 10000000 seeds".encode() in err
    assert b"Traceback" not in err
    result = sweep(FlockScenario(), [0, 10], range(finished))
    assert pl.read_parquet(path).equals(result.table())
    assert [row["mean"] for row in document["ranges"]] == result.values().mean(axis=1).tolist()
    assert list(tmp_path.iterdir()) == [path]


def test_term_ends_process_1_of_a_container() -> None:
    """The system ignores the signal there; elsewhere it ends a process without a handler."""
    script = """
import os, sys
os.getpid = lambda: 1
from flockesc_env.cli import main
sys.exit(main(["sweep", "--seeds", "0:10000000", "--progress"]))
"""
    with subprocess.Popen([sys.executable, "-c", script], stderr=subprocess.PIPE) as process:  # noqa: S603
        assert process.stderr is not None
        process.stderr.read(1)  # the bar is shown
        process.terminate()
        process.stderr.read()
    assert process.returncode == 128 + signal.SIGTERM


@pytest.mark.parametrize("argv", [["--help"], SWEEP])
def test_a_reader_that_goes_away(argv: list[str]) -> None:
    reading, writing = os.pipe()
    os.close(reading)
    try:
        ran = run_process(*argv, stdout=writing, stderr=subprocess.PIPE)
    finally:
        os.close(writing)
    assert (ran.returncode, ran.stderr) == (Exit.UNREAD, "")


def test_a_full_disk() -> None:
    with Path("/dev/full").open("w") as full:
        ran = run_process(*SWEEP, stdout=full, stderr=subprocess.PIPE)
    message = "flockesc: error: output: No space left on device\n"
    assert (ran.returncode, ran.stderr) == (Exit.REFUSED, message)


@pytest.mark.parametrize(("argv", "closed"), [(SWEEP, ">&-"), (SWEEP, "2>&-"), (["--help"], "<&- >&- 2>&-")])
def test_closed_streams(argv: list[str], closed: str) -> None:
    command = ["sh", "-c", f'"$@" {closed}', "sh", *FLOCKESC, *argv]
    ran = subprocess.run(command, capture_output=True, text=True, timeout=TIMEOUT, check=False)  # noqa: S603
    assert (ran.returncode, ran.stderr) == (Exit.DONE, "")
    assert bool(ran.stdout) == (">&-" not in closed.replace("2>&-", ""))
