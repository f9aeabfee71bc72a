"""Initial states from files: where agents are and, if it is there, where they head."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from flockesc_env.common.array_files import read_npy, read_npz
from flockesc_env.common.checks import FloatArray, as_floats, as_path
from flockesc_env.common.errors import RecordError, shown
from flockesc_env.scenario.initial import GivenHeadings, GivenPositions

_COLUMNS = {
    2: ("x", "y"),
    3: ("x", "y", "z"),
    4: ("x", "y", "vx", "vy"),
    6: ("x", "y", "z", "vx", "vy", "vz"),
}
_HEADS = " or ".join(",".join(columns) for columns in _COLUMNS.values())
_TABLE = f"rows of an agent each and the columns {_HEADS}"


def read_initial_state(path: str | Path) -> dict[str, Any]:
    """Return the fields of a ``FlockScenario`` that starts as a file says.

    ``FlockScenario(**read_initial_state("flock.csv"))``: ``num_agents``, ``dimension``,
    ``initial_positions`` and, if there are velocities, ``initial_headings``, their directions. Agents
    start at the scenario's speed.

    Args:
        path: a table with a row per agent and the columns x, y(, z)(, vx, vy(, vz)), as ``.csv`` with their
            names in the first line or as ``.npy`` without names; or an ``.npz`` with the arrays ``positions``
            and, if wanted, ``velocities``, both of shape (n, D). Positions in m.

    Raises:
        ArgumentError: for what is no path.
        FileNotFoundError: if there is no such file.
        RecordError: naming the file, what was expected of it and what is in it.
    """
    path = as_path(path)
    arrays = _read(path)
    positions = _vectors(arrays["positions"], f"{path}: positions")
    state: dict[str, Any] = {
        "num_agents": positions.shape[0],
        "dimension": positions.shape[1],
        "initial_positions": GivenPositions(_rows(positions)),
    }
    if "velocities" in arrays:
        field = f"{path}: velocities"
        velocities = _vectors(arrays["velocities"], field, positions.shape)
        at_rest = np.flatnonzero(~velocities.any(axis=1))
        if at_rest.size:
            raise RecordError(f"{field}[{at_rest[0]}]", "a vector of a length other than 0", "0")
        state["initial_headings"] = GivenHeadings(_rows(velocities))
    return state


def _read(path: Path) -> dict[str, NDArray[Any]]:
    """Return the arrays of a file: ``positions`` and perhaps ``velocities``."""
    readers = {".csv": _read_csv, ".npy": _read_npy, ".npz": _read_npz}
    if path.suffix not in readers:
        raise RecordError(str(path), f"a file that ends in {' or '.join(readers)}", shown(path.suffix))
    return readers[path.suffix](path)


def _read_csv(path: Path) -> dict[str, NDArray[Any]]:
    try:
        head, *lines = path.read_text(encoding="utf-8-sig").splitlines() or [""]
        names = tuple(name.strip() for name in head.split(","))
        if names not in _COLUMNS.values():
            raise RecordError(str(path), f"a first line {_HEADS}", shown(head))
        rows = [line for line in lines if line.strip()]
        if not rows:
            raise RecordError(str(path), _TABLE, "no rows")
        table = np.loadtxt(rows, delimiter=",", ndmin=2)
    except RecordError:
        raise
    except ValueError as error:
        raise RecordError(str(path), _form(path), error) from None
    if table.shape[1] != len(names):
        raise RecordError(str(path), f"{len(names)} columns, as the first line says", table.shape[1])
    return _split(table, path)


def _read_npy(path: Path) -> dict[str, NDArray[Any]]:
    return _split(read_npy(path, _form(path)), path)


def _read_npz(path: Path) -> dict[str, NDArray[Any]]:
    arrays = read_npz(path, _form(path))
    if "positions" not in arrays or not arrays.keys() <= {"positions", "velocities"}:
        expected = "the arrays positions and, if wanted, velocities"
        raise RecordError(str(path), expected, ", ".join(arrays) or "none")
    return arrays


def _form(path: Path) -> str:
    return f"an initial state ({path.suffix})"


def _split(table: NDArray[Any], path: Path) -> dict[str, NDArray[Any]]:
    if table.ndim != 2 or table.shape[1] not in _COLUMNS:
        raise RecordError(str(path), _TABLE, f"shape {table.shape}")
    if table.shape[1] <= 3:
        return {"positions": table}
    positions, velocities = np.hsplit(table, 2)
    return {"positions": positions, "velocities": velocities}


def _vectors(array: NDArray[Any], field: str, shape: tuple[int, ...] | None = None) -> FloatArray:
    vectors = as_floats(array, field, shape, RecordError)
    if vectors.ndim != 2 or not len(vectors) or vectors.shape[1] not in {2, 3}:
        raise RecordError(field, "shape (n, 2) or (n, 3) with n >= 1", f"shape {vectors.shape}")
    return vectors


def _rows(vectors: FloatArray) -> tuple[tuple[float, ...], ...]:
    return tuple(map(tuple, vectors.tolist()))
