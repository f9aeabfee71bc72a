"""``flockesc`` as a process: exit codes, Ctrl-C, streams that are closed, full or unread."""

import json
import os
import signal
import subprocess
import sys
from pathlib import Path

import pytest
from cli_runs import FLOCKESC, SMALL_FLAGS, TIMEOUT, run_process

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


def test_ctrl_c_ends_a_sweep() -> None:
    # A background job inherits no handler for Ctrl-C.
    script = """
import signal, sys
signal.signal(signal.SIGINT, signal.default_int_handler)
from flockesc_env.cli import main
sys.exit(main(["sweep", "--seeds", "0:1000000", "--progress"]))
"""
    with subprocess.Popen([sys.executable, "-c", script], stderr=subprocess.PIPE) as process:  # noqa: S603
        assert process.stderr is not None
        process.stderr.read(1)  # the bar is shown
        process.send_signal(signal.SIGINT)
        err = process.stderr.read()
    assert process.returncode == Exit.INTERRUPTED
    assert err.endswith(b"flockesc: interrupted\n")
    assert b"Traceback" not in err


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
