"""Policies that do not depend on the flock: ``FixedRange``, ``RandomRange`` and ``ScheduledRange``."""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from flockesc_env.common.checks import as_floats, as_seed
from flockesc_env.common.errors import InputError
from flockesc_env.episodes.spaces import PolicySpec
from flockesc_env.policies.base import LONGEST, BasePolicy, Observations
from flockesc_env.scenario.line import LineScenario
from flockesc_env.scenario.presets import Scenario


class FixedRange(BasePolicy):
    """A policy with a fixed range, as in the paper's grid search.

    Args:
        interaction_range: rho in m.

    Raises:
        InputError: if ``interaction_range`` is not a finite number >= 0.
    """

    def __init__(self, interaction_range: float) -> None:
        self.interaction_range = float(as_floats(interaction_range, "interaction_range", (), least=0.0))

    def default_options(self, scenario: Scenario) -> dict[str, Any]:
        """Return a ``max_range`` that includes the range."""
        return _including(self.interaction_range, scenario)

    def act(self, observations: Observations, spec: PolicySpec) -> NDArray[Any]:
        """Return the action of the fixed range for every row; see ``Policy.act``."""
        return spec.actions.from_ranges(np.full(len(observations), self.interaction_range))


class RandomRange(BasePolicy):
    """A policy that draws a range for every row and action, uniform in [``min_range``, ``max_range``].

    Args:
        seed: seed of the random numbers; ``None``: a random seed from the operating system.

    Raises:
        InputError: if ``seed`` is neither None nor an integer in [0, 2^64).
    """

    def __init__(self, seed: int | None = None) -> None:
        self._rng = np.random.default_rng(None if seed is None else as_seed(seed))

    def act(self, observations: Observations, spec: PolicySpec) -> NDArray[Any]:
        """Return a random action for every row; see ``Policy.act``."""
        actions = spec.actions
        return actions.from_ranges(self._rng.uniform(actions.min_range, actions.max_range, len(observations)))


class ScheduledRange(BasePolicy):
    """An open-loop policy: ranges are a given function of time.

    Args:
        schedule: rho in m in every step of the episode, shape (T,), or for every agent, shape (T, n). If an
            action lasts several steps, the entry of the first step is used.

    Raises:
        InputError: if ``schedule`` has another shape, or an entry is not a finite number >= 0.
    """

    def __init__(self, schedule: ArrayLike) -> None:
        self.schedule = as_floats(schedule, "schedule", least=0.0)
        if self.schedule.ndim not in {1, 2} or not self.schedule.size:
            raise InputError("schedule", "shape (T,) or (T, n)", f"shape {self.schedule.shape}")
        self.per_agent = True if self.schedule.ndim == 2 else None

    def check_length(self, num_steps: int) -> None:
        """Check that the schedule has a range for every step of an episode."""
        if len(self.schedule) != num_steps:
            raise InputError("schedule", f"{num_steps} steps", len(self.schedule))

    def default_options(self, scenario: Scenario) -> dict[str, Any]:
        """Return one step per action, and a ``max_range`` that includes all ranges."""
        return {"steps_per_action": 1, **_including(float(self.schedule.max()), scenario)}

    def act(self, observations: Observations, spec: PolicySpec) -> NDArray[Any]:
        """Return the action of the scheduled range for every row; see ``Policy.act``.

        Raises:
            InputError: if the schedule does not match the number of steps or of agents.
        """
        self.check_length(spec.num_steps)
        time = observations[:, spec.layout.index("time")].astype(np.float64)
        steps = np.minimum(np.rint(time * spec.num_steps).astype(int), spec.num_steps - 1)
        if self.schedule.ndim == 1:
            return spec.actions.from_ranges(self.schedule[steps])
        agents = self.schedule.shape[1]
        if not spec.per_agent or agents != spec.num_agents or len(observations) % agents:
            raise InputError("schedule", f"rows of all {agents} agents of each flock", len(observations))
        return spec.actions.from_ranges(self.schedule[steps, np.arange(len(steps)) % agents])


def _including(rho: float, scenario: Scenario) -> dict[str, Any]:
    return {"max_range": max(rho, 1.0 if isinstance(scenario, LineScenario) else LONGEST)}
