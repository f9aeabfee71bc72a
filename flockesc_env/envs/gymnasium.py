"""Gymnasium: one action sets the range of the whole flock."""

from __future__ import annotations

from typing import Any, Unpack

import gymnasium
import numpy as np
from numpy.typing import NDArray

from flockesc_env.common.checks import as_seed
from flockesc_env.envs._base import FlockArguments, OneFlock
from flockesc_env.episodes.batch import infos, is_over
from flockesc_env.scenario.flock import FlockScenario


class FlockEscapeEnv(OneFlock[NDArray[np.float32]], gymnasium.Env[NDArray[np.float32], Any]):
    """A flock under attack, ``flockesc/FlockEscape-v0``; the action is its interaction range.

    docs/model.md describes observations, rewards and ``info``. The horizon truncates an episode; it
    terminates when all agents are caught.

    Args:
        scenario: the flock model's parameters, or a preset's name; default: the paper's.
        **arguments: see ``FlockArguments`` and ``EnvOptions``.

    Raises:
        ArgumentError: for an argument of a wrong type or value.
        OptionError: for an option that is unknown, missing or out of bounds.
        ScenarioError: for a scenario without predator.
        DependencyNotInstalled: for a render mode without pygame.
    """

    def __init__(
        self, scenario: FlockScenario | str | None = None, **arguments: Unpack[FlockArguments]
    ) -> None:
        super().__init__(scenario, arguments)
        self.policy_spec = self._batch.policy_spec
        self.observation_space = self.policy_spec.layout.space()
        self.action_space = self.policy_spec.actions.space()

    def reset(
        self, *, seed: int | None = None, options: dict[str, Any] | None = None
    ) -> tuple[NDArray[np.float32], dict[str, Any]]:
        """Start an episode.

        Args:
            seed: seed of the flock, the same as in ``simulate(seed=seed)``; ``None``: the next one.
            options: any of ``initial_positions``, ``initial_velocities``, shape (n, D), and
                ``predator_positions``, ``predator_velocities``, shape (P, D), in m and m/s; and ``episode``,
                the number of the episode in the schedule of the last seed (``episode_seed``); default: 0
                with a seed, else the next one.

        Raises:
            ArgumentError: naming a bad seed or option; the running episode goes on.
        """
        start = self._batch.start(options)
        if seed is not None:
            seed = as_seed(seed)
            super().reset(seed=seed)
        observations, columns = self._batch.reset([0], [seed], start)
        self._show()
        return observations[0], {**infos(columns)[0], "interaction_range": 0.0}

    def step(self, action: Any) -> tuple[NDArray[np.float32], float, bool, bool, dict[str, Any]]:
        """Hold the range that ``action`` sets for ``steps_per_action`` steps of the model.

        Raises:
            ActionError: for an action outside of the action space.
            ResetNeededError: before ``reset``, or after the end.
        """
        observation, reward, has_ended, info = self._batch.step_one(action)
        self._show()
        terminated = bool(is_over(info))
        return observation, reward, terminated, has_ended and not terminated, info

    def _observe(self) -> NDArray[np.float32]:
        observation: NDArray[np.float32] = self._batch.observe([0])[0]
        return observation
