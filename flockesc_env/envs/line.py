"""Gymnasium: one action sets the range of the whole line."""

from __future__ import annotations

from collections.abc import Mapping
from copy import deepcopy
from typing import TYPE_CHECKING, Any

import gymnasium
import numpy as np
from numpy.typing import NDArray

from flockesc_env import _core
from flockesc_env.common.checks import as_bytes, as_floats, as_options, as_seed
from flockesc_env.common.errors import EpisodeError
from flockesc_env.envs._rendered import Rendered
from flockesc_env.episodes.options import LineOptions
from flockesc_env.episodes.seeds import Schedule, fresh_seed
from flockesc_env.policies.rollout_line import line_policy_spec
from flockesc_env.render import RENDER_MODES, RenderOptions, line_viewer
from flockesc_env.scenario.line import LineScenario
from flockesc_env.scenario.presets import as_scenario

if TYPE_CHECKING:
    from flockesc_env.render.viewer import LineViewer

RESET_OPTIONS = ("initial_state", "episode")


class LineEscapeEnv(Rendered, gymnasium.Env[NDArray[np.float32], Any]):
    """A line under attack, ``flockesc/LineEscape-v0``; the action is its interaction range.

    The episode terminates when the line stands still (its steady state) and is truncated after
    ``scenario.max_steps`` steps. The return is d_ss - d(0).

    Args:
        scenario: the line model's parameters, or a preset's name; default: the paper's.
        render_mode: ``"rgb_array"``: ``render`` returns a picture; ``"human"``: a window shows
            every reset and step.
        render_options: what pictures show.
        **options: see ``LineOptions``.

    Raises:
        ScenarioError: for an option out of bounds or a scenario without predator.
        DependencyNotInstalled: for a render mode without pygame.
    """

    metadata: dict[str, Any] = {"render_modes": list(RENDER_MODES), "render_fps": 5}

    def __init__(
        self,
        scenario: LineScenario | str | None = None,
        *,
        render_mode: str | None = None,
        render_options: RenderOptions | None = None,
        **options: Any,
    ) -> None:
        self.scenario = as_scenario(scenario, LineScenario)
        self.options = LineOptions(**options)
        self._document = self.options.to_core()
        _core.LineEpisode(self.scenario.to_json(), self._document, 0)  # refuses what cannot be played
        self._episode: _core.LineEpisode | None = None
        self._schedule = Schedule(fresh_seed())
        self.policy_spec = line_policy_spec(self.scenario, self.options)
        self.observation_space = self.policy_spec.layout.space()
        self.action_space = self.policy_spec.actions.space()
        self.metadata = deepcopy(self.metadata)
        self.render_mode = render_mode
        self._viewer: LineViewer | None = line_viewer(
            self.scenario, render_mode, render_options, self.metadata["render_fps"]
        )

    def reset(
        self, *, seed: int | None = None, options: Mapping[str, Any] | None = None
    ) -> tuple[NDArray[np.float32], dict[str, Any]]:
        """Start an episode.

        Args:
            seed: seed of x(0), the same as in ``simulate_line(seed=seed)``; ``None``: the next one.
            options: ``initial_state``, shape (n,); ``episode``, the number of an episode of the schedule.

        Raises:
            ArgumentError: naming a bad seed or option; the running episode goes on.
        """
        options = as_options(options, RESET_OPTIONS)
        states, episode = (options.get(name) for name in RESET_OPTIONS)
        if states is not None:
            states = as_floats(states, "initial_state", (self.scenario.num_agents,))
        seed = None if seed is None else as_seed(seed)
        episode = None if episode is None else as_seed(episode, "options['episode']")
        schedule = self._schedule.at(seed, episode)
        self._episode = _core.LineEpisode(
            self.scenario.to_json(), self._document, schedule.episode_seed(), states
        )
        self._schedule = schedule.after()
        if seed is not None:
            super().reset(seed=seed)
        self._show(self._episode)
        return self._episode.observe(), self._episode.info()

    def step(self, action: Any) -> tuple[NDArray[np.float32], float, bool, bool, dict[str, Any]]:
        """Hold the range that ``action`` sets for ``steps_per_action`` steps of the model.

        Raises:
            ActionError: for an action outside of the action space.
            EpisodeError: before ``reset``, or after the end.
        """
        if self._episode is None:
            raise EpisodeError("step", "a reset before anything else", "no episode")
        episode = self._episode
        step = episode.step_one(self.policy_spec.actions.to_range(action))
        self._show(episode)
        return step

    def get_state(self) -> bytes:
        """Return everything that the future depends on as bytes; see ``FlockEscapeEnv.get_state``.

        Raises:
            EpisodeError: before ``reset``.
        """
        if self._episode is None:
            raise EpisodeError("get_state", "a reset before anything else", "no episode")
        return self._episode.get_state(*self._schedule)

    def set_state(self, state: bytes) -> NDArray[np.float32]:
        """Go on from where an environment was when it returned ``state``; return the observation there.

        Args:
            state: what ``get_state`` returned, here or elsewhere.

        Raises:
            ArgumentError: for bytes that are damaged, of another version, or of another scenario or other
                options; the running episode goes on.
        """
        episode = _core.LineEpisode(self.scenario.to_json(), self._document, 0)
        self._schedule = Schedule(*episode.set_state(as_bytes(state, "state")))
        self._episode = episode
        if self._viewer is not None:
            self._viewer.forget()
        self._show(episode)
        return episode.observe()

    def _show(self, episode: _core.LineEpisode) -> None:
        if self._viewer is not None:
            self._viewer.update(episode.steps, episode.states, episode.interaction_range)
