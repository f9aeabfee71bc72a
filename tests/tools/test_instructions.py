"""No step takes more instructions than committed."""

from __future__ import annotations

import json
import shutil
from pathlib import Path

import pytest

from benchmarks import instructions

ROOT = Path(__file__).parents[2]


@pytest.mark.skipif(shutil.which("valgrind") is None, reason="needs valgrind: apt-get install valgrind")
def test_no_step_takes_more_instructions_than_committed(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.chdir(ROOT)
    committed = json.loads(instructions.RESULTS.read_text())
    counts = instructions.count()
    assert counts.keys() == committed.keys()
    slower = {name: count / committed[name] for name, count in counts.items()}
    slower = {name: ratio for name, ratio in slower.items() if ratio > instructions.MARGIN}
    assert not slower, "`make instructions` renews the counts"


def test_the_page_shows_the_committed_counts() -> None:
    page = (ROOT / instructions.PAGE).read_text("utf-8")
    assert instructions.rendered(page, json.loads((ROOT / instructions.RESULTS).read_text())) == page
