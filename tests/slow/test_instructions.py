"""No step takes more instructions than committed."""

import json
import shutil

import pytest

from speed import instructions


@pytest.mark.skipif(shutil.which("valgrind") is None, reason="needs valgrind: apt-get install valgrind")
def test_no_step_takes_more_instructions_than_committed() -> None:
    committed = json.loads(instructions.RESULTS.read_text())
    counts = instructions.count()
    assert counts.keys() == committed.keys()
    slower = {name: count / committed[name] for name, count in counts.items()}
    slower = {name: ratio for name, ratio in slower.items() if ratio > instructions.MARGIN}
    assert not slower, "`make instructions` renews the counts"
