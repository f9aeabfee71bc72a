"""Gymnasium: the action controls the predator of a flock that follows its own policy."""

from __future__ import annotations

from typing import Any, ClassVar, Unpack

import gymnasium
import numpy as np
from numpy.typing import NDArray

from flockesc_env.common.checks import as_policy, as_seed
from flockesc_env.common.errors import ResetNeededError, ScenarioError
from flockesc_env.envs._base import CommonArguments, OneFlock
from flockesc_env.episodes.batch import Observations, infos, is_over
from flockesc_env.episodes.memory import reset_policy
from flockesc_env.policies.base import Policy
from flockesc_env.policies.ranges import FixedRange
from flockesc_env.scenario.flock import FlockScenario
from flockesc_env.scenario.predators import Learned
from flockesc_env.scenario.presets import as_scenario


class FlockPursuitEnv(OneFlock[NDArray[np.float32]], gymnasium.Env[NDArray[np.float32], Any]):
    """A predator that attacks a flock, ``flockesc/FlockPursuit-v0``; the action is its acceleration.

    docs/model.md describes observations ("Predator view"), rewards, which are minus those of the flock, and
    ``info``. The horizon truncates an episode; it terminates when all agents are caught.

    Args:
        scenario: the flock model's parameters, or a preset's name; default: the paper's. One of its predators
            is ``Learned``; a scenario without one becomes ``scenario.with_learned_predators()``.
        flock_policy: sets the ranges of the flock; default: ``FixedRange(10.0)``.
        per_agent: whether that policy sets one range per agent, or one for the flock.
        **arguments: see ``CommonArguments`` and ``EnvOptions``.

    Raises:
        ArgumentError: for an argument of a wrong type or value.
        OptionError: for an option that is unknown, missing or out of bounds.
        ScenarioError: for a scenario without predator, or with several ``Learned`` ones.
        DependencyNotInstalled: for a render mode without pygame.
    """

    _arguments: ClassVar[type] = CommonArguments

    def __init__(
        self,
        scenario: FlockScenario | str | None = None,
        *,
        flock_policy: Policy | None = None,
        per_agent: bool = False,
        **arguments: Unpack[CommonArguments],
    ) -> None:
        given = as_scenario(scenario, FlockScenario)
        if not any(isinstance(predator, Learned) for predator in given.predators):
            given = given.with_learned_predators()
        super().__init__(given, arguments, per_agent=per_agent)
        self.policy_spec = self._batch.predator_policy_spec
        if self.policy_spec.count != 1:
            raise ScenarioError("predators", "one Learned predator", self.policy_spec.count)
        self.flock_policy = (
            FixedRange(10.0) if flock_policy is None else as_policy(flock_policy, "flock_policy")
        )
        self._flock_observations: Observations = np.zeros((0, 0), np.float32)
        self.observation_space = self.policy_spec.layout.space()
        self.action_space = self.policy_spec.space()

    def reset(
        self, *, seed: int | None = None, options: dict[str, Any] | None = None
    ) -> tuple[NDArray[np.float32], dict[str, Any]]:
        """Start an episode; see ``FlockEscapeEnv.reset``.

        Raises:
            ArgumentError: naming a bad seed or option; the running episode goes on.
        """
        start = self._batch.start(options)
        if seed is not None:
            seed = as_seed(seed)
            super().reset(seed=seed)
        self._flock_observations, columns = self._batch.reset([0], [seed], start)
        reset_policy(self.flock_policy, np.ones(len(self._flock_observations), bool))
        self._show()
        return self._batch.observe_predators([0])[0], infos(columns)[0]

    def step(self, action: Any) -> tuple[NDArray[np.float32], float, bool, bool, dict[str, Any]]:
        """Hold the acceleration, and the ranges that the flock's policy sets, for ``steps_per_action`` steps.

        Args:
            action: shape (D,): ahead, to the left and, in space, up, over the largest acceleration.

        Raises:
            ActionError: for an action outside of the action space.
            ResetNeededError: before ``reset``, or after the end.
        """
        if not self._flock_observations.size:
            raise ResetNeededError("step() called before reset()")
        predator_actions = self.policy_spec.plain_one(action)
        ranges = self.flock_policy.act(self._flock_observations, self._batch.policy_spec)
        self._flock_observations, _, ended, _, columns = self._batch.step(
            ranges, predator_actions=predator_actions
        )
        self._show()
        reward = float(self._batch.predator_rewards()[0])
        terminated = bool(is_over(columns)[0])
        truncated = bool(ended[0]) and not terminated
        return self._batch.observe_predators([0])[0], reward, terminated, truncated, infos(columns)[0]

    def _observe(self) -> NDArray[np.float32]:
        self._flock_observations = self._batch.observe([0])
        observation: NDArray[np.float32] = self._batch.observe_predators([0])[0]
        return observation
