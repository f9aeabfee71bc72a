"""Help explains every flag and shows the library's defaults."""

from __future__ import annotations

import dataclasses
import re

import pytest
from cli_runs import Ran, plain

from flockesc_env import (
    FlockScenario,
    LineScenario,
    __version__,
)
from flockesc_env.cli import COMMANDS
from flockesc_env.cli.exits import MEANINGS, Exit


@pytest.fixture(autouse=True)
def _narrow_terminal(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("COLUMNS", "80")


@pytest.mark.parametrize("command", COMMANDS)
def test_help_explains_every_flag(command: str, capsys: pytest.CaptureFixture[str]) -> None:
    ran = Ran(capsys, command, "--help")
    assert (ran.code, ran.err) == (Exit.DONE, "")
    assert f"Example: flockesc {command}" in ran.out
    assert max(map(len, ran.out.splitlines())) <= 80
    _, *entries = re.split(r"\n--(?=[a-z])", plain(ran.out))
    assert entries
    for entry in entries:
        words = " ".join(entry.split())
        mark = next(mark for mark in ("(default: ", "(required)") if mark in words)
        assert len(words.partition(mark)[0].split()) >= 4, words


def test_flags_have_the_scenarios_defaults(capsys: pytest.CaptureFixture[str]) -> None:
    for model, scenario in (("flock", FlockScenario()), ("line", LineScenario())):
        words = " ".join(plain(Ran(capsys, "simulate", "--model", model, "--help").out).split())
        for field in dataclasses.fields(scenario):
            value = getattr(scenario, field.name)
            if isinstance(value, str | int | float) and not isinstance(value, bool):
                own = words.partition(f"--{field.name.replace('_', '-')} ")[2]
                assert f"(default: {value})" in own.partition(" --")[0]


def test_the_first_help_lists_commands_and_exit_codes(capsys: pytest.CaptureFixture[str]) -> None:
    ran = Ran(capsys)
    assert ran.code == Exit.DONE
    assert ran.out == Ran(capsys, "--help").out
    for command in COMMANDS:
        assert f" {command}  " in ran.out
    for code, meaning in MEANINGS.items():
        assert f"{code.value}  {meaning}" in ran.out
    assert set(MEANINGS) == set(Exit)


def test_version(capsys: pytest.CaptureFixture[str]) -> None:
    assert Ran(capsys, "--version").out == f"flockesc {__version__}\n"
