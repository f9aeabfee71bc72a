"""Gymnasium environments with one flock: one action sets its interaction range, or moves its predator."""

from typing import Any, Unpack

import gymnasium
import numpy as np
from numpy.typing import NDArray

from flockesc_env.common.checks import FloatArray, as_seed
from flockesc_env.common.errors import InputError
from flockesc_env.envs._base import FlockArguments, OneFlock, Registered, survives_interrupts
from flockesc_env.episodes.batch import Observations, info_dicts, is_over
from flockesc_env.policies.base import AnyPolicy
from flockesc_env.scenario.flock import FlockScenario


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
        """
        if seed is not None:
            seed = as_seed(seed)
        rows, columns = self._batch.reset([0], [seed], [options])
        super().reset(seed=seed)
        observation = self._resume(rows)
        self._show()
        return observation, info_dicts(columns, self._ranges_at_start)[0]

    @survives_interrupts
    def step(self, action: Any) -> tuple[NDArray[np.float32], float, bool, bool, dict[str, Any]]:
        """Set the range, or the predator's acceleration, and run ``steps_per_action`` model steps.

        Args:
            action: shape (1,), or an integer if the action mode is ``"discrete"``. In ``PredatorEnv`` the
                acceleration ahead, to the left and, if D = 3, up, shape (D,); 1 is ``max_acceleration``.

        Returns:
            Observation, reward, terminated, truncated and ``info``.

        Raises:
            ResetNeededError: if called before ``reset`` or after the end of the episode.
        """
        observation, reward, has_ended, info = self._batch.step_one(action)
        self._show()
        terminated = bool(is_over(info))
        return observation, reward, terminated, has_ended and not terminated, info

    def _resume(self, rows: Observations) -> Observations:
        observation: Observations = rows[0]
        return observation


class FlockEscapeEnv(GymnasiumEnv):
    """A flock under attack, ``flockesc/FlockEscape-v1``; the action is its interaction range.

    docs/model.md describes observations, rewards and ``info``. An episode terminates when all agents are
    caught and is truncated after ``scenario.num_steps`` model steps.

    Args:
        scenario: the flock model's parameters, or a preset's name; default: the paper's.
        **arguments: see ``FlockArguments`` and ``EnvOptions``.
    """

    _ranges_at_start = np.zeros(1)

    def __init__(
        self, scenario: FlockScenario | str | None = None, **arguments: Unpack[FlockArguments]
    ) -> None:
        super().__init__(scenario, arguments)
        self.observation_space = self.policy_spec.layout.space()
        self.action_space = self.policy_spec.actions.space()


class PredatorEnv(GymnasiumEnv):
    """A predator that attacks a flock, ``flockesc/Predator-v1``; the action is its acceleration.

    docs/model.md describes observations ("Predator view") and ``info``. The reward is minus the mean reward
    of the flock. An episode terminates when all agents are caught and is truncated after
    ``scenario.num_steps`` model steps.

    Args:
        scenario: the flock model's parameters, or a preset's name; default: the paper's. Exactly one
            predator must be ``Learned``; if none is, ``scenario.with_learned_predators()`` is used.
        flock_policy: sets the ranges of the flock: a policy, its name or path, or a model of
            stable-baselines3; ``None``: ``"fixed:10"``. It plays with the options that it knows.
        per_agent: True: the flock policy sets one range per agent. False: one for the flock. ``None``: as in
            ``rollout``.
        **arguments: see ``FlockArguments`` (without ``predator_policy``) and ``EnvOptions``.
    """

    def __init__(
        self,
        scenario: FlockScenario | str | None = None,
        *,
        flock_policy: AnyPolicy = None,
        per_agent: bool | None = None,
        **arguments: Unpack[FlockArguments],
    ) -> None:
        super().__init__(scenario, arguments, per_agent=per_agent, side="predator", flock_policy=flock_policy)
        if self._batch.rows != 1:
            raise InputError("predators", "exactly one Learned predator", self._batch.rows)
        self.observation_space = self.policy_spec.layout.space()
        self.action_space = self.policy_spec.space()
