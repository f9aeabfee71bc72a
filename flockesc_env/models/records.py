"""Recorded runs: ``save_run``, ``load_run``, ``replay_run``; npz files with scenario, seed and versions."""

from __future__ import annotations

import dataclasses
import json
from dataclasses import dataclass
from pathlib import Path
from platform import python_version
from typing import Any
from zipfile import BadZipFile, ZipFile

import numpy as np
from numpy.typing import NDArray

from flockesc_env.common.array_files import command_line, read_document, write_document
from flockesc_env.common.checks import as_flag, as_instance, as_path, as_seed, as_text
from flockesc_env.common.errors import InputError
from flockesc_env.models.simulate import LineTrajectory, Trajectory, as_run, run_flock, simulate_line
from flockesc_env.scenario.document import from_fields
from flockesc_env.scenario.flock import FlockScenario
from flockesc_env.scenario.line import LineScenario
from flockesc_env.scenario.presets import MODELS

_PACKAGES = ("flockesc-env", "numpy")
_ORIGIN = ("seed", "is_start_given")
_LARGEST = float(np.finfo(np.float64).max)


@dataclass(frozen=True, eq=False)
class RecordedRun:
    """A run that ``load_run`` read from a file."""

    trajectory: Trajectory | LineTrajectory  #: the run
    name: str  #: the name passed to ``save_run``; may be empty
    versions: dict[str, str]  #: versions of Python and packages with which the run was recorded


def versions(*packages: str) -> dict[str, str]:
    """Return the installed versions of Python, the packages that a run depends on, and other packages."""
    from importlib.metadata import version  # slow to import

    return {"python": python_version(), **{name: version(name) for name in sorted({*_PACKAGES, *packages})}}


def save_run(trajectory: Trajectory | LineTrajectory, path: str | Path, *, name: str = "") -> None:
    """Write a run to an npz file, one array per attribute; an existing file is replaced atomically.

    ``name``: name of the run, for example of its policy.
    """
    file_path = as_path(path)
    model = "flock" if isinstance(as_run(trajectory, "trajectory"), Trajectory) else "line"
    columns = {name: getattr(trajectory, name) for name in _columns(type(trajectory))}
    header = {
        "model": model,
        "scenario": json.loads(trajectory.scenario.to_json()),
        "seed": trajectory.seed,
        "is_start_given": trajectory.is_start_given,
        "name": as_text(name, "name"),
        "command": command_line(),
        "versions": versions(),
    }
    write_document(file_path, header, columns)


def load_run(path: str | Path) -> RecordedRun:
    """Read a run that ``save_run`` wrote. Untrusted files are safe: no code in them is executed.

    Raises:
        InputError: if the file is damaged, lacks a part or has an impossible number: NaN, infinite (except
            distances without a predator), a negative distance, range or count, or a fraction above 1; or if
            the scenario is invalid in this version of the package.
    """
    path = as_path(path)
    header, columns = read_document(path, "a recorded run (npz)", "num_components")
    try:
        model, fields = MODELS[header["model"]], header["scenario"]
        origin = {name: header[name] for name in _ORIGIN}
        name, recorded_with = str(header["name"]), dict(header["versions"])
    except (ValueError, KeyError, TypeError) as error:
        expected = "model, scenario, seed, is_start_given, name and versions"
        raise InputError("header", expected, repr(error)) from None
    return RecordedRun(_trajectory(from_fields(model, fields), origin, columns), name, recorded_with)


def is_run(path: Path) -> bool:
    """Return whether a path is that of a file in the form of a recorded run, which may still be damaged."""
    try:
        with ZipFile(path) as file:
            return "num_components.npy" in file.namelist()
    except (BadZipFile, OSError):
        return False


def replay_run(trajectory: Trajectory | LineTrajectory) -> Trajectory | LineTrajectory:
    """Run the model again with the recorded scenario, ranges and seed, and return the new run.

    If the initial state was given, the recorded one is used.
    """
    as_run(trajectory, "trajectory")
    seed, is_given = trajectory.seed, trajectory.is_start_given
    if isinstance(trajectory, LineTrajectory):
        line = trajectory.scenario
        start = trajectory.states[0] if is_given else None
        return simulate_line(line, trajectory.interaction_range, seed=seed, initial_state=start)
    return run_flock(
        trajectory.scenario,
        trajectory.interaction_ranges,
        seed=seed,
        initial_positions=trajectory.positions[0] if is_given else None,
        initial_velocities=trajectory.velocities[0] if is_given else None,
        predator_actions=trajectory.predator_actions,
    )


