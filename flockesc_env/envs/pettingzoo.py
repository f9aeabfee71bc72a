"""PettingZoo: every agent of the flock sets its own range."""

from __future__ import annotations

from collections.abc import Mapping
from copy import deepcopy
from itertools import compress
from typing import TYPE_CHECKING, Any, Literal

import gymnasium
import numpy as np
from numpy.typing import NDArray
from pettingzoo import AECEnv, ParallelEnv
from pettingzoo.utils import parallel_to_aec, wrappers

from flockesc_env.common.checks import FloatArray, as_choice, as_mapping, as_seed
from flockesc_env.common.errors import ActionError, EpisodeError, shown
from flockesc_env.envs._rendered import Rendered
from flockesc_env.envs._restorable import Restorable
from flockesc_env.episodes.batch import RESET_OPTIONS, Columns, FlockBatch, Step, infos, is_over
from flockesc_env.episodes.options import EnvOptions
from flockesc_env.episodes.predators import PredatorPolicy, all_learned, opposite
from flockesc_env.episodes.spaces import STACKED, Label
from flockesc_env.render import RENDER_MODES, RenderOptions, flock_viewer, frames_per_second
from flockesc_env.scenario.flock import FlockScenario
from flockesc_env.scenario.presets import as_scenario

Observation = NDArray[np.float32]

if TYPE_CHECKING:
    from flockesc_env.render.viewer import FlockViewer


