"""The notebooks of examples/ run, with small parameters, and their outputs are of the committed kinds.

As a program, this file runs them with their own parameters, and stores the outputs.
"""

import tempfile
from pathlib import Path
from typing import Any

import nbformat
import pytest
from nbclient import NotebookClient

NOTEBOOKS = sorted((Path(__file__).parents[2] / "examples").glob("*.ipynb"))
PARAMETERS: dict[str, dict[str, Any]] = {
    "quickstart": {"num_agents": 10, "seeds": range(3)},
    "learned_range": {"num_agents": 10, "seeds": range(3), "iterations": 1},
}


def executed(path: Path, **parameters: Any) -> Any:
    """Return a notebook after a run in an empty folder.

    Args:
        path: the file.
        **parameters: values that replace those in the cell with the tag ``parameters``, all of them or none.
    """
    notebook = nbformat.read(path, as_version=4)
    if parameters:
        (cell,) = (cell for cell in notebook.cells if "parameters" in cell.metadata.get("tags", []))
        assert {line.split(" = ")[0] for line in cell.source.splitlines()} == set(parameters)
        cell.source = "\n".join(f"{name} = {value!r}" for name, value in parameters.items())
    with tempfile.TemporaryDirectory() as folder:
        NotebookClient(notebook, timeout=600, kernel_name="python3", record_timing=False).execute(cwd=folder)
    return notebook


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


if __name__ == "__main__":
    for path in NOTEBOOKS:
        nbformat.write(executed(path), path)
