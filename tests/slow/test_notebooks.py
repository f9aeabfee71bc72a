"""The notebooks of examples/ run, with small parameters, and their outputs are of the committed kinds."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import nbformat
import pytest
from notebooks import NOTEBOOKS, executed

PARAMETERS: dict[str, dict[str, Any]] = {
    "quickstart": {"num_agents": 10, "seeds": range(3)},
    "learned_range": {"num_agents": 10, "seeds": range(3), "iterations": 1},
}


def outputs(notebook: Any) -> list[list[str]]:
    """Return the kinds of the outputs of every cell with code, without warnings."""
    return [
        [output.output_type for output in cell.outputs if output.get("name") != "stderr"]
        for cell in notebook.cells
        if cell.cell_type == "code"
    ]


@pytest.mark.parametrize("path", NOTEBOOKS, ids=lambda path: path.stem)
def test_the_notebook_runs(path: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("IPYTHONDIR", str(tmp_path))
    notebook = executed(path, **PARAMETERS[path.stem])
    assert outputs(notebook) == outputs(nbformat.read(path, as_version=4))