class FlockParallelEnv(Rendered, Restorable[dict[str, Observation]], ParallelEnv[str, Observation, Any]):
    """A flock under attack; the action of every agent is its own interaction range.

    Observations, rewards and ``info`` are described in docs/model.md. Team rewards pay every agent the
    same. The horizon truncates all agents at once. An agent that is caught terminates: it gets the reward of
    the step that caught it and an observation of zeros, and is no agent any more.

    Learned predators that no policy steers are agents, too: ``predator_0``, .., with observations and actions
    of their own, each paid minus what the agents of the flock are paid on average.

    Args:
        scenario: the flock model's parameters, or a preset's name; default: the paper's.
        predator: ``"learned"``: all predators become ``Learned``; ``"scenario"``: they are what the scenario
            says.
        predator_policy: steers the learned predators, for example ``Pursue()`` or a trained ``SB3Policy``;
            in a scenario without any, all predators become ``Learned``. ``None``: they are agents.
        render_mode: ``"rgb_array"``: ``render`` returns a picture; ``"human"``: a window shows
            every reset and step.
        render_options: what pictures show.
        num_threads: threads over which a large flock is spread; ``None``: one per core.
        **options: see ``EnvOptions``.

    Raises:
        ArgumentError: for a bad ``num_threads`` or ``predator``.
        ScenarioError: for an option out of bounds or a scenario without predator.
        DependencyNotInstalled: for a render mode without pygame.
    """

    metadata: dict[str, Any] = {
        "name": "flockesc_v0",
        "is_parallelizable": True,
        "render_modes": list(RENDER_MODES),
        "render_fps": 20,
    }

    def __init__(
        self,
        scenario: FlockScenario | str | None = None,
        *,
        predator: Literal["scenario", "learned"] = "scenario",
        predator_policy: PredatorPolicy | None = None,
        render_mode: str | None = None,
        render_options: RenderOptions | None = None,
        num_threads: int | None = None,
        **options: Any,
    ) -> None:
        as_choice(predator, "predator", ("scenario", "learned"))
        given = as_scenario(scenario, FlockScenario)
        self._batch = FlockBatch(
            all_learned(given) if predator == "learned" else given,
            EnvOptions(**options),
            per_agent=True,
            num_threads=num_threads,
            predator_policy=predator_policy,
        )
        self.policy_spec = self._batch.policy_spec
        self.predator_policy_spec = self._batch.predator_policy_spec
        self.scenario = self._batch.scenario
        self.options = self._batch.options
        fps = frames_per_second(self.scenario.time_step * self.options.steps_per_action)
        self.metadata = {**deepcopy(self.metadata), "render_fps": fps}
        self.render_mode = render_mode
        self._viewer: FlockViewer | None = flock_viewer(self._batch, render_mode, render_options, fps)
        count = self.scenario.num_agents
        self._flock = _names("agent", count)
        are_agents = predator_policy is None
        self._predators = _names("predator", self.predator_policy_spec.count if are_agents else 0)
        self.possible_agents = self._flock + self._predators
        self.agents: list[str] = []
        self._caught = np.zeros(count, np.bool)
        self.observation_spaces = {agent: self.policy_spec.layout.space() for agent in self._flock}
        self.action_spaces = {agent: self.policy_spec.actions.space() for agent in self._flock}
        for hunter in self._predators:
            self.observation_spaces[hunter] = self.predator_policy_spec.layout.space()
            self.action_spaces[hunter] = self.predator_policy_spec.space()
        size = 2 * self.scenario.dimension * (count + len(self.scenario.predators)) + 3
        self.state_space = gymnasium.spaces.Box(-np.inf, np.inf, (size,), np.float32)

    def observation_space(self, agent: str) -> gymnasium.Space[Any]:
        """Return the agent's observation space, the same object at every call."""
        return self.observation_spaces[agent]

    def action_space(self, agent: str) -> gymnasium.Space[Any]:
        """Return the agent's action space, the same object at every call."""
        return self.action_spaces[agent]

    def reset(
        self, seed: int | None = None, options: dict[str, Any] | None = None
    ) -> tuple[dict[str, Observation], dict[str, dict[str, Any]]]:
        """Start an episode.

        Args:
            seed: seed of the flock, the same as in ``simulate(seed=seed)``; ``None``: the next one.
            options: any of ``initial_positions``, ``initial_velocities``, shape (n, D), and
                ``predator_positions``, ``predator_velocities``, shape (P, D), in m and m/s; and ``episode``,
                the number of the episode to start in the schedule of the seed, given now or before
                (``episode_seed``); default: 0 with a seed, else the next one. Others are ignored, as
                PettingZoo asks.

        Raises:
            ArgumentError: naming a bad seed or option; the running episode goes on.
        """
        rows, columns = self._reset(seed, options)
        observations = self._by_name(self._flock, rows, self._seen())
        return observations, self._infos(self._flock, columns, np.zeros(len(rows)))

    def reset_array(
        self, seed: int | None = None, options: dict[str, Any] | None = None
    ) -> tuple[Observation, dict[str, Any]]:
        """Start an episode, as ``reset``, without dicts per agent.

        Returns:
            Observations (n, entries), and an ``info`` whose ``interaction_range`` has shape (n,). Where
            predators are agents it has their ``predator_observations`` (predators, entries), too.
        """
        rows, columns = self._reset(seed, options)
        return rows, self._info(columns, np.zeros(len(rows)))

    def step(
        self, actions: dict[str, Any]
    ) -> tuple[
        dict[str, Observation], dict[str, float], dict[str, bool], dict[str, bool], dict[str, dict[str, Any]]
    ]:
        """Hold every agent's range for ``steps_per_action`` steps of the model.

        Raises:
            ActionError: naming an agent that is unknown, missing or whose action is outside of its space.
            EpisodeError: before ``reset``, or after the end.
        """
        self._check_running()
        if not isinstance(actions, Mapping):
            raise ActionError("actions", "a dict with an action per agent", shown(actions))
        agents, acting = self.agents[: len(self.agents) - len(self._predators)], ~self._caught
        controls = None
        if self._predators:
            controls = self.predator_policy_spec.plain_of(self._predators, actions)
            actions = {agent: action for agent, action in actions.items() if agent not in self._predators}
        stacked = self.policy_spec.actions.core.stack(actions, agents)
        if stacked is None:
            stacked = self._stack(actions, agents)
        if len(agents) < len(acting):
            stacked = _spread(stacked, acting)
        rows, rewards, ended, ranges, columns = self._step(stacked, self._label, controls)
        paid = opposite(rewards, is_own=self.options.is_own) if self._predators else 0.0
        if len(agents) < len(acting):
            rows, rewards, ranges = rows[acting], rewards[acting], ranges[acting]
        caught = self._caught[acting]
        count, has_ended = len(self._predators), bool(ended[0])
        payments = self._by_name(agents, rewards.tolist(), [paid] * count)
        terminations = dict.fromkeys(payments, False)
        truncations = dict.fromkeys(payments, has_ended)
        if caught.any():
            terminated = bool(is_over(columns)[0])
            left = has_ended and not terminated
            terminations = self._by_name(agents, caught.tolist(), [terminated] * count)
            truncations = self._by_name(agents, (has_ended & ~caught).tolist(), [left] * count)
        observations = self._by_name(agents, rows, self._seen())
        return observations, payments, terminations, truncations, self._infos(agents, columns, ranges)

    def step_array(
        self, actions: Any, predator_actions: Any = None
    ) -> tuple[Observation, NDArray[np.float64], NDArray[np.bool], NDArray[np.bool], dict[str, Any]]:
        """Do as ``step``, without dicts per agent; entries and rows are in the order of ``possible_agents``.

        Predators are not among them; what they see is in ``info`` as in ``reset_array``, and they are paid
        minus the mean of the rewards.

        Args:
            actions: shape (n, 1) or, where discrete, (n,); those of agents that were caught are ignored.
            predator_actions: where predators are agents: shape (predators, D).

        Returns:
            New arrays: observations (n, entries), rewards (n,), terminations (n,), truncations (n,); and an
            ``info`` of plain numbers, save for ``interaction_range`` of shape (n,). An agent that was caught
            keeps its row: zeros, with a termination of True.

        Raises:
            ActionError: for a wrong dtype or shape, or an action outside of the action space.
            EpisodeError: before ``reset``, or after the end.
        """
        self._check_running()
        controls = None
        if self._predators or predator_actions is not None:
            controls = self.predator_policy_spec.plain(predator_actions, len(self._predators))
        rows, rewards, ended, ranges, columns = self._step(actions, STACKED, controls)
        terminations, truncations = self._caught.copy(), np.full(len(self._caught), ended[0])
        if self.scenario.capture_radius is not None:
            truncations &= ~terminations
        return rows, rewards, terminations, truncations, self._info(columns, ranges)

    def state(self) -> NDArray[np.float32]:
        """Return time, running minima, positions and velocities of agents, then of predators, flat."""
        state = self._batch.state(0)
        metrics = self._batch.metrics()
        scalars = [state["step"], metrics["min_mean_distance"][0], metrics["min_min_distance"][0]]
        names = ("positions", "velocities", "predator_positions", "predator_velocities")
        return np.concatenate([scalars, *(state[name].ravel() for name in names)], dtype=np.float32)

    def _seen_now(self) -> dict[str, Observation]:
        self._name_agents(has_ended=self._batch.has_ended(0))
        rows = self._batch.observe([0])
        flock = self.agents[: len(self.agents) - len(self._predators)]
        return self._by_name(flock, rows[~self._caught], self._seen()) if self.agents else {}

    def _reset(self, seed: int | None, options: dict[str, Any] | None) -> tuple[Observation, Columns]:
        known = {name: value for name, value in as_mapping(options).items() if name in RESET_OPTIONS}
        start = self._batch.start(known)
        started = self._batch.reset([0], [None if seed is None else as_seed(seed)], start)
        self.agents = self.possible_agents.copy()
        self._caught = np.zeros(len(self._flock), np.bool)
        if self._viewer is not None:
            self._viewer.update()
        return started

    def _check_running(self) -> None:
        if not self.agents:
            raise EpisodeError("step", "a reset first", "no agents")

    def _step(self, actions: Any, label: Label, controls: FloatArray | None) -> Step:
        step = self._batch.step(actions, label=label, controls=controls)
        if step[2][0] or self.scenario.capture_radius is not None:
            self._name_agents(has_ended=bool(step[2][0]))
        if self._viewer is not None:
            self._viewer.update()
        return step

    def _name_agents(self, *, has_ended: bool) -> None:
        """Find out who was caught and who acts next."""
        self._caught = self._batch.caught()[0]
        self.agents = [] if has_ended else [*compress(self._flock, ~self._caught), *self._predators]

    def _stack(self, actions: dict[str, Any], agents: list[str]) -> NDArray[Any]:
        """Stack actions of any form, or say what is wrong with them."""
        for agent in actions:
            if agent not in self.action_spaces:
                raise ActionError(f"action of {agent!r}", "an agent of this flock", "an unknown agent")
            if agent not in agents:
                raise ActionError(f"action of {agent!r}", "none", "one of an agent that was caught")
        for agent in agents:
            if agent not in actions:
                raise ActionError(f"action of {agent!r}", "an action", "none")
        one = self.policy_spec.actions.one
        return np.stack([one(actions[agent], f"action of {agent!r}") for agent in agents])

    def _seen(self) -> Observation:
        """Return what the predators see, a row for each that is an agent."""
        return self._batch.observe_predators([0]) if self._predators else np.zeros((0, 0), np.float32)

    def _by_name(self, agents: list[str], flock: Any, predators: Any) -> dict[str, Any]:
        named = dict(zip(agents, flock, strict=True))
        if self._predators:
            named.update(zip(self._predators, predators, strict=True))
        return named

    def _infos(
        self, agents: list[str], columns: Columns, ranges: NDArray[np.float64]
    ) -> dict[str, dict[str, Any]]:
        shared = {**infos(columns)[0], "interaction_range": 0.0}
        own = [shared.copy() for _ in agents]  # cheaper than displays with one more key
        for info, rho in zip(own, ranges.tolist(), strict=True):
            info["interaction_range"] = rho
        return self._by_name(agents, own, [infos(columns)[0] for _ in self._predators])

    def _info(self, columns: Columns, ranges: NDArray[np.float64]) -> dict[str, Any]:
        info = {**infos(columns)[0], "interaction_range": ranges}
        if self._predators:
            info["predator_observations"] = self._seen()
        return info

    def _label(self, place: int) -> str:
        return f"action of {self._flock[place]!r}"


