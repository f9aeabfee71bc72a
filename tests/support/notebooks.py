"""Runs the notebooks of examples/; as a program, with their own parameters, and stores the outputs."""

from __future__ import annotations

import tempfile
from pathlib import Path
from typing import Any

import nbformat
from nbclient import NotebookClient

NOTEBOOKS = sorted((Path(__file__).parents[2] / "examples").glob("*.ipynb"))


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


if __name__ == "__main__":
    for path in NOTEBOOKS:
        nbformat.write(executed(path), path)
