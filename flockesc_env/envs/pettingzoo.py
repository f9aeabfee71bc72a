"""PettingZoo environments of a flock: an agent per range, and one per learned predator."""

import warnings
from collections.abc import Mapping
from itertools import compress
from typing import Any, ClassVar, Literal, Unpack, get_args

import gymnasium
import numpy as np
from numpy.typing import NDArray
from pettingzoo import AECEnv, ParallelEnv
from pettingzoo.utils.conversions import parallel_to_aec_wrapper
from pettingzoo.utils.wrappers import OrderEnforcingWrapper

from flockesc_env.common.checks import FloatArray, as_choice, as_flag, as_mapping, as_seed
from flockesc_env.common.errors import InputError, ResetNeededError, shown
from flockesc_env.envs._base import FlockArguments, Infos, OneFlock, agent_names, survives_interrupts
from flockesc_env.episodes.batch import Step, info_dicts, is_over, with_ranges
from flockesc_env.episodes.spaces import check_agents, policy_spec
from flockesc_env.episodes.starts import RESET_OPTIONS
from flockesc_env.scenario.flock import FlockScenario
from flockesc_env.scenario.options import EnvOptions

Observation = NDArray[np.float32]
StateKind = Literal["full", "flock_view"]

_LARGEST = float(np.finfo(np.float32).max)


class ParallelArguments(FlockArguments, total=False):
    """Keyword arguments of the PettingZoo environments: ``FlockArguments`` and the following.

    Attributes:
        per_agent: True: every agent of the flock is an agent (``agent_0``, ..). False: the only agent is
            ``flock``, whose action is the range of all, as in ``FlockEscapeEnv``.
        infos: which ``info`` dicts of ``step`` have entries. ``"all"``: all. ``"end"``: those of agents whose
            episode has ended in this step; the others share one new empty dict, which is faster.
        state: what the method ``state`` returns. ``"full"``: positions and velocities. ``"flock_view"``: the
            observation of ``FlockEscapeEnv`` without optional entries; its ``last_range`` is a mean.
    """

    per_agent: bool
    infos: Infos
    state: StateKind


