"""Initial positions and headings of a flock from CSV, npy and npz files."""

from __future__ import annotations

from contextlib import suppress
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from flockesc_env.common.array_files import read_npy, read_npz
from flockesc_env.common.checks import FloatArray, as_floats, as_path, parse_number
from flockesc_env.common.errors import InputError, shown
from flockesc_env.common.files import suffix_of
from flockesc_env.scenario.parts import GivenHeadings, GivenPositions

_COLUMNS = {
    2: ("x", "y"),
    3: ("x", "y", "z"),
    4: ("x", "y", "vx", "vy"),
    6: ("x", "y", "z", "vx", "vy", "vz"),
}
_HEADS = " or ".join(",".join(columns) for columns in _COLUMNS.values())
_TABLE = f"a row per agent with the columns {_HEADS}"


def read_initial_state(path: str | Path) -> dict[str, Any]:
    """Read an initial state from a file, for example ``FlockScenario(**read_initial_state("flock.csv"))``.

    Args:
        path: path of the file. ``.csv``: one row per agent, positions in m and optional velocities; the first
            line is ``x,y``, ``x,y,z``, ``x,y,vx,vy`` or ``x,y,z,vx,vy,vz``. ``.npy``: the same table without
            the first line. ``.npz``: an array ``positions`` and an optional array ``velocities``, both of
            shape (n, D).

    Returns:
        The fields ``num_agents``, ``dimension``, ``initial_positions`` and, if the file contains velocities,
        ``initial_headings`` of a ``FlockScenario``. Only the directions of velocities are used: agents start
        at the scenario's speed.

    Raises:
        InputError: if ``path`` is not a path; if the file is damaged or has another form.
        FileNotFoundError: if the file does not exist.
    """
    path = as_path(path)
    arrays = _read(path)
    positions = _vectors(arrays["positions"], f"{path}: positions")
    state: dict[str, Any] = {
        "num_agents": positions.shape[0],
        "dimension": positions.shape[1],
        "initial_positions": GivenPositions(tuple(map(tuple, positions.tolist()))),
    }
    if "velocities" in arrays:
        field = f"{path}: velocities"
        velocities = _vectors(arrays["velocities"], field, positions.shape)
        at_rest = np.flatnonzero(~velocities.any(axis=1))
        if at_rest.size:
            raise InputError(f"{field}[{at_rest[0]}]", "a nonzero vector", "0")
        state["initial_headings"] = GivenHeadings(tuple(map(tuple, velocities.tolist())))
    return state


def _read(path: Path) -> dict[str, NDArray[Any]]:
    """Return the arrays of a file: ``positions`` and, if present, ``velocities``."""
    suffix, form = suffix_of(path), f"an initial state ({path.suffix})"
    if suffix == ".npz":
        arrays = read_npz(path, form)
        if "positions" not in arrays or not arrays.keys() <= {"positions", "velocities"}:
            expected = "the arrays positions and, optionally, velocities"
            raise InputError(str(path), expected, ", ".join(arrays) or "none")
        return arrays
    if suffix not in {".csv", ".npy"}:
        raise InputError(str(path), "a file that ends in .csv or .npy or .npz", shown(path.suffix))
    table = read_npy(path, form) if suffix == ".npy" else _read_csv(path, form)
    if table.ndim != 2 or table.shape[1] not in _COLUMNS:
        raise InputError(str(path), _TABLE, f"shape {table.shape}")
    if table.shape[1] <= 3:
        return {"positions": table}
    positions, velocities = np.hsplit(table, 2)
    return {"positions": positions, "velocities": velocities}


def _read_csv(path: Path, form: str) -> NDArray[Any]:
    try:
        head, *lines = path.read_text(encoding="utf-8-sig").splitlines() or [""]
    except UnicodeDecodeError as error:
        raise InputError(str(path), form, error) from None
    names = tuple(name.strip() for name in head.split(","))
    if names not in _COLUMNS.values():
        raise InputError(str(path), f"the first line {_HEADS}", shown(head))
    rows = []
    for number, line in enumerate(lines, 2):
        row: list[float] = []
        with suppress(ValueError):
            row = [parse_number(entry, float) for entry in line.split(",")]
        if line.strip() and len(row) != len(names):
            expected = f"{len(names)} numbers, as many as names in the first line"
            raise InputError(f"{path}: line {number}", expected, shown(line))
        rows += [row] if row else []
    if not rows:
        raise InputError(str(path), _TABLE, "no rows")
    return np.array(rows)


def _vectors(array: NDArray[Any], field: str, shape: tuple[int, ...] | None = None) -> FloatArray:
    vectors = as_floats(array, field, shape)
    if vectors.ndim != 2 or not len(vectors) or vectors.shape[1] not in {2, 3}:
        raise InputError(field, "shape (n, 2) or (n, 3) with n >= 1", f"shape {vectors.shape}")
    return vectors
