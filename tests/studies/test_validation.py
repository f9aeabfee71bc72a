"""Published results measured here: the parts, their verdicts, the page and its command."""

from __future__ import annotations

from pathlib import Path

import pytest
from cli_runs import Ran

from flockesc_env.cli.exits import Exit
from studies.__main__ import STUDIES
from studies.study import RESULTS_FILE
from studies.validation import vicsek
from studies.validation.page import markdown_page
from studies.validation.results import ValidationResults

ROOT = Path(__file__).parents[2]
COMMITTED = ROOT / "results" / "validation"


def test_the_committed_page_follows_from_the_committed_results() -> None:
    results = ValidationResults.load(COMMITTED)
    page = ROOT / "docs" / "validation.md"
    assert page.read_text("utf-8") == markdown_page(results, COMMITTED, page)
    assert results.to_json() == (COMMITTED / RESULTS_FILE).read_text("utf-8")
    assert all((COMMITTED / f"{name}.png").is_file() for name in results.parts)


def test_one_part_is_measured_and_the_others_keep_their_results(
    tmp_path: Path, capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(vicsek, "SIZES", {12: 4, 20: 4})
    monkeypatch.setattr(vicsek, "CONTROL", 12)
    monkeypatch.setattr(vicsek, "NUM_STEPS", 40)
    monkeypatch.setattr(vicsek, "SKIP", 20)
    stored = ValidationResults.load(COMMITTED)
    (tmp_path / RESULTS_FILE).write_text(stored.to_json())
    page = tmp_path / "validation.md"
    flags = ["--output", str(tmp_path), "--page", str(page), "--backend", "serial"]
    ran = Ran(capsys, "validation", "--only", "vicsek", *flags, run=STUDIES.main)
    assert ran.code == Exit.DONE, ran.err
    found = ValidationResults.load(tmp_path)
    assert list(found.parts) == list(stored.parts)
    assert found.parts["milling"] == stored.parts["milling"]
    measured = found.parts["vicsek"]
    assert measured.results.num_flocks == (4, 4)
    assert measured.command == "python -m studies validation --only vicsek"
    assert (tmp_path / "vicsek.png").is_file()
    assert page.read_text("utf-8") == markdown_page(found, tmp_path, page)


@pytest.mark.parametrize("flags", [["--only", "wings"], ["--scale", "0"]], ids=lambda flags: flags[0])
def test_unknown_parts_and_shares_are_refused(flags: list[str], capsys: pytest.CaptureFixture[str]) -> None:
    ran = Ran(capsys, "validation", *flags, run=STUDIES.main)
    assert ran.code != Exit.DONE
    assert flags[0].strip("-") in ran.err
