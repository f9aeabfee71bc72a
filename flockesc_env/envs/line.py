"""Gymnasium environment of the line: one action sets the interaction range of all agents."""

from collections.abc import Mapping
from typing import Any, Unpack

import gymnasium
import numpy as np
from numpy.typing import NDArray

from flockesc_env import _core
from flockesc_env.common.checks import as_bytes, as_floats, as_options, as_seed
from flockesc_env.common.errors import ResetNeededError
from flockesc_env.envs._base import LineArguments, Registered, named_arguments, read_only, survives_interrupts
from flockesc_env.episodes.current_state import LineView
from flockesc_env.episodes.spaces import policy_spec
from flockesc_env.episodes.starts import episode_seed, fresh_seed
from flockesc_env.render.frames import LineFrame
from flockesc_env.scenario.line import LineScenario
from flockesc_env.scenario.options import LineOptions
from flockesc_env.scenario.presets import as_scenario

RESET_OPTIONS = ("initial_state", "episode")
FRAMES_PER_SECOND = 5


class LineEscapeEnv(Registered, gymnasium.Env[NDArray[np.float32], Any]):
    """A line under attack, ``flockesc/LineEscape-v1``; the action is its interaction range.

    An episode terminates when the line reaches its steady state and is truncated after
    ``scenario.max_steps`` model steps. The return is d_ss - d(0).

    Args:
        scenario: the line model's parameters, with a predator, or a preset's name; default: the paper's.
        **arguments: see ``LineArguments`` and ``LineOptions``.
    """

    _arguments = LineArguments
    scenario: LineScenario = read_only("scenario", "_scenario")
    options: LineOptions = read_only("options", "_options")
    metadata: dict[str, Any] = {**Registered.metadata, "render_fps": FRAMES_PER_SECOND}

    def __init__(
        self, scenario: LineScenario | str | None = None, **arguments: Unpack[LineArguments]
    ) -> None:
        self._scenario = as_scenario(scenario, LineScenario)
        own = named_arguments(type(self).__init__)
        self._options = self._scenario.env_options(arguments, LineArguments, own)
        self._document = self._options.to_core()
        _core.LineEpisode(self._scenario.to_json(), self._document, 0)  # raises if there is no predator
        self._episode: _core.LineEpisode | None = None
        self._schedule = fresh_seed(), 0  # the seed of episode 0, and the index of the next episode
        self.policy_spec = policy_spec(self._scenario, self._options)
        self.observation_space = self.policy_spec.layout.space()
        self.action_space = self.policy_spec.actions.space()
        self._prepare_rendering(arguments, FRAMES_PER_SECOND)

    @property
    def line(self) -> LineView:
        """Read-only access to the state of the line."""
        return LineView(self._episode)

    @survives_interrupts
    def reset(
        self, *, seed: int | None = None, options: Mapping[str, Any] | None = None
    ) -> tuple[NDArray[np.float32], dict[str, Any]]:
        """Start an episode as ``FlockEscapeEnv.reset``; ``simulate_line(seed=seed)`` runs the same line.

        ``options`` are any of ``initial_state``, x(0) of shape (n,), and ``episode``.
        """
        options = as_options(options, RESET_OPTIONS)
        states, episode = (options.get(name) for name in RESET_OPTIONS)
        if states is not None:
            states = as_floats(states, "initial_state", (self.scenario.num_agents,))
        seed = None if seed is None else as_seed(seed)
        episode = None if episode is None else as_seed(episode, "options['episode']")
        first, following = self._schedule if seed is None else (seed, 0)
        following = following if episode is None else episode
        drawn = episode_seed(first, following)
        self._episode = _core.LineEpisode(self.scenario.to_json(), self._document, drawn, states)
        self._schedule = first, (following + 1) % 2**64
        if seed is not None:
            super().reset(seed=seed)
        self._show(self._episode)
        return self._episode.observe(), self._episode.info()

    @survives_interrupts
    def step(self, action: Any) -> tuple[NDArray[np.float32], float, bool, bool, dict[str, Any]]:
        """Set the interaction range and run ``steps_per_action`` model steps; see ``FlockEscapeEnv.step``."""
        if self._episode is None:
            raise ResetNeededError("step() called before reset()")
        episode = self._episode
        step = episode.step(self.policy_spec.actions.to_range(action))
        self._show(episode)
        return step

    def get_state(self) -> bytes:
        """Return a snapshot; see ``FlockEscapeEnv.get_state``."""
        if self._episode is None:
            raise ResetNeededError("get_state() called before reset()")
        return self._episode.get_state(*self._schedule)

    @survives_interrupts
    def set_state(self, state: bytes) -> NDArray[np.float32]:
        """Restore a snapshot and return the observation; see ``FlockEscapeEnv.set_state``."""
        episode = _core.LineEpisode(self.scenario.to_json(), self._document, 0)
        self._schedule = episode.set_state(as_bytes(state, "state"))
        self._episode = episode
        self._settle()
        return episode.observe()

    def _num_actions(self) -> int:
        return self.policy_spec.num_actions

    def _settle(self) -> None:
        if self._episode is not None and self._viewer is not None:
            self._viewer.frames = [None]
            self._show(self._episode)

    def _drop_episodes(self) -> None:
        self._episode = None

    def _show(self, episode: _core.LineEpisode) -> None:
        if self._viewer is not None:
            (last,) = self._viewer.frames
            before = last.history if last is not None and episode.get("steps") else []
            present = (episode.get("steps"), episode.get("states"), episode.get("interaction_range"))
            self._viewer.update([LineFrame(self.scenario, [*before, present], self.options.max_range)])