class FlockParallelEnv(OneFlock[dict[str, Observation]], ParallelEnv[str, Observation, Any]):
    """A flock under attack; the action of every agent is its own interaction range.

    docs/model.md describes observations, rewards and ``info``. With a team reward all agents get the same
    reward. All agents are truncated after ``scenario.num_steps`` model steps. An agent that is caught
    terminates: it receives the reward of that step and an observation of zeros, and is removed from
    ``agents``. With ``per_agent=False`` the agent ``flock`` terminates when all are caught; its episodes are
    those of ``FlockEscapeEnv``, bit for bit.

    Without a ``predator_policy``, ``Learned`` predators are also agents (``predator_0``, ..), with their own
    observation and action spaces. The reward of each is minus the mean reward of the flock's agents.

    Args:
        scenario: the flock model's parameters, or a preset's name; default: the paper's.
        **arguments: see ``ParallelArguments`` and ``EnvOptions``.
    """

    _arguments: ClassVar[type] = ParallelArguments
    metadata: dict[str, Any] = {**OneFlock.metadata, "name": "flockesc_v1", "is_parallelizable": True}

    def __init__(
        self, scenario: FlockScenario | str | None = None, **arguments: Unpack[ParallelArguments]
    ) -> None:
        view = as_flag(arguments.get("per_agent", True), "per_agent")
        super().__init__(scenario, arguments, per_agent=view)
        self.predator_policy_spec = self._batch.predator_policy_spec
        count = self.scenario.num_agents
        self._flock = agent_names("agent", count) if self.policy_spec.per_agent else ["flock"]
        are_agents = arguments.get("predator_policy") is None
        num_predators = self.predator_policy_spec.count if are_agents else 0
        self._predators = agent_names("predator", num_predators)
        self.possible_agents = self._flock + self._predators
        self.agents: list[str] = []
        self._caught = np.zeros(len(self._flock), np.bool)
        # False for every name in `agents`. Copying this dict takes a tenth of the time of building one.
        self._false: dict[str, bool] = {}
        self.observation_spaces = {agent: self.policy_spec.layout.space() for agent in self._flock}
        self.action_spaces = {agent: self.policy_spec.actions.space() for agent in self._flock}
        for predator in self._predators:
            self.observation_spaces[predator] = self.predator_policy_spec.layout.space()
            self.action_spaces[predator] = self.predator_policy_spec.space()
        size = 2 * self.scenario.dimension * (count + len(self.scenario.predators)) + 3
        self.state_space: gymnasium.Space[Any] = gymnasium.spaces.Box(-np.inf, np.inf, (size,), np.float32)
        self._infos: Infos = as_choice(arguments.get("infos", "all"), "infos", get_args(Infos))
        self._state: StateKind = as_choice(arguments.get("state", "full"), "state", get_args(StateKind))
        if self._state == "flock_view":
            self.state_space = policy_spec(self.scenario, EnvOptions()).layout.space()

    def observation_space(self, agent: str) -> gymnasium.Space[Any]:
        """Return the agent's observation space, the same object at every call."""
        return self.observation_spaces[agent]

    def action_space(self, agent: str) -> gymnasium.Space[Any]:
        """Return the agent's action space, the same object at every call."""
        return self.action_spaces[agent]

    @survives_interrupts
    def reset(
        self, seed: int | None = None, options: dict[str, Any] | None = None
    ) -> tuple[dict[str, Observation], dict[str, dict[str, Any]]]:
        """Start an episode; see ``FlockEscapeEnv.reset``.

        Unknown options are ignored with a warning, which is PettingZoo's convention.
        """
        rows, info = self._reset(seed, options)
        observations = self._by_name(self._flock, rows, self._predator_observations())
        return observations, self._named_infos(self._flock, info, np.zeros(len(rows)))

    @survives_interrupts
    def reset_array(
        self, seed: int | None = None, options: dict[str, Any] | None = None
    ) -> tuple[Observation, dict[str, Any]]:
        """Start an episode as ``reset`` and return arrays instead of dicts.

        Returns:
            Observations, shape (n, entries), and an ``info`` whose ``interaction_range`` has shape (n,). If
            predators are agents, ``info`` also contains ``predator_observations``, shape (predators,
            entries).
        """
        rows, info = self._reset(seed, options)
        return rows, self._with_arrays(info, np.zeros(len(rows)))

    @survives_interrupts
    def step(
        self, actions: dict[str, Any]
    ) -> tuple[
        dict[str, Observation], dict[str, float], dict[str, bool], dict[str, bool], dict[str, dict[str, Any]]
    ]:
        """Set the interaction range of every agent and run ``steps_per_action`` model steps.

        Args:
            actions: the action of every agent in ``agents``.
        """
        self._check_running()
        if not isinstance(actions, Mapping):
            raise InputError("actions", "a dict with an action per agent", shown(actions))
        if list(actions) != self.agents:
            check_agents(actions, self.agents)
            actions = {agent: actions[agent] for agent in self.agents}
        names, acting, given, count = self.agents, ~self._caught, [*actions.values()], len(self._predators)
        agents, false = names[: len(names) - count], self._false
        predator_actions = None
        if self._predators:
            spec, hunters = self.predator_policy_spec, zip(self._predators, given[-count:], strict=True)
            plain = [spec.plain(action, None, f"action of {name!r}") for name, action in hunters]
            predator_actions = np.concatenate(plain)
        ranges = np.zeros(len(acting))
        ranges[acting] = chosen = self.policy_spec.actions.to_ranges_by_name(given[: len(agents)], agents)
        step = self._batch.step(ranges, predator_actions=predator_actions, are_ranges=True)
        rows, rewards, has_ended, info = self._stepped(step)
        if len(agents) < len(acting):
            rows, rewards = rows[acting], rewards[acting]
        all_rewards = self._by_name(agents, rewards.tolist(), [self.predator_reward] * count)
        terminations = false.copy()
        truncations = dict.fromkeys(names, True) if has_ended else false.copy()
        if self._infos == "all" or has_ended:
            infos = self._named_infos(agents, info, chosen)
        else:
            shared: dict[str, Any] = {}
            infos = dict.fromkeys(names, shared)
        if self.scenario.capture_radius is not None and (caught := self._caught[acting]).any():
            terminated = is_over(info)
            left = has_ended and not terminated
            terminations = self._by_name(agents, caught.tolist(), [terminated] * count)
            truncations = self._by_name(agents, (has_ended & ~caught).tolist(), [left] * count)
            infos |= zip(compress(agents, caught), with_ranges(info, chosen[caught]), strict=True)
        observations = self._by_name(agents, rows, self._predator_observations())
        return observations, all_rewards, terminations, truncations, infos

    @survives_interrupts
    def step_array(
        self, actions: Any, predator_actions: Any = None
    ) -> tuple[Observation, NDArray[np.float64], NDArray[np.bool], NDArray[np.bool], dict[str, Any]]:
        """Step with arrays instead of dicts; rows are the flock's agents in the order of ``possible_agents``.

        If predators are agents, ``info`` contains their observations (see ``reset_array``), and the property
        ``predator_reward`` holds the reward of each.

        Args:
            actions: shape (n, 1) or, for discrete actions, (n,); the rows of caught agents are ignored.
            predator_actions: shape (predators, D) if predators are agents; otherwise ``None``.

        Returns:
            New arrays: observations, shape (n, entries), and rewards, terminations and truncations, shape
            (n,); and an ``info`` of plain numbers and ``interaction_range``, shape (n,). A caught agent keeps
            its row: its observation is zeros and its termination True.
        """
        self._check_running()
        if self._predators or predator_actions is not None:
            predator_actions = self.predator_policy_spec.plain(predator_actions, len(self._predators))
        step = self._batch.step(actions, predator_actions=predator_actions)
        rows, rewards, has_ended, info = self._stepped(step)
        terminations, truncations = self._caught.copy(), np.full(len(self._caught), has_ended)
        if self.scenario.capture_radius is not None:
            truncations &= ~terminations
        return rows, rewards, terminations, truncations, self._with_arrays(info, step[3])

    @property
    def predator_reward(self) -> float:
        """Reward of each predator in the last step: minus the mean reward of the flock's agents."""
        return float(self._batch.core.predator_rewards()[0])

    def state(self) -> NDArray[np.float32]:
        """Return the state of the flock as a flat array; the argument ``state`` says which.

        The entries of ``"full"`` are the step, the running minima of the mean and the minimum distance, the
        positions and velocities of the agents, and those of the predators, in m and m/s. They are clipped to
        the finite numbers of float32.
        """
        if self._state == "flock_view":
            view: Observation = self._batch.core.observe([0], "flock")[0]
            return view
        state = self._batch.core.state(0)
        metrics = self._batch.core.metrics()
        scalars = [state["step"], metrics["min_mean_distance"][0], metrics["min_min_distance"][0]]
        names = ("positions", "velocities", "predator_positions", "predator_velocities")
        numbers = np.concatenate([scalars, *(state[name].ravel() for name in names)])
        return numbers.clip(-_LARGEST, _LARGEST).astype(np.float32)

    def _settle(self) -> None:
        super()._settle()
        self._name_agents(has_ended=self._batch.core.has_ended(0))

    def _resume(self, rows: Observation) -> dict[str, Observation]:
        self._name_agents(has_ended=self._batch.core.has_ended(0))
        flock = self.agents[: len(self.agents) - len(self._predators)]
        return self._by_name(flock, rows[~self._caught], self._predator_observations()) if self.agents else {}

    def _reset(self, seed: int | None, options: dict[str, Any] | None) -> tuple[Observation, dict[str, Any]]:
        given = as_mapping(options)
        known = {name: value for name, value in given.items() if name in RESET_OPTIONS}
        if len(known) < len(given):
            unknown = ", ".join(shown(name) for name in given if name not in known)
            message = f"reset() ignores unknown options {unknown}; known: {', '.join(RESET_OPTIONS)}"
            warnings.warn(message, UserWarning, stacklevel=3)
        rows, columns = self._batch.reset([0], [None if seed is None else as_seed(seed)], [known])
        self._name_agents(has_ended=False)
        self._show()
        return rows, info_dicts(columns)[0]

    def _drop_episodes(self) -> None:
        super()._drop_episodes()
        self.agents = []

    def _check_running(self) -> None:
        if not self.agents:
            raise ResetNeededError("step() called before reset() or after the end of the episode")

    def _stepped(self, step: Step) -> tuple[Observation, FloatArray, bool, dict[str, Any]]:
        """Update the names after a step; return observations, rewards, whether it was the last, ``info``."""
        rows, rewards, ended, _, columns = step
        has_ended = bool(ended[0])
        if has_ended or self.scenario.capture_radius is not None:
            self._name_agents(has_ended=has_ended)
        self._show()
        return rows, rewards, has_ended, info_dicts(columns)[0]

    def _name_agents(self, *, has_ended: bool) -> None:
        """Update ``agents`` and the caught agents after a step; ``flock`` is caught when all are."""
        caught = self._batch.core.caught()[0]
        self._caught = caught if self.policy_spec.per_agent else caught.all(keepdims=True)
        self.agents = [] if has_ended else [*compress(self._flock, ~self._caught), *self._predators]
        self._false = dict.fromkeys(self.agents, False)

    def _predator_observations(self) -> Observation:
        """Return the observations of the predators that are agents, one row each."""
        return self._batch.core.observe([0], "predators") if self._predators else np.zeros((0, 0), np.float32)

    def _by_name(self, agents: list[str], flock: Any, predators: Any) -> dict[str, Any]:
        named = dict(zip(agents, flock, strict=True))
        if self._predators:
            named.update(zip(self._predators, predators, strict=True))
        return named

    def _named_infos(
        self, agents: list[str], info: dict[str, Any], ranges: NDArray[np.float64]
    ) -> dict[str, dict[str, Any]]:
        named = dict(zip(agents, with_ranges(info, ranges), strict=True))
        named.update((predator, info.copy()) for predator in self._predators)
        return named

    def _with_arrays(self, info: dict[str, Any], ranges: NDArray[np.float64]) -> dict[str, Any]:
        info["interaction_range"] = ranges
        if self._predators:
            info["predator_observations"] = self._predator_observations()
        return info


def parallel_env(
    scenario: FlockScenario | str | None = None, **arguments: Unpack[ParallelArguments]
) -> FlockParallelEnv:
    """Return the PettingZoo parallel environment, a ``FlockParallelEnv``, which documents the arguments."""
    return FlockParallelEnv(scenario, **arguments)


def raw_env(
    scenario: FlockScenario | str | None = None, **arguments: Unpack[ParallelArguments]
) -> AECEnv[str, Observation, Any]:
    """Return the PettingZoo AEC environment without wrappers; see ``FlockParallelEnv``."""
    return parallel_to_aec_wrapper(FlockParallelEnv(scenario, **arguments))


def env(
    scenario: FlockScenario | str | None = None, **arguments: Unpack[ParallelArguments]
) -> AECEnv[str, Observation, Any]:
    """Return the PettingZoo AEC environment with ``OrderEnforcingWrapper``; see ``FlockParallelEnv``."""
    return OrderEnforcingWrapper(raw_env(scenario, **arguments))
