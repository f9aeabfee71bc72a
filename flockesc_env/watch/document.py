"""A run as a JSON document for the page; numbers are compressed typed arrays in base64."""

from __future__ import annotations

import json
import zlib
from base64 import b64encode
from collections.abc import Sequence
from typing import Any

import numpy as np
from numpy.typing import NDArray

from flockesc_env.common.checks import as_instance, as_text
from flockesc_env.common.errors import InputError
from flockesc_env.episodes.objectives import FLOCK_OBJECTIVES
from flockesc_env.models.simulate import Trajectory, as_runs
from flockesc_env.policies.registry import NAMES
from flockesc_env.render.frames import policy_title

Run = tuple[str, Trajectory]
"""A name and a run."""

_OBJECTIVE = FLOCK_OBJECTIVES["min_mean_distance"]
"""The objective that the page shows. A recorded run does not say what its policy maximizes."""


def check_runs(runs: Sequence[Run]) -> None:
    """Check that there are runs of flocks with names, all in the plane or all in space."""
    dimensions = {trajectory.scenario.dimension for _, trajectory in as_runs(runs)}
    if len(dimensions) > 1:
        raise InputError("runs", "all in the plane or all in space", "both")


def run_document(name: str, trajectory: Trajectory) -> dict[str, Any]:
    """Return the document of a run of T steps, for ``json.dumps``.

    ``title`` is the readable name. Columns have an entry per time, 0..T. ``ranges`` are those of the step
    that begins at a time; their last entry is that of the step that ends at T, as in
    ``Trajectory.num_components``. ``lowRange`` and ``highRange`` are the mean over agents minus and plus one
    standard deviation, within the ranges that occur.
    """
    as_text(name, "name")
    as_instance(trajectory, "trajectory", Trajectory)
    in_force = np.minimum(trajectory.interaction_ranges, np.finfo(np.float32).max)  # as the columns hold it
    ranges = np.concatenate([in_force, in_force[-1:]])
    mean, deviation = ranges.mean(axis=1), ranges.std(axis=1)
    columns = {
        "times": _column(trajectory.times),
        "positions": _column(trajectory.positions),
        "headings": _headings(trajectory.velocities),
        "ranges": _column(ranges),
        "predators": _column(trajectory.predator_positions),
        "meanDistance": _column(trajectory.mean_distance),
        "minDistance": _column(trajectory.min_distance),
        "lowestMean": _column(np.minimum.accumulate(getattr(trajectory, _OBJECTIVE.series))),
        "meanRange": _column(mean),
        "lowRange": _column(np.maximum(mean - deviation, ranges.min(axis=1))),
        "highRange": _column(np.minimum(mean + deviation, ranges.max(axis=1))),
        "numComponents": _column(trajectory.num_components, "<u4"),
        "survivors": _column(np.rint(trajectory.fraction_surviving * trajectory.scenario.num_agents), "<u4"),
        # An agent that is never caught gets a step that never comes.
        "caughtAt": _column(np.where(trajectory.caught_at < 0, 2**32 - 1, trajectory.caught_at), "<u4"),
    }
    return {
        "name": name,
        "title": policy_title(name, trajectory.scenario.neighbor_rule.unit),
        "kind": "fixed" if np.ptp(ranges) == 0 else "rule" if name in NAMES else "learned",  # gives the color
        # None if no seed gives this start. A string, because 64 bits do not fit into a number of JavaScript.
        "seed": None if trajectory.is_start_given else str(trajectory.seed),
        "scenario": json.loads(trajectory.scenario.to_json()),
        "rangeUnit": trajectory.scenario.neighbor_rule.unit,
        "objective": _OBJECTIVE.symbol,
        "columns": columns,
    }


def _headings(velocities: NDArray[np.float64]) -> dict[str, Any]:
    """Return the headings as signed bytes, where 127 is 1; the heading of an agent at rest is 0."""
    speed = np.linalg.norm(velocities, axis=-1, keepdims=True)
    unit = np.divide(velocities, speed, out=np.zeros_like(velocities), where=speed > 0)
    return _column(np.rint(unit * 127), "|i1")


def _column(values: NDArray[Any], dtype: str = "<f4") -> dict[str, Any]:
    packed = np.ascontiguousarray(values, dtype=dtype)
    data = b64encode(zlib.compress(packed.tobytes())).decode()
    return {"dtype": packed.dtype.name, "shape": packed.shape, "data": data}
