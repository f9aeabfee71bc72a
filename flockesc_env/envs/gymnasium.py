"""Gymnasium environments with one flock: one action sets its interaction range, or moves its predator."""

from __future__ import annotations

from typing import Any, Unpack

import gymnasium
import numpy as np
from numpy.typing import NDArray

from flockesc_env.common.checks import FloatArray, as_seed
from flockesc_env.common.errors import InputError, ResetNeededError
from flockesc_env.envs._base import FlockArguments, OneFlock, Registered, survives_interrupts
from flockesc_env.episodes.batch import Observations, info_dicts, is_over
from flockesc_env.episodes.predators import reset_policy
from flockesc_env.policies.base import Policy
from flockesc_env.policies.registry import as_flock_policy
from flockesc_env.policies.rules import FixedRange
from flockesc_env.scenario.flock import FlockScenario
from flockesc_env.scenario.presets import as_scenario


class GymnasiumEnv(Registered, OneFlock[Observations], gymnasium.Env[Observations, Any]):
    """Base class of the Gymnasium environments with one flock."""

    _ranges_at_start: FloatArray | None = None
    """The entry ``interaction_range`` of the ``info`` of ``reset``; ``None``: no such entry."""

    @survives_interrupts
    def reset(
        self, *, seed: int | None = None, options: dict[str, Any] | None = None
    ) -> tuple[Observations, dict[str, Any]]:
        """Start an episode.

        Args:
            seed: seed of the flock; ``simulate(seed=seed)`` runs the same flock. ``None``: the next seed of
                the seed schedule (``episode_seed``).
            options: any of ``initial_positions``, ``initial_velocities``, shape (n, D), and
                ``predator_positions``, ``predator_velocities``, shape (P, D), in m and m/s; and ``episode``,
                the index of the episode in the seed schedule; default: 0 if ``seed`` is given, otherwise the
                next index.

        Raises:
            InputError: if the seed or an option is invalid; the running episode continues.
        """
        if seed is not None:
            seed = as_seed(seed)
        rows, columns = self._batch.reset([0], [seed], [options])
        super().reset(seed=seed)
        observation = self._resume(rows)
        self._show()
        return observation, info_dicts(columns, self._ranges_at_start)[0]


class FlockEscapeEnv(GymnasiumEnv):
    """A flock under attack, ``flockesc/FlockEscape-v1``; the action is its interaction range.

    docs/model.md describes observations, rewards and ``info``. An episode terminates when all agents are
    caught and is truncated after ``scenario.num_steps`` model steps.

    Args:
        scenario: the flock model's parameters, or a preset's name; default: the paper's.
        **arguments: see ``FlockArguments`` and ``EnvOptions``.

    Raises:
        InputError: if an argument has the wrong type or value; if an option is unknown, missing or out of
            bounds; if the scenario has no predator.
    """

    _ranges_at_start = np.zeros(1)

    def __init__(
        self, scenario: FlockScenario | str | None = None, **arguments: Unpack[FlockArguments]
    ) -> None:
        super().__init__(scenario, arguments)
        self.observation_space = self.policy_spec.layout.space()
        self.action_space = self.policy_spec.actions.space()

    @survives_interrupts
    def step(self, action: Any) -> tuple[NDArray[np.float32], float, bool, bool, dict[str, Any]]:
        """Set the interaction range and run ``steps_per_action`` model steps.

        Args:
            action: shape (1,), or an integer if the action mode is ``"discrete"``.

        Returns:
            Observation, reward, terminated, truncated and ``info``.

        Raises:
            InputError: if the action is outside the action space.
            ResetNeededError: if called before ``reset`` or after the end of the episode.
        """
        observation, reward, has_ended, info = self._batch.step_one(action)
        self._show()
        terminated = bool(is_over(info))
        return observation, reward, terminated, has_ended and not terminated, info

    def _resume(self, rows: Observations) -> Observations:
        observation: Observations = rows[0]
        return observation


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
        super().__init__(given, arguments, per_agent=per_agent)
        spec = self._batch.predator_policy_spec
        if spec.count != 1:
            raise InputError("predators", "exactly one Learned predator", spec.count)
        self.policy_spec = spec  # type: ignore[assignment]
        chosen = FixedRange(10.0) if flock_policy is None else flock_policy
        self.flock_policy = as_flock_policy(chosen, "flock_policy")
        self.flock_policy.check(self.options, per_agent=per_agent)
        self.observation_space = spec.layout.space()
        self.action_space = spec.space()

    @survives_interrupts
    def step(self, action: Any) -> tuple[NDArray[np.float32], float, bool, bool, dict[str, Any]]:
        """Set the predator's acceleration and run ``steps_per_action`` steps; see ``FlockEscapeEnv.step``.

        Args:
            action: acceleration ahead, to the left and, if D = 3, up, in units of ``max_acceleration``, shape
                (D,).
        """
        predator_actions = self._batch.predator_policy_spec.plain(action, None, "action")
        if self._batch.core.has_ended(0):
            raise ResetNeededError("step() called after the end of the episode; call reset()")
        ranges = self.flock_policy.act(self._flock_observations, self._batch.policy_spec)
        step = self._batch.step(ranges, predator_actions=predator_actions)
        self._flock_observations, _, ended, _, columns = step
        has_ended, info = bool(ended[0]), info_dicts(columns)[0]
        self._show()
        reward = float(self._batch.core.predator_rewards()[0])
        terminated = bool(is_over(info))
        truncated = has_ended and not terminated
        return self._batch.core.observe([0], "predators")[0], reward, terminated, truncated, info

    def _settle(self) -> None:
        super()._settle()
        self._resume(self._batch.core.observe([0]))

    def _resume(self, rows: Observations) -> Observations:
        self._flock_observations = rows
        reset_policy(self.flock_policy, np.ones(len(rows), bool))
        observation: Observations = self._batch.core.observe([0], "predators")[0]
        return observation
