"""Benchmark of environment steps: interfaces of this project, VMAS and MPE2.

One call is an episode of 240 steps with its reset, at a range of 10 m. For slow peers it is a few steps.
"""

from __future__ import annotations

from collections.abc import Callable
from functools import partial
from typing import Any, ClassVar

import gymnasium
import numpy as np
from pettingzoo import ParallelEnv

from benchmarks import PROJECT
from benchmarks.measure import Candidate, Record, cores, measure
from flockesc_env import parallel_env
from flockesc_env.sb3 import FlockVecEnv

AGENTS, FLOCKS = 300, 64
RANGE = 10.0
STEPS = 240

_ID = "flockesc_env:flockesc/FlockEscape-v0"


def run(*, quick: bool) -> list[Record]:
    """Time a step of every environment whose package is installed."""
    makers = [
        _gymnasium,
        _gymnasium_vector,
        _sb3,
        _pettingzoo,
        _pettingzoo_arrays,
        _no_dynamics,
        _vmas,
        _mpe2,
    ]
    with cores(1):
        candidates = []
        for make in makers:
            try:
                candidates.append(make())
            except ModuleNotFoundError as error:
                print(f"skipped {make.__name__.strip('_')}: {error.name} is not installed")
        return measure("environments", candidates, "environment step", repetitions=3 if quick else 5)


def _gymnasium() -> Candidate:
    env = gymnasium.make(_ID, action_mode="range")
    action = np.array([RANGE], np.float32)

    def episode() -> None:
        env.reset(seed=0)
        for _ in range(STEPS):
            env.step(action)

    return _own("Gymnasium", episode)


def _gymnasium_vector() -> Candidate:
    env = gymnasium.make_vec(
        _ID,
        num_envs=FLOCKS,
        vectorization_mode="vector_entry_point",
        num_threads=1,
        copy=False,
        action_mode="range",
    )
    actions = np.full((FLOCKS, 1), RANGE, np.float32)

    def episode() -> None:
        env.reset(seed=0)
        for _ in range(STEPS):
            env.step(actions)

    return _own("Gymnasium vector", episode, FLOCKS)


def _sb3() -> Candidate:
    env = FlockVecEnv(FLOCKS, num_threads=1, action_mode="range")
    actions = np.full((FLOCKS, 1), RANGE, np.float32)

    def episode() -> None:
        env.seed(0)
        env.reset()
        for _ in range(STEPS):
            env.step(actions)

    return _own("stable-baselines3", episode, FLOCKS)


def _pettingzoo() -> Candidate:
    env = parallel_env(action_mode="range")
    actions = {agent: np.array([RANGE], np.float32) for agent in env.possible_agents}
    return _own("PettingZoo", partial(_dict_episode, env, actions))


def _pettingzoo_arrays() -> Candidate:
    env = parallel_env(action_mode="range")
    actions = np.full((AGENTS, 1), RANGE, np.float32)

    def episode() -> None:
        env.reset_array(seed=0)
        for _ in range(STEPS):
            env.step_array(actions)

    return _own("PettingZoo, arrays", episode)


class _NoDynamics(ParallelEnv[str, Any, Any]):
    """A PettingZoo environment that does nothing: the cost of the five dicts of a step."""

    metadata: ClassVar[dict[str, Any]] = {"name": "no_dynamics_v0"}

    def __init__(self) -> None:
        self.possible_agents = self.agents = [f"agent_{i:03d}" for i in range(AGENTS)]
        self._rows = np.zeros((AGENTS, 12), np.float32)

    def reset(self, seed: int | None = None, options: dict[str, Any] | None = None) -> Any:  # noqa: ARG002
        return dict(zip(self.agents, self._rows, strict=True)), {agent: {} for agent in self.agents}

    def step(self, actions: dict[str, Any]) -> Any:  # noqa: ARG002
        return (
            dict(zip(self.agents, self._rows, strict=True)),
            dict.fromkeys(self.agents, 0.0),
            dict.fromkeys(self.agents, False),
            dict.fromkeys(self.agents, False),
            {agent: {} for agent in self.agents},
        )


def _no_dynamics() -> Candidate:
    env = _NoDynamics()
    actions = {agent: np.array([RANGE], np.float32) for agent in env.possible_agents}
    return _candidate("PettingZoo, no dynamics", partial(_dict_episode, env, actions), STEPS, AGENTS, 1)


def _vmas() -> Candidate:
    import torch
    from vmas import make_env

    agents, flocks, steps = 100, 32, 2
    # With the default minimum distance between entities, placing 100 agents takes a minute.
    env = make_env(
        "flocking", num_envs=flocks, device="cpu", seed=0, n_agents=agents, min_dist_between_entities=0.05
    )
    actions = [torch.zeros(flocks, 2) for _ in range(agents)]

    def some_steps() -> None:
        for _ in range(steps):
            env.step(actions)

    return _candidate("VMAS flocking", some_steps, steps, agents, flocks)


def _mpe2() -> Candidate:
    from mpe2 import simple_tag_v3

    agents, steps = 100, 5
    env = simple_tag_v3.parallel_env(num_good=99, num_adversaries=1, max_cycles=10**9)
    env.reset(seed=0)
    actions = {agent: i % 5 for i, agent in enumerate(env.agents)}  # all five moves

    def some_steps() -> None:
        for _ in range(steps):
            env.step(actions)

    return _candidate("mpe2 simple_tag", some_steps, steps, agents, 1)


def _dict_episode(env: ParallelEnv[str, Any, Any], actions: dict[str, Any]) -> None:
    env.reset(seed=0)
    for _ in range(STEPS):
        env.step(actions)


def _own(interface: str, episode: Callable[[], None], flocks: int = 1) -> Candidate:
    return _candidate(f"{PROJECT}, {interface}", episode, STEPS, AGENTS, flocks)


def _candidate(name: str, run: Callable[[], None], steps: int, agents: int, flocks: int) -> Candidate:
    return Candidate(name, run, steps, case={"agents": agents, "flocks": flocks})
