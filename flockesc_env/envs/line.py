"""Gymnasium: one action sets the range of the whole line."""

from __future__ import annotations

from collections.abc import Mapping
from typing import TYPE_CHECKING, Any, Unpack, cast

import gymnasium
import numpy as np
from numpy.typing import NDArray

from flockesc_env import _core
from flockesc_env.common.checks import as_bytes, as_floats, as_options, as_seed
from flockesc_env.common.errors import ResetNeededError
from flockesc_env.envs._base import LineArguments, Rendered
from flockesc_env.episodes.options import LineOptionsDict, check_names, line_options
from flockesc_env.episodes.seeds import Schedule, fresh_seed
from flockesc_env.episodes.views import LineView
from flockesc_env.policies.rollout_line import line_policy_spec
from flockesc_env.render import line_viewer
from flockesc_env.scenario.line import LineScenario
from flockesc_env.scenario.presets import as_scenario

if TYPE_CHECKING:
    from flockesc_env.render.viewer import LineViewer

RESET_OPTIONS = ("initial_state", "episode")
FRAMES_PER_SECOND = 5


class LineEscapeEnv(Rendered, gymnasium.Env[NDArray[np.float32], Any]):
    """A line under attack, ``flockesc/LineEscape-v0``; the action is its interaction range.

    The episode terminates when the line stands still (its steady state). ``scenario.max_steps`` truncates it.
    The return is d_ss - d(0).

    Args:
        scenario: the line model's parameters, or a preset's name; default: the paper's.
        **arguments: see ``LineArguments`` and ``LineOptions``.

    Raises:
        OptionError: for an option that is unknown or out of bounds.
        ScenarioError: for a scenario without predator.
        DependencyNotInstalled: for a render mode without pygame.
    """

    metadata: dict[str, Any] = {**Rendered.metadata, "render_fps": FRAMES_PER_SECOND}
    _viewer: LineViewer | None = None

    def __init__(
        self, scenario: LineScenario | str | None = None, **arguments: Unpack[LineArguments]
    ) -> None:
        self.scenario = as_scenario(scenario, LineScenario)
        check_names(arguments, LineArguments.__annotations__, LineScenario)
        options = {
            name: value for name, value in arguments.items() if name in LineOptionsDict.__annotations__
        }
        self.options = line_options(cast("LineOptionsDict", options))
        self._document = self.options.to_core()
        _core.LineEpisode(self.scenario.to_json(), self._document, 0)  # raises if there is no predator
        self._episode: _core.LineEpisode | None = None
        self._schedule = Schedule(fresh_seed())
        self.policy_spec = line_policy_spec(self.scenario, self.options)
        self.observation_space = self.policy_spec.layout.space()
        self.action_space = self.policy_spec.actions.space()
        self.render_mode = arguments.get("render_mode")
        self._viewer = line_viewer(
            self.scenario, self.render_mode, arguments.get("render_options"), FRAMES_PER_SECOND
        )
        self._set_frames_per_second(FRAMES_PER_SECOND)

    @property
    def line(self) -> LineView:
        """Read-only access to the state of the line.

        Raises:
            ResetNeededError: before ``reset``.
        """
        return LineView(self._episode)

    def reset(
        self, *, seed: int | None = None, options: Mapping[str, Any] | None = None
    ) -> tuple[NDArray[np.float32], dict[str, Any]]:
        """Start an episode.

        Args:
            seed: seed of x(0), the same as in ``simulate_line(seed=seed)``; ``None``: the next one.
            options: ``initial_state``, shape (n,); ``episode``, the number of the episode in the schedule.

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
            ResetNeededError: before ``reset``, or after the end.
        """
        if self._episode is None:
            raise ResetNeededError("step() called before reset()")
        episode = self._episode
        step = episode.step_one(self.policy_spec.actions.to_range(action))
        self._show(episode)
        return step

    def get_state(self) -> bytes:
        """Return a snapshot as bytes; see ``FlockEscapeEnv.get_state``.

        Raises:
            ResetNeededError: before ``reset``.
        """
        if self._episode is None:
            raise ResetNeededError("get_state() called before reset()")
        return self._episode.get_state(*self._schedule)

    def set_state(self, state: bytes) -> NDArray[np.float32]:
        """Restore a snapshot and return the observation at that moment.

        Args:
            state: what ``get_state`` returned, here or in another environment.

        Raises:
            ArgumentError: for a snapshot that is damaged or belongs to another version, scenario or other
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
