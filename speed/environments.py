"""Benchmark of environment steps: interfaces of this project, VMAS and MPE2.

One call is an episode of 240 steps with its reset, at a range of 10 m. For slow peers it is a few steps.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator
from functools import partial
from typing import Any, ClassVar

import gymnasium
import numpy as np
from pettingzoo import ParallelEnv

from flockesc_env import AgentVectorEnv, Architecture, FlockScenario, NetworkPolicy, parallel_env, rollout
from flockesc_env.sb3 import FlockVecEnv
from speed import PROJECT
from speed.measure import Candidate, Comparison
from speed.peers.model import Peer

AGENTS, FLOCKS = 300, 64
RANGE = 10.0
STEPS = 240

_ID = "flockesc_env:flockesc/FlockEscape-v0"
_INPUTS = (
    *("last_range", "neighbor_count", "heard_velocity_ahead", "heard_velocity_left", "predator_distance"),
    *("predator_direction_ahead", "predator_direction_left"),
    *("predator_velocity_ahead", "predator_velocity_left"),
)


def environments(_: list[Peer], *, quick: bool) -> Iterator[Comparison]:  # noqa: ARG001
    """Compare a step of every environment whose package is installed."""
    candidates = [*_own(), _no_dynamics()]
    for make in (_vmas, _mpe2):
        try:
            candidates.append(make())
        except ModuleNotFoundError as error:
            print(f"skipped {make.__name__.strip('_')}: {error.name} is not installed")
    yield Comparison(candidates, "environment step")


def _own() -> Iterator[Candidate]:
    one, many = np.array([RANGE], np.float32), np.full((FLOCKS, 1), RANGE, np.float32)
    env = gymnasium.make(_ID, action_mode="range")
    yield _episode(f"{PROJECT}, Gymnasium", lambda: env.reset(seed=0), lambda: env.step(one))

    vector = gymnasium.make_vec(
        _ID,
        num_envs=FLOCKS,
        vectorization_mode="vector_entry_point",
        num_threads=1,
        copy=False,
        action_mode="range",
    )
    name = f"{PROJECT}, Gymnasium vector"
    yield _episode(name, lambda: vector.reset(seed=0), lambda: vector.step(many), flocks=FLOCKS)

    vec = FlockVecEnv(FLOCKS, num_threads=1, action_mode="range")
    name = f"{PROJECT}, stable-baselines3"
    yield _episode(name, lambda: (vec.seed(0), vec.reset()), lambda: vec.step(many), flocks=FLOCKS)

    slots = AgentVectorEnv(FLOCKS * AGENTS, num_threads=1, copy=False, action_mode="range")
    columns = np.full((FLOCKS * AGENTS, 1), RANGE, np.float32)
    name = f"{PROJECT}, a slot per agent"
    yield _episode(name, lambda: slots.reset(seed=0), lambda: slots.step(columns), flocks=FLOCKS)

    dicts = parallel_env(action_mode="range")
    actions = dict.fromkeys(dicts.possible_agents, one)
    yield _episode(f"{PROJECT}, PettingZoo", lambda: dicts.reset(seed=0), lambda: dicts.step(actions))

    arrays = parallel_env(action_mode="range")
    rows = np.full((AGENTS, 1), RANGE, np.float32)
    name = f"{PROJECT}, PettingZoo, arrays"
    yield _episode(name, lambda: arrays.reset_array(seed=0), lambda: arrays.step_array(rows))

    few = parallel_env(action_mode="range", infos="end")
    name = f"{PROJECT}, PettingZoo, infos at the end"
    yield _episode(name, lambda: few.reset(seed=0), lambda: few.step(actions))

    architecture = Architecture(_INPUTS, hidden=(8,), mirror=True)
    network = NetworkPolicy(architecture, np.linspace(-1, 1, architecture.size))
    played = partial(rollout, FlockScenario(), network, range(FLOCKS), per_agent=True, num_threads=1)
    case = {"agents": AGENTS, "flocks": FLOCKS}
    yield Candidate(f"{PROJECT}, `rollout` of a network per agent", played, STEPS, case=case)


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
    return _episode("PettingZoo, no dynamics", env.reset, lambda: env.step({}))


def _vmas() -> Candidate:
    import torch
    from vmas import make_env

    agents, flocks = 100, 512  # more flocks at once cost more per flock, as do fewer
    # With the default minimum distance between entities, placing 100 agents takes a minute.
    env = make_env(
        "flocking", num_envs=flocks, device="cpu", seed=0, n_agents=agents, min_dist_between_entities=0.05
    )
    actions = [torch.zeros(flocks, 2) for _ in range(agents)]
    return _steps("VMAS flocking", lambda: env.step(actions), steps=2, agents=agents, flocks=flocks)


def _mpe2() -> Candidate:
    from mpe2 import simple_tag_v3

    env = simple_tag_v3.parallel_env(num_good=99, num_adversaries=1, max_cycles=10**9)
    env.reset(seed=0)
    actions = {agent: i % 5 for i, agent in enumerate(env.agents)}  # all five moves
    return _steps("mpe2 simple_tag", lambda: env.step(actions), steps=5, agents=100)


def _episode(
    name: str, reset: Callable[[], object], step: Callable[[], object], *, flocks: int = 1
) -> Candidate:
    return _steps(name, step, reset, steps=STEPS, agents=AGENTS, flocks=flocks)


def _steps(
    name: str,
    step: Callable[[], object],
    reset: Callable[[], object] = lambda: None,
    *,
    steps: int,
    agents: int,
    flocks: int = 1,
) -> Candidate:
    def run() -> None:
        reset()
        for _ in range(steps):
            step()

    return Candidate(name, run, steps, case={"agents": agents, "flocks": flocks})