def _spread(stacked: NDArray[Any], acting: NDArray[np.bool]) -> NDArray[Any]:
    """Return actions with a row for every agent, of which those that do not act mean nothing."""
    full = np.zeros((len(acting), *stacked.shape[1:]), stacked.dtype)
    full[acting] = stacked
    return full


def _names(kind: str, count: int) -> list[str]:
    return [f"{kind}_{i:0{len(str(count - 1))}d}" for i in range(count)]


def parallel_env(scenario: FlockScenario | str | None = None, **options: Any) -> FlockParallelEnv:
    """Return the PettingZoo parallel environment; see ``FlockParallelEnv``."""
    return FlockParallelEnv(scenario, **options)


def raw_env(scenario: FlockScenario | str | None = None, **options: Any) -> AECEnv[str, Observation, Any]:
    """Return the PettingZoo AEC environment without the usual wrappers; see ``FlockParallelEnv``."""
    return parallel_to_aec(FlockParallelEnv(scenario, **options))


def env(scenario: FlockScenario | str | None = None, **options: Any) -> AECEnv[str, Observation, Any]:
    """Return the PettingZoo AEC environment with the usual wrappers; see ``FlockParallelEnv``."""
    return wrappers.OrderEnforcingWrapper(raw_env(scenario, **options))
