"""What episodes start from: seeds of the schedule that all environments follow, scenarios, reset options."""

import secrets
from collections.abc import Mapping, Sequence
from typing import Any, Final

from flockesc_env import _core
from flockesc_env.common.checks import as_floats, as_options, as_seed
from flockesc_env.common.errors import InputError
from flockesc_env.scenario.flock import FlockScenario
from flockesc_env.scenario.presets import as_scenario

Scenarios = FlockScenario | str | Sequence[FlockScenario | str]
"""A scenario or a preset's name, for all flocks; or a list with one entry per flock."""

_ARRAYS: Final = ("initial_positions", "initial_velocities", "predator_positions", "predator_velocities")
RESET_OPTIONS: Final = (*_ARRAYS, "episode")
"""Keys of the ``options`` of a reset: arrays of the initial state, and the index of the episode."""


def episode_seed(seed: int, episode: int) -> int:
    """Return the seed of the ``episode``-th episode of an environment after ``reset(seed=seed)``.

    Episode 0 is the episode that this reset starts; its seed is ``seed`` itself. Resets without a seed and
    autoreset start the later episodes. Their seeds are in [2^32, 2^63), so they never coincide with seeds
    below 2^32: flocks with small seeds can be held out for evaluation.

    Args:
        seed: seed passed to ``reset``, an integer in [0, 2^64).
        episode: index of the episode, an integer in [0, 2^64).
    """
    return _core.episode_seed(as_seed(seed), as_seed(episode, "episode"))


def fresh_seed() -> int:
    """Return a random seed in [2^32, 2^63) from the operating system."""
    return episode_seed(secrets.randbits(64), 1)


def consecutive_seeds(first: int, count: int) -> range:
    """Return the seeds of ``count`` flocks: ``first``, ``first + 1``, .."""
    first = as_seed(first)
    return range(first, as_seed(first + count - 1, "seed of the last flock") + 1)


def as_scenarios(given: Scenarios | None) -> FlockScenario | list[FlockScenario]:
    """Return the scenario of all flocks or, if a list was given, one scenario per flock."""
    if isinstance(given, str) or not isinstance(given, Sequence):
        return as_scenario(given, FlockScenario)
    if not given:
        raise InputError("scenario", "one scenario per flock", "an empty list")
    return [as_scenario(one, FlockScenario, f"scenario[{flock}]") for flock, one in enumerate(given)]


def distinct_scenarios(
    given: FlockScenario | Sequence[FlockScenario], num_flocks: int
) -> tuple[list[FlockScenario], list[int]]:
    """Return the different scenarios in order, and the index of each flock's scenario."""
    if isinstance(given, FlockScenario):
        return [given], [0] * num_flocks
    if len(given) != num_flocks:
        raise InputError("scenario", f"a list of {num_flocks}, one scenario per flock", len(given))
    for flock, scenario in enumerate(given):
        # These give observations and actions their meaning. The core compares fields that determine shapes.
        for name in ("initial_side", "range_unit"):
            expected, value = getattr(given[0], name), getattr(scenario, name)
            if value != expected:
                raise InputError(f"scenario[{flock}].{name}", f"{expected}, as in scenario[0]", value)
    documents = [scenario.to_json() for scenario in given]
    distinct = dict(zip(documents, given, strict=True))
    indices = {document: index for index, document in enumerate(distinct)}
    return list(distinct.values()), [indices[document] for document in documents]


def as_start(options: Mapping[str, Any] | None, scenario: FlockScenario) -> dict[str, Any]:
    """Return the ``options`` of a reset after validation, with all keys; see ``FlockEscapeEnv.reset``."""
    agents = (scenario.num_agents, scenario.dimension)
    predators = (len(scenario.predators), scenario.dimension)
    shapes = dict(zip(_ARRAYS, (agents, agents, predators, predators), strict=True))
    start: dict[str, Any] = dict.fromkeys(RESET_OPTIONS)
    for name, value in as_options(options, RESET_OPTIONS).items():
        if value is not None and name == "episode":
            start[name] = as_seed(value, "options['episode']")
        elif value is not None:
            start[name] = as_floats(value, name, shapes[name])
    return start
