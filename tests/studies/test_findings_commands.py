"""The commands of ``python -m studies`` for learned policies."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import pytest
from cli_runs import Ran

from flockesc_env.cli.exits import Exit
from studies.__main__ import STUDIES


@pytest.mark.parametrize(
    "words",
    [
        ["paper", "--output"],
        ["robustness", "--output"],
        ["validation", "--output"],
        ["arms-race", "--output"],
        ["findings", "shared", "--output"],
        ["findings-coverage", "--results"],
        ["findings-references", "shared", "--output"],
        ["findings-explain", "shared", "--output"],
        ["findings-losses", "--results"],
        ["findings-replay", "line", "--write", "--results"],
        ["findings-information", "--results"],
        ["findings-mechanism", "--results"],
    ],
    ids=lambda words: words[0],
)
def test_a_folder_that_cannot_be_written_is_refused_before_the_work(
    words: list[str], tmp_path: Path, capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    def never(*_: Any) -> None:
        raise AssertionError("continued before the folder was checked")

    monkeypatch.setattr("studies.flags.require", never)
    (tmp_path / "file").touch()
    ran = Ran(capsys, *words, tmp_path / "file" / "folder", run=STUDIES.main)
    assert (ran.code, ran.out) == (Exit.REFUSED, "")
    field = words[-1].removeprefix("--")
    assert f"{field}: expected a folder that can be written (Not a directory), got " in ran.err


def test_a_mistake_is_one_line(capsys: pytest.CaptureFixture[str]) -> None:
    ran = Ran(capsys, "findings", "nowhere", run=STUDIES.main)
    assert ran.code == Exit.REFUSED
    assert ran.err.startswith("flockesc: error: setting: expected one of")
    assert ran.err.count("\n") == 1
