"""``Branches``: values of candidate ranges, from copies of flocks that are played to the end."""

from typing import cast

import numpy as np

from flockesc_env import FlockScenario, InputError, Policy
from flockesc_env.common.stats import FloatArray
from flockesc_env.episodes.batch import FlockBatch, Observations
from flockesc_env.scenario.options import EnvOptions
from training.run import Run

GROUP = 16
"""Flocks that are played up to the same action and copied there."""

EXPLORATION = 0.1
"""Probability of a random candidate as an action before the flock is copied."""

_EARLINESS = 3
"""Exponent of the uniform random number that chooses the action: early ones decide more."""


class Branches:
    """Values candidate ranges: each is set for one action, then a teacher plays the flock to the end.

    Args:
        run: the run, whose task is played.
        ranges: candidate ranges in m.
        count: number of candidates per flock that are drawn at random and valued.

    Attributes:
        spec: policy spec of the environment.

    Raises:
        InputError: if the task is a line or has one range per agent, or a candidate is missing.
    """

    def __init__(self, run: Run, ranges: tuple[float, ...], count: int) -> None:
        model = run.task.scenario
        if run.task.per_agent or not isinstance(model, FlockScenario):
            raise InputError("task", "one range for a flock", run.task.name)
        if not ranges:
            raise InputError("ranges", "at least one candidate range", "none")
        self._candidates, self._count, self._column = np.array(ranges), count, run.task.spec.name
        self._model, self.spec = model, run.policy_spec

    def values(
        self, policy: Policy, teacher: Policy, flocks: range, rng: np.random.Generator
    ) -> tuple[Observations, FloatArray, int]:
        """Play flocks up to a random action and value some candidates there.

        Args:
            policy: chooses the actions before, except those that are drawn at random (``EXPLORATION``).
            teacher: plays the copies of the flocks to the end.
            flocks: seeds of the flocks.
            rng: draws the action, the exploration and the candidates.

        Returns:
            The observations, shape (flocks, entries); the values in m, shape (flocks, candidates), which
            are nan for candidates that were not drawn; and the number of actions.
        """
        candidates, num_flocks, num_actions = self._candidates, len(flocks), self.spec.num_actions
        source = self._batch(num_flocks)
        observations, _ = source.reset(range(num_flocks), list(flocks))
        before = int(num_actions * rng.random() ** _EARLINESS)
        for _ in range(before):
            actions = policy.act(observations, self.spec)
            explored = rng.random(num_flocks) < EXPLORATION
            drawn = rng.choice(candidates, int(explored.sum()))
            actions[explored] = self.spec.actions.from_ranges(drawn)
            observations, *_ = source.step(actions)
        chosen = np.array([rng.permutation(len(candidates))[: self._count] for _ in flocks])
        values = np.full((num_flocks, len(candidates)), np.nan)
        found, after = self._play(source, candidates[chosen], teacher)
        np.put_along_axis(values, chosen, found, axis=1)
        return observations, values, before * num_flocks + after

    def _play(self, source: FlockBatch, ranges: FloatArray, teacher: Policy) -> tuple[FloatArray, int]:
        """Return the objective of copies that begin with ``ranges``, (flocks, copies), and the actions."""
        num_flocks, num_copies = ranges.shape
        copies = self._batch(ranges.size)
        copies.set_state(source.get_state(np.repeat(np.arange(num_flocks), num_copies).tolist()))
        actions, taken = self.spec.actions.from_ranges(ranges.ravel()), 0
        while True:
            observations, _, has_ended, *_ = copies.step(actions, at_end="stay")
            taken += ranges.size
            if has_ended.all():
                break
            actions = teacher.act(observations, self.spec)
        values: FloatArray = copies.core.metrics()[self._column]
        return values.reshape(ranges.shape), taken

    def _batch(self, num_flocks: int) -> FlockBatch:
        options = cast("EnvOptions", self.spec.options)
        return FlockBatch(self._model, options, num_flocks=num_flocks, num_threads=1)
