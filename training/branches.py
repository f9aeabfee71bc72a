"""``Branches``: values of candidate ranges, from copies of flocks that are played to the end."""

from __future__ import annotations

from typing import Any

import numpy as np

from flockesc_env import ArgumentError, FlockScenario, Policy
from flockesc_env.common.stats import FloatArray
from flockesc_env.episodes.batch import FlockBatch, Observations
from flockesc_env.episodes.options import env_options
from flockesc_env.episodes.spaces import PolicySpec
from training.config import ImitationArgs

GROUP = 16
"""Flocks that are played up to the same action and copied there."""

_EARLINESS = 3
"""Exponent of the uniform random number that chooses the action: early ones decide more."""


class Branches:
    """Values candidate ranges: each is set for one action, then a teacher plays the flock to the end.

    Args:
        args: the setting, and how flocks and candidates are drawn.
        teacher: plays the copies of the flocks.

    Attributes:
        teacher: the same; may be replaced.
        spec: policy spec of the environment.

    Raises:
        ArgumentError: if the setting is a line or has one range per agent, or candidates are missing.
    """

    def __init__(self, args: ImitationArgs, teacher: Policy) -> None:
        model = args.model
        if args.per_agent or not isinstance(model, FlockScenario):
            raise ArgumentError("per_agent", "one range for a flock", "another setting")
        if bool(args.ranges) == bool(args.candidate_inputs):
            raise ArgumentError("ranges", "candidates, or candidate_inputs of a profile", "both or none")
        if args.candidate_inputs and not args.profile_ranges:
            raise ArgumentError("profile_ranges", "candidate ranges", "none")
        self._candidates = np.array(args.ranges or args.profile_ranges)
        self.teacher = teacher
        self._args, self._actions = args, 0
        options: Any = args.env_options()
        self._model, self._options = model, env_options(model, options)
        self.spec: PolicySpec = self._batch(1).policy_spec

    def take_actions(self) -> int:
        """Return the number of actions chosen since the last call."""
        taken, self._actions = self._actions, 0
        return taken

    def values(
        self, policy: Policy, flocks: range, rng: np.random.Generator
    ) -> tuple[Observations, FloatArray]:
        """Play flocks up to a random action and value some candidates there.

        Args:
            policy: chooses the actions before, except those that are drawn at random (``explore``).
            flocks: seeds of the flocks.
            rng: draws the action, the exploration and the candidates.

        Returns:
            The observations, shape (flocks, entries), and the values in m, shape (flocks, candidates), which
            are nan for candidates that were not drawn.
        """
        args, candidates = self._args, self._candidates
        num_flocks, num_actions = len(flocks), -(-self._model.num_steps // args.steps_per_action)
        source = self._batch(num_flocks)
        observations, _ = source.reset(range(num_flocks), list(flocks))
        for _ in range(int(num_actions * rng.random() ** _EARLINESS)):
            actions = policy.act(observations, self.spec)
            explored = rng.random(num_flocks) < args.explore
            drawn = rng.choice(candidates, int(explored.sum()))
            actions[explored] = self.spec.actions.from_ranges(drawn)
            observations, *_ = source.step(actions)
            self._actions += num_flocks
        chosen = np.array([rng.permutation(len(candidates))[: args.branches] for _ in flocks])
        values = np.full((num_flocks, len(candidates)), np.nan)
        np.put_along_axis(values, chosen, self._play(source, candidates[chosen]), axis=1)
        return observations, values

    def _play(self, source: FlockBatch, ranges: FloatArray) -> FloatArray:
        """Return the objective of copies that begin with ``ranges``, shape (flocks, copies)."""
        num_flocks, num_copies = ranges.shape
        copies = self._batch(ranges.size)
        copies.set_state(source.get_state(np.repeat(np.arange(num_flocks), num_copies).tolist()))
        actions = self.spec.actions.from_ranges(ranges.ravel())
        while True:
            observations, _, has_ended, *_ = copies.step(actions, at_end="stay")
            self._actions += ranges.size
            if has_ended.all():
                break
            actions = self.teacher.act(observations, self.spec)
        values: FloatArray = copies.metrics()[self._args.spec.column]
        return values.reshape(ranges.shape)

    def _batch(self, num_flocks: int) -> FlockBatch:
        return FlockBatch(self._model, self._options, num_flocks=num_flocks, num_threads=1)
