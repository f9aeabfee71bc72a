"""Gymnasium: one action sets the range of the whole flock."""

from __future__ import annotations

from copy import deepcopy
from typing import TYPE_CHECKING, Any

import gymnasium
import numpy as np
from numpy.typing import NDArray

from flockesc_env.common.checks import as_seed
from flockesc_env.envs._rendered import Rendered
from flockesc_env.envs._restorable import Restorable
from flockesc_env.episodes.batch import FlockBatch, infos, is_over
from flockesc_env.episodes.options import EnvOptions
from flockesc_env.episodes.predators import PredatorPolicy
from flockesc_env.render import RENDER_MODES, RenderOptions, flock_viewer, frames_per_second
from flockesc_env.scenario.flock import FlockScenario
from flockesc_env.scenario.presets import as_scenario

if TYPE_CHECKING:
    from flockesc_env.render.viewer import FlockViewer


class FlockEscapeEnv(Rendered, Restorable[NDArray[np.float32]], gymnasium.Env[NDArray[np.float32], Any]):
    """A flock under attack, ``flockesc/FlockEscape-v0``; the action is its interaction range.

    Observations, rewards and ``info`` are described in docs/model.md. The horizon truncates; a flock of which
    nobody is left terminates.

    Args:
        scenario: the flock model's parameters, or a preset's name; default: the paper's.
        render_mode: ``"rgb_array"``: ``render`` returns a picture; ``"human"``: a window shows
            every reset and step.
        render_options: what pictures show.
        num_threads: threads over which a large flock is spread; ``None``: one per core.
        predator_policy: steers the learned predators, for example ``Pursue()`` or a trained ``SB3Policy``;
            in a scenario without any, all predators become ``Learned``. ``None``: those fly straight on.
        **options: see ``EnvOptions``.

    Raises:
        ArgumentError: for a bad ``num_threads``.
        ScenarioError: for an option out of bounds or a scenario without predator.
        DependencyNotInstalled: for a render mode without pygame.
    """

    metadata: dict[str, Any] = {"render_modes": list(RENDER_MODES), "render_fps": 20}

    def __init__(
        self,
        scenario: FlockScenario | str | None = None,
        *,
        render_mode: str | None = None,
        render_options: RenderOptions | None = None,
        num_threads: int | None = None,
        predator_policy: PredatorPolicy | None = None,
        **options: Any,
    ) -> None:
        self._batch = FlockBatch(
            as_scenario(scenario, FlockScenario),
            EnvOptions(**options),
            num_threads=num_threads,
            predator_policy=predator_policy,
        )
        self.policy_spec = self._batch.policy_spec
        self.scenario = self._batch.scenario
        self.options = self._batch.options
        self.observation_space = self.policy_spec.layout.space()
        self.action_space = self.policy_spec.actions.space()
        fps = frames_per_second(self.scenario.time_step * self.options.steps_per_action)
        self.metadata = {**deepcopy(self.metadata), "render_fps": fps}
        self.render_mode = render_mode
        self._viewer: FlockViewer | None = flock_viewer(self._batch, render_mode, render_options, fps)

    def reset(
        self, *, seed: int | None = None, options: dict[str, Any] | None = None
    ) -> tuple[NDArray[np.float32], dict[str, Any]]:
        """Start an episode.

        Args:
            seed: seed of the flock, the same as in ``simulate(seed=seed)``; ``None``: the next one.
            options: any of ``initial_positions``, ``initial_velocities``, shape (n, D), and
                ``predator_positions``, ``predator_velocities``, shape (P, D), in m and m/s; and ``episode``,
                the number of the episode to start in the schedule of the seed, given now or before
                (``episode_seed``); default: 0 with a seed, else the next one.

        Raises:
            ArgumentError: naming a bad seed or option; the running episode goes on.
        """
        start = self._batch.start(options)
        if seed is not None:
            seed = as_seed(seed)
            super().reset(seed=seed)
        observations, columns = self._batch.reset([0], [seed], start)
        if self._viewer is not None:
            self._viewer.update()
        return observations[0], {**infos(columns)[0], "interaction_range": 0.0}

    def step(self, action: Any) -> tuple[NDArray[np.float32], float, bool, bool, dict[str, Any]]:
        """Hold the range that ``action`` sets for ``steps_per_action`` steps of the model.

        Raises:
            ActionError: for an action outside of the action space.
            EpisodeError: before ``reset``, or after the end.
        """
        observation, reward, has_ended, info = self._batch.step_one(action)
        if self._viewer is not None:
            self._viewer.update()
        terminated = bool(is_over(info))
        return observation, reward, terminated, has_ended and not terminated, info

    def _seen_now(self) -> NDArray[np.float32]:
        observation: NDArray[np.float32] = self._batch.observe([0])[0]
        return observation
