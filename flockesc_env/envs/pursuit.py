"""Gymnasium environment of a predator: the action is its acceleration, the flock follows a given policy."""

from __future__ import annotations

from typing import Any, ClassVar, Unpack

import gymnasium
import numpy as np
from numpy.typing import NDArray

from flockesc_env import _core
from flockesc_env.common.checks import as_policy, as_seed
from flockesc_env.common.errors import ResetNeededError, ScenarioError
from flockesc_env.envs._base import CommonArguments, OneFlock, needs_reset_if_interrupted
from flockesc_env.episodes.batch import Observations, is_over
from flockesc_env.episodes.memory import reset_policy
from flockesc_env.policies.base import Policy
from flockesc_env.policies.ranges import FixedRange
from flockesc_env.scenario.flock import FlockScenario
from flockesc_env.scenario.presets import as_scenario


class FlockPursuitEnv(OneFlock[NDArray[np.float32]], gymnasium.Env[NDArray[np.float32], Any]):
    """A predator that attacks a flock, ``flockesc/FlockPursuit-v0``; the action is its acceleration.

    docs/model.md describes observations ("Predator view") and ``info``. The reward is minus the mean reward
    of the flock. An episode terminates when all agents are caught and is truncated after
    ``scenario.num_steps`` model steps.

    Args:
        scenario: the flock model's parameters, or a preset's name; default: the paper's. Exactly one
            predator must be ``Learned``; if none is, ``scenario.with_learned_predators()`` is used.
        flock_policy: sets the ranges of the flock; ``None``: ``FixedRange(10.0)``.
        per_agent: True: the flock policy sets one range per agent. False: one for the flock.
        **arguments: see ``CommonArguments`` and ``EnvOptions``.

    Raises:
        ArgumentError: if an argument has the wrong type or value.
        OptionError: if an option is unknown, missing or out of bounds.
        ScenarioError: if the scenario has no predator or more than one ``Learned`` predator.
        DependencyNotInstalled: if ``render_mode`` is given and pygame is not installed.
    """

    _arguments: ClassVar[type] = CommonArguments
    _flock_observations: Observations

    def __init__(
        self,
        scenario: FlockScenario | str | None = None,
        *,
        flock_policy: Policy | None = None,
        per_agent: bool = False,
        **arguments: Unpack[CommonArguments],
    ) -> None:
        given = as_scenario(scenario, FlockScenario)
        if not given.num_learned:
            given = given.with_learned_predators()
        super().__init__(given, arguments, per_agent=per_agent)
        self.policy_spec = self._batch.predator_policy_spec
        if self.policy_spec.count != 1:
            raise ScenarioError("predators", "exactly one Learned predator", self.policy_spec.count)
        self.flock_policy = (
            FixedRange(10.0) if flock_policy is None else as_policy(flock_policy, "flock_policy")
        )
        self.observation_space = self.policy_spec.layout.space()
        self.action_space = self.policy_spec.space()

    @needs_reset_if_interrupted
    def reset(
        self, *, seed: int | None = None, options: dict[str, Any] | None = None
    ) -> tuple[NDArray[np.float32], dict[str, Any]]:
        """Start an episode.

        Args:
            seed: see ``FlockEscapeEnv.reset``.
            options: see ``FlockEscapeEnv.reset``.

        Raises:
            ArgumentError: if the seed or an option is invalid; the running episode continues.
        """
        start = self._batch.start(options)
        if seed is not None:
            seed = as_seed(seed)
        flock_observations, columns = self._batch.reset([0], [seed], [start])
        super().reset(seed=seed)
        self._begin(flock_observations)
        self._show()
        return self._batch.observe_predators([0])[0], _core.infos(columns)[0]

    @needs_reset_if_interrupted
    def step(self, action: Any) -> tuple[NDArray[np.float32], float, bool, bool, dict[str, Any]]:
        """Set the predator's acceleration and run ``steps_per_action`` model steps.

        Args:
            action: acceleration ahead, to the left and, if D = 3, up, in units of ``max_acceleration``, shape
                (D,).

        Returns:
            Observation, reward, terminated, truncated and ``info``.

        Raises:
            ActionError: if the action is outside the action space.
            ResetNeededError: if called before ``reset`` or after the end of the episode.
        """
        predator_actions = self.policy_spec.plain_one(action)
        if self._batch.has_ended(0):
            raise ResetNeededError("step() called after the end of the episode; call reset()")
        ranges = self.flock_policy.act(self._flock_observations, self._batch.policy_spec)
        self._flock_observations, _, has_ended, _, info = self._batch.step_flock(
            ranges, predator_actions=predator_actions
        )
        self._show()
        reward = float(self._batch.predator_rewards()[0])
        terminated = bool(is_over(info))
        truncated = has_ended and not terminated
        return self._batch.observe_predators([0])[0], reward, terminated, truncated, info

    def _observe(self) -> NDArray[np.float32]:
        self._begin(self._batch.observe([0]))
        observation: NDArray[np.float32] = self._batch.observe_predators([0])[0]
        return observation

    def _begin(self, flock_observations: Observations) -> None:
        """Keep the flock's first observations and clear the memory of its policy."""
        self._flock_observations = flock_observations
        reset_policy(self.flock_policy, np.ones(len(flock_observations), bool))
