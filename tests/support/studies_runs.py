"""How tests run ``python -m studies`` in this process."""

from __future__ import annotations

import pytest
from cli_runs import Ran

from studies.__main__ import STUDIES


class StudiesRan(Ran):
    """What a command left: its code, stdout and stderr."""

    def __init__(self, capsys: pytest.CaptureFixture[str], *argv: object) -> None:
        self.code = STUDIES.main([str(word) for word in argv])
        self.out, self.err = capsys.readouterr()
