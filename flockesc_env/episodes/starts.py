"""Options of a reset: initial states and the index of the episode."""

from __future__ import annotations

from collections.abc import Mapping
from types import MappingProxyType
from typing import Any, Final

from flockesc_env.common.checks import as_floats, as_options, as_seed
from flockesc_env.scenario.flock import FlockScenario

_ARRAYS: Final = ("initial_positions", "initial_velocities", "predator_positions", "predator_velocities")
RESET_OPTIONS: Final = (*_ARRAYS, "episode")
"""Keys of the ``options`` of a reset: arrays of the initial state, and the index of the episode."""

Start = Mapping[str, Any]
"""Validated options of a reset, with all keys. The seed and the scenario determine the rest (None)."""

NO_START: Final[Start] = MappingProxyType(dict.fromkeys(RESET_OPTIONS))


def as_start(options: Mapping[str, Any] | None, scenario: FlockScenario) -> Start:
    """Return the ``options`` of a reset after validation; see ``FlockEscapeEnv.reset``."""
    agents = (scenario.num_agents, scenario.dimension)
    predators = (len(scenario.predators), scenario.dimension)
    shapes = dict(zip(_ARRAYS, (agents, agents, predators, predators), strict=True))
    start = dict(NO_START)
    for name, value in as_options(options, RESET_OPTIONS).items():
        if value is not None:
            shape = shapes.get(name)
            field = f"options[{name!r}]"
            start[name] = as_seed(value, field) if shape is None else as_floats(value, name, shape)
    return start
