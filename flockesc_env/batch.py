"""The batch of flocks that every environment and rollout steps."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any, Final

import numpy as np
from gymnasium.utils import seeding
from numpy.typing import NDArray

from flockesc_env import _core
from flockesc_env._checks import FloatArray, as_count, as_floats
from flockesc_env.errors import ArgumentError
from flockesc_env.options import EnvOptions
from flockesc_env.scenario import FlockScenario
from flockesc_env.spaces import Control, ObservationLayout, RangeActions

METRICS: Final = (
    "mean_distance",
    "min_distance",
    "min_mean_distance",
    "min_min_distance",
    "num_components",
    "polarization",
)
"""Keys of ``info``, beside ``interaction_range``."""


STARTS: Final = ("initial_positions", "initial_velocities", "predator_positions", "predator_velocities")
"""Keys of the ``options`` of a reset."""

Start = Sequence[FloatArray | None]
"""The arrays of ``STARTS``; ``None``: the seed's, or the scenario's."""

NO_START: Final[Start] = (None, None, None, None)


class EpisodeSeeds:
    """The seeds of one slot: a given seed starts an episode itself, later ones are drawn from it.

    Without a seed ever given the first one comes from the operating system.
    """

    def __init__(self) -> None:
        self._rng: np.random.Generator | None = None

    def next(self, seed: int | None = None) -> int:
        """Return the seed of the next episode; ``seed`` starts the sequence anew."""
        if seed is not None or self._rng is None:
            self._rng, _ = seeding.np_random(seed)
        return draw_seed(self._rng) if seed is None else seed


def draw_seed(rng: np.random.Generator) -> int:
    """Draw the seed of an episode that nobody named.

    It is 2^32 or more: a smaller seed, such as people name, never comes up by chance, so that flocks held
    out for a report cannot slip into training.
    """
    return int(rng.integers(2**32, 2**63))


class FlockBatch:
    """Episodes of one scenario, stepped together; slots do not influence each other.

    Args:
        scenario: the flock model's parameters.
        options: what actions mean, what is paid, what is seen.
        num_flocks: number of slots.
        per_agent: whether every agent has its own range and observation row, or every flock one.
        num_threads: threads over which slots are spread; ``None``: one per core.

    Attributes:
        rows: observation rows and ranges per flock: 1, or the number of agents.
        control: what a policy needs to know.
    """

    def __init__(
        self,
        scenario: FlockScenario,
        options: EnvOptions,
        *,
        num_flocks: int = 1,
        per_agent: bool = False,
        num_threads: int | None = None,
    ) -> None:
        self.scenario = scenario
        self.options = options
        self.num_flocks = as_count(num_flocks, "num_flocks")
        self.rows = scenario.num_agents if per_agent else 1
        threads = None if num_threads is None else as_count(num_threads, "num_threads")
        document = options.to_core(scenario, per_agent=per_agent)
        self._core = _core.FlockBatch(scenario.to_json(), document, self.num_flocks, threads)
        self.control = Control(
            actions=RangeActions(options),
            layout=ObservationLayout.of(_core.observation_entries(per_agent, scenario.dimension)),
            per_agent=per_agent,
            num_agents=scenario.num_agents,
            num_steps=scenario.num_steps,
        )

    def start(self, options: Mapping[str, Any] | None) -> Start:
        """Check the ``options`` of a reset, before anything changes.

        Args:
            options: any of ``initial_positions`` and ``initial_velocities``, shape (n, D), and
                ``predator_positions`` and ``predator_velocities``, shape (P, D), in m and m/s.

        Raises:
            ArgumentError: naming what has an unknown name, a wrong shape or an entry that is not finite.
        """
        dimension = self.scenario.dimension
        agents = (self.scenario.num_agents, dimension)
        predators = (len(self.scenario.predators), dimension)
        shapes = dict(zip(STARTS, (agents, agents, predators, predators), strict=True))
        options = options or {}
        for name in options:
            if name not in shapes:
                raise ArgumentError(f"options[{name!r}]", f"one of {', '.join(shapes)}", "an unknown option")
        given = {name: options.get(name) for name in shapes}
        return [
            None if value is None else as_floats(value, name, shapes[name]) for name, value in given.items()
        ]

    def reset(self, slot: int, seed: int, start: Start = NO_START) -> None:
        """Start a new episode in one slot, with the flock of ``seed`` where ``start`` gives nothing else."""
        self._core.reset(slot, seed, *start)

    def step(self, ranges: FloatArray) -> tuple[NDArray[np.float32], FloatArray]:
        """Hold ranges in m, shape (num_flocks * rows,), for one action in every slot.

        Returns:
            Observations (num_flocks * rows, entries) and rewards (num_flocks * rows,), both new arrays.

        Raises:
            EpisodeError: if a slot was never reset or has reached its horizon.
        """
        return self._core.step(ranges)

    def observe(self, slot: int) -> NDArray[np.float32]:
        """Return the observation of one slot, shape (rows, entries)."""
        return self._core.observe(slot)

    def metrics(self) -> dict[str, NDArray[Any]]:
        """Return the entries of ``METRICS``, each of shape (num_flocks,)."""
        return self._core.metrics()

    def ended(self) -> NDArray[np.bool]:
        """Return which slots have reached their horizon, shape (num_flocks,)."""
        return self._core.ended()

    def state(self, slot: int) -> dict[str, Any]:
        """Return a copy of everything that moves in one slot, with ``step`` and ``interaction_range``."""
        return self._core.state(slot)


def infos(batch: FlockBatch) -> list[dict[str, Any]]:
    """Return one new ``info`` of plain numbers per flock, without ``interaction_range``."""
    columns = batch.metrics()
    rows = zip(*(columns[name].tolist() for name in METRICS), strict=True)
    return [dict(zip(METRICS, row, strict=True)) for row in rows]
