"""Gymnasium environment of a predator: the action is its acceleration, the flock follows a given policy."""

from __future__ import annotations

from typing import Any, Unpack

import numpy as np
from numpy.typing import NDArray

from flockesc_env.common.errors import InputError, ResetNeededError
from flockesc_env.envs._base import FlockArguments, needs_reset_if_interrupted
from flockesc_env.envs.gymnasium import GymnasiumEnv
from flockesc_env.episodes.batch import Observations, is_over
from flockesc_env.episodes.options import View
from flockesc_env.episodes.predators import reset_policy
from flockesc_env.policies.base import Policy
from flockesc_env.policies.registry import as_policy
from flockesc_env.policies.rules import FixedRange
from flockesc_env.scenario.flock import FlockScenario
from flockesc_env.scenario.presets import as_scenario


class PredatorEnv(GymnasiumEnv):
    """A predator that attacks a flock, ``flockesc/Predator-v1``; the action is its acceleration.

    docs/model.md describes observations ("Predator view") and ``info``. The reward is minus the mean reward
    of the flock. An episode terminates when all agents are caught and is truncated after
    ``scenario.num_steps`` model steps.

    Args:
        scenario: the flock model's parameters, or a preset's name; default: the paper's. Exactly one
            predator must be ``Learned``; if none is, ``scenario.with_learned_predators()`` is used.
        flock_policy: sets the ranges of the flock: a policy, its name or path, or a model of
            stable-baselines3; ``None``: ``FixedRange(10.0)``.
        per_agent: True: the flock policy sets one range per agent. False: one for the flock.
        **arguments: see ``FlockArguments`` (without ``predator_policy``) and ``EnvOptions``.

    Raises:
        InputError: as ``FlockEscapeEnv``, and if several predators are ``Learned``.
    """

    _flock_observations: Observations

    def __init__(
        self,
        scenario: FlockScenario | str | None = None,
        *,
        flock_policy: Policy | str | None = None,
        per_agent: bool = False,
        **arguments: Unpack[FlockArguments],
    ) -> None:
        if "predator_policy" in arguments:
            raise InputError("predator_policy", "actions of the predator in step()", "a policy")
        given = as_scenario(scenario, FlockScenario)
        if not given.num_learned:
            given = given.with_learned_predators()
        super().__init__(given, arguments, view=View.of(per_agent))
        self.policy_spec = self._batch.predator_policy_spec
        if self.policy_spec.count != 1:
            raise InputError("predators", "exactly one Learned predator", self.policy_spec.count)
        chosen = FixedRange(10.0) if flock_policy is None else flock_policy
        self.flock_policy = as_policy(chosen, "flock_policy")
        self.flock_policy.check(self.options, per_agent=View.of(per_agent).is_per_agent)
        self.observation_space = self.policy_spec.layout.space()
        self.action_space = self.policy_spec.space()

    @needs_reset_if_interrupted
    def step(self, action: Any) -> tuple[NDArray[np.float32], float, bool, bool, dict[str, Any]]:
        """Set the predator's acceleration and run ``steps_per_action`` steps; see ``FlockEscapeEnv.step``.

        Args:
            action: acceleration ahead, to the left and, if D = 3, up, in units of ``max_acceleration``, shape
                (D,).
        """
        predator_actions = self.policy_spec.plain_one(action)
        if self._batch.has_ended(0):
            raise ResetNeededError("step() called after the end of the episode; call reset()")
        ranges = self.flock_policy.act(self._flock_observations, self._batch.policy_spec)
        step = self._batch.step_flock(ranges, predator_actions=predator_actions)
        self._flock_observations, _, has_ended, _, info = step
        self._show()
        reward = float(self._batch.predator_rewards()[0])
        terminated = bool(is_over(info))
        truncated = has_ended and not terminated
        return self._batch.observe([0], "predators")[0], reward, terminated, truncated, info

    def _resume(self, rows: Observations) -> Observations:
        self._flock_observations = rows
        reset_policy(self.flock_policy, np.ones(len(rows), bool))
        observation: Observations = self._batch.observe([0], "predators")[0]
        return observation