def run_differences(recorded: Trajectory | LineTrajectory, again: Trajectory | LineTrajectory) -> list[str]:
    """Return the differences between two runs of the same scenario.

    There is one line per attribute that differs, with its first difference, and none if all bits are equal.
    """
    as_instance(again, "again", type(as_run(recorded, "recorded")))
    found = []
    for name in _columns(type(recorded)):
        first, second = np.asarray(getattr(recorded, name)), np.asarray(getattr(again, name))
        if first.shape != second.shape:
            found.append(f"{name}: recorded shape {first.shape}, now shape {second.shape}")
        elif not np.array_equal(first, second):
            at = tuple(int(i) for i in np.argwhere(first != second)[0])
            found.append(f"{name}{list(at) if at else ''}: recorded {first[at]}, now {second[at]}")
    return found


def _columns(kind: type[Trajectory | LineTrajectory]) -> list[str]:
    return [field.name for field in dataclasses.fields(kind) if field.name not in {"scenario", *_ORIGIN}]


def _trajectory(
    scenario: FlockScenario | LineScenario, origin: dict[str, Any], columns: dict[str, NDArray[Any]]
) -> Trajectory | LineTrajectory:
    """Return the run with these columns after a check of their dtypes, shapes and numbers."""
    kind = Trajectory if isinstance(scenario, FlockScenario) else LineTrajectory
    if set(columns) != set(_columns(kind)):
        raise InputError("columns", ", ".join(_columns(kind)), ", ".join(sorted(columns)))
    as_seed(origin["seed"])
    as_flag(origin["is_start_given"], "is_start_given")
    for name, (dtype, shape, low, high) in _layout(scenario, columns).items():
        column = columns[name]
        if column.dtype != dtype or column.shape != shape:
            raise InputError(name, f"{dtype} of shape {shape}", f"{column.dtype} of shape {column.shape}")
        outside = np.argwhere(~((column >= low) & (column <= high)))
        if len(outside):
            at = tuple(map(int, outside[0]))
            expected = f"a number from {low:g} to {high:g}"
            raise InputError(f"{name}{list(at) if at else ''}", expected, column[at])
    scalars = {name: value.item() if value.ndim == 0 else value for name, value in columns.items()}
    return kind(scenario=scenario, **origin, **scalars)  # type: ignore[arg-type]


def _layout(
    scenario: FlockScenario | LineScenario, columns: dict[str, NDArray[Any]]
) -> dict[str, tuple[str, tuple[int, ...], float, float]]:
    """Return the dtype and shape of every column, and the bounds of its numbers."""
    if isinstance(scenario, LineScenario):
        times, agents = len(columns["states"]) if columns["states"].ndim else 0, scenario.num_agents
        farthest = np.inf if scenario.predator_position is None else _LARGEST
        return {
            "interaction_range": ("float64", (), 0, _LARGEST),
            "states": ("float64", (times, agents), -_LARGEST, _LARGEST),
            "num_components": ("int64", (times,), 0, agents),
            "escape_distance": ("float64", (times,), 0, farthest),
            "converged": ("bool", (), 0, 1),
            "steps": ("int64", (), 0, _LARGEST),
        }
    steps, agents, axes = scenario.num_steps, scenario.num_agents, scenario.dimension
    is_shared = columns["interaction_ranges"].shape[1:] == (1,)
    farthest = _LARGEST if scenario.predators else np.inf
    return {
        "interaction_ranges": ("float64", (steps, 1 if is_shared else agents), 0, _LARGEST),
        "predator_actions": ("float64", (steps, scenario.num_learned, axes), -_LARGEST, _LARGEST),
        "positions": ("float64", (steps + 1, agents, axes), -_LARGEST, _LARGEST),
        "velocities": ("float64", (steps + 1, agents, axes), -_LARGEST, _LARGEST),
        "predator_positions": ("float64", (steps + 1, len(scenario.predators), axes), -_LARGEST, _LARGEST),
        "num_components": ("int64", (steps + 1,), 0, agents),
        "caught_at": ("int64", (agents,), -1, steps),
        "times": ("float64", (steps + 1,), 0, _LARGEST),
        "mean_distance": ("float64", (steps + 1,), 0, farthest),
        "min_distance": ("float64", (steps + 1,), 0, farthest),
        "polarization": ("float64", (steps + 1,), 0, _LARGEST),
        "fraction_surviving": ("float64", (steps + 1,), 0, 1),
    }
