"""The command line names bad input before it writes anything, and ``--help`` explains every flag."""

import re
import subprocess
import sys
from pathlib import Path

import pytest
from cli_runs import Ran, plain

from flockesc_env import __version__
from flockesc_env.cli import COMMANDS
from flockesc_env.cli.output import MEANINGS, Exit


@pytest.fixture(autouse=True)
def _narrow_terminal(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("COLUMNS", "80")


def _set(change: str) -> list[str]:
    return ["simulate", "fixed:1", "--set", change]


DRAWN = '[{"uniform": {"field": "predator_range", "low": 1, "high": 2}}]'
DIGIT = "\N{ARABIC-INDIC DIGIT ONE}"
BAD: list[tuple[list[str], str]] = [
    (["wacth"], "replay, tasks, compare, score, verify, report, episodes, got 'wacth' (did you mean watch?)"),
    (_set("num_agent=1"), "got 'num_agent' (did you mean num_agents?)"),
    (_set("predators.0.max_turn=1"), "predators[0].constant_velocity.max_turn: expected one of position"),
    (_set("predators.1.velocity=1"), "predators.1.velocity: expected an index below 1, got '1'"),
    (["simulate", "--num-agent", "5"], "a field of the scenario; set it with --set num_agents=VALUE"),
    ([*_set("predator_range=5"), "--set", f"randomization={DRAWN}"], "that randomization does not draw"),
    (["simulate", "--scenario", "paper-line"], "policy: expected fixed:RHO for a line, got none"),
    (["simulate", "fixed:1", "--scenario", "none.toml"], "none.toml: No such file"),
    (["simulate", "fixed:1", "--scenario", "escape"], "scenario: expected a file or one of paper"),
    (["simulate", "math:pi"], "policy: expected one of fixed:RHO"),
    (["simulate", "fixed:1_0"], "got 'fixed:1_0'"),
    (["simulate", "--seed", "1_0"], "expected an integer, got '1_0'"),
    (["simulate", f"fixed:{DIGIT}"], f"got 'fixed:{DIGIT}'"),
    (["sweep", "--seeds", "4:4"], "seeds: expected START:STOP with START below STOP, got 4:4"),
    (["sweep", "--seeds", "0:1_0"], "START:STOP, two integers, got '0:1_0'"),
    (["sweep", "--interaction-ranges", "1", "1_0"], "arguments: ['1', '1_0']"),
    (["sweep", "--interaction-ranges", "1", "--grid-size", "3"], "expected either ranges or a grid"),
    (["sweep", "--output", "nowhere/run.csv"], "output: expected a file in an existing folder"),
]


@pytest.mark.parametrize(("argv", "message"), BAD)
def test_bad_input_is_named(
    argv: list[str],
    message: str,
    capsys: pytest.CaptureFixture[str],
    tmp_path: Path,
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    monkeypatch.chdir(tmp_path)
    ran = Ran(capsys, *argv)
    assert (ran.code, ran.out) == (Exit.REFUSED, "")
    assert message in " ".join(plain(ran.err).split())
    assert not list(tmp_path.iterdir())


@pytest.mark.parametrize("name", COMMANDS)
def test_help_explains_every_flag(name: str, capsys: pytest.CaptureFixture[str]) -> None:
    ran = Ran(capsys, name, "--help")
    assert (ran.code, ran.err) == (Exit.DONE, "")
    assert f"Example: flockesc {name}" in ran.out
    assert max(map(len, ran.out.splitlines())) <= 80
    assert len(ran.out.splitlines()) <= 60
    _, *entries = re.split(r"\n--(?=[a-z])", plain(ran.out))
    assert entries
    for entry in entries:
        words = " ".join(entry.split())
        mark = next(mark for mark in ("(default: ", "(required)") if mark in words)
        assert len(words.partition(mark)[0].split()) >= 4, words


def test_the_first_help_lists_commands_and_exit_codes(capsys: pytest.CaptureFixture[str]) -> None:
    ran = Ran(capsys)
    assert (ran.code, ran.out) == (Exit.DONE, Ran(capsys, "--help").out)
    assert all(f" {command}  " in ran.out for command in COMMANDS)
    assert all(f"{code.value}  {meaning}" in ran.out for code, meaning in MEANINGS.items())


@pytest.mark.parametrize(("value", "is_colored"), [("1", False), ("", True)])
def test_no_color_turns_colors_off(
    value: str, is_colored: bool, capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setenv("NO_COLOR", value)
    monkeypatch.setenv("TERM", "xterm")
    monkeypatch.setattr(sys.stdout, "isatty", lambda: True)
    assert ("\x1b[" in Ran(capsys, "presets", "--help").out) == is_colored


def test_commands_start_in_a_deleted_folder(tmp_path: Path) -> None:
    program = str(Path(sys.executable).with_name("flockesc"))
    command = ["sh", "-c", 'cd "$1" && rmdir "$1" && exec "$2" --version', "sh", str(tmp_path), program]
    ran = subprocess.run(command, capture_output=True, text=True, check=False)  # noqa: S603
    assert (ran.returncode, ran.stdout) == (Exit.DONE, f"flockesc {__version__}\n"), ran.stderr
