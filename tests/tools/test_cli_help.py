"""``--help`` explains every flag on one screen."""

from __future__ import annotations

import re

import pytest
from cli_runs import Ran, plain

from flockesc_env import __version__
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


def test_version(capsys: pytest.CaptureFixture[str]) -> None:
    assert Ran(capsys, "--version").out == f"flockesc {__version__}\n"
