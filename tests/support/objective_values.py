"""Definitions of the objectives, independent of the core, and their columns."""

from collections.abc import Callable

import numpy as np

from flockesc_env.scenario.objectives import FLOCK_OBJECTIVES

VALUES: dict[str, Callable[[np.ndarray, int], float]] = {
    "min_mean_distance": lambda distances, _: float(distances.mean()),
    "min_min_distance": lambda distances, _: float(distances.min()),
    "fraction_surviving": lambda distances, num_agents: len(distances) / num_agents,
}
"""The value at one time, from the distances of the agents that are not caught and the number of agents."""

SERIES = {name: spec.series for name, spec in FLOCK_OBJECTIVES.items()}
COLUMNS = {name: spec.name for name, spec in FLOCK_OBJECTIVES.items()}
INFO_KEYS = {*SERIES.values(), *COLUMNS.values(), "polarization", "interaction_range"}
IN_GOLDEN_DATA = {"min_mean_distance", "min_min_distance", "fraction_surviving"}
LATER = {"mean_range", "mean_heard"} | {
    prefix + each[name]
    for prefix in ("", "_")
    for each in (SERIES, COLUMNS)
    for name in FLOCK_OBJECTIVES.keys() - IN_GOLDEN_DATA
}
"""Columns that are younger than the golden data, and their masks; hashes leave them out."""
