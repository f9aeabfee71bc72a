"""Benchmark of environment steps: interfaces of this project, VMAS and MPE2.

One call is an episode of 240 steps with its reset, at a range of 10 m. For slow peers it is a few steps.
"""

from __future__ import annotations

from collections.abc import Iterator
from functools import partial
from typing import Any

import gymnasium
import numpy as np

from flockesc_env import FlockScenario, NetworkPolicy, parallel_env, rollout
from flockesc_env.envs.vector import BatchVectorEnv
from flockesc_env.policies import Architecture
from flockesc_env.sb3 import vec_env
from speed.measure import EVERY_STEP, PROJECT, Call, Candidate, Comparison
from speed.peers import Peer

AGENTS, FLOCKS = 300, 64
RANGE = 10.0
STEPS = 240

ID = "flockesc_env:flockesc/FlockEscape-v1"
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
    one, many = np.full(1, RANGE, np.float32), np.full((FLOCKS, 1), RANGE, np.float32)
    agents, slots = (np.full((n * AGENTS, 1), RANGE, np.float32) for n in (1, FLOCKS))
    options: dict[str, Any] = {**EVERY_STEP, "action_mode": "range"}
    threads: dict[str, Any] = {"num_threads": 1, **options}
    env = gymnasium.make(ID, **options)
    vector = gymnasium.make_vec(ID, FLOCKS, "vector_entry_point", copy=False, **threads)
    vec = vec_env(num_flocks=FLOCKS, **threads)
    per_agent = BatchVectorEnv(FLOCKS * AGENTS, per_agent=True, copy=False, **threads)
    parallel, few = parallel_env(**options), parallel_env(infos="end", **options)
    dicts = dict.fromkeys(parallel.possible_agents, one)
    rows: dict[str, tuple[int, Call, Call]] = {
        "Gymnasium": (1, partial(env.reset, seed=0), lambda: env.step(one)),
        "Gymnasium vector": (FLOCKS, partial(vector.reset, seed=0), lambda: vector.step(many)),
        "stable-baselines3": (FLOCKS, lambda: (vec.seed(0), vec.reset()), lambda: vec.step(many)),
        "a slot per agent": (FLOCKS, partial(per_agent.reset, seed=0), lambda: per_agent.step(slots)),
        "PettingZoo": (1, partial(parallel.reset, seed=0), lambda: parallel.step(dicts)),
        "PettingZoo, arrays": (1, partial(parallel.reset_array, seed=0), lambda: parallel.step_array(agents)),
        "PettingZoo, infos at the end": (1, partial(few.reset, seed=0), lambda: few.step(dicts)),
    }
    for name, (flocks, reset, step) in rows.items():
        yield steps(f"{PROJECT}, {name}", reset, step, flocks=flocks)
    architecture = Architecture(_INPUTS, hidden=(8,), mirror=True)
    network = NetworkPolicy(architecture, np.linspace(-1, 1, architecture.size))
    alone: dict[str, Any] = {**EVERY_STEP, "per_agent": True, "num_threads": 1}
    played = partial(rollout, FlockScenario(), network, range(FLOCKS), **alone)
    case = {"agents": AGENTS, "flocks": FLOCKS}
    yield Candidate(f"{PROJECT}, `rollout` of a network per agent", played, STEPS, case=case)


def _no_dynamics() -> Candidate:
    """The five dicts of a step of a PettingZoo environment."""
    names = [f"agent_{i:03d}" for i in range(AGENTS)]
    rows = np.zeros((AGENTS, 12), np.float32)

    def step() -> object:
        numbers = [dict.fromkeys(names, value) for value in (0.0, False, False)]
        return dict(zip(names, rows, strict=True)), *numbers, {name: {} for name in names}

    return steps("PettingZoo, no dynamics", None, step)


def _vmas() -> Candidate:
    import torch
    from vmas import make_env

    agents, flocks = 100, 512  # more flocks at once cost more per flock, as do fewer
    # With the default minimum distance between entities, placing 100 agents takes a minute.
    env = make_env(
        "flocking", num_envs=flocks, device="cpu", seed=0, n_agents=agents, min_dist_between_entities=0.05
    )
    actions = [torch.zeros(flocks, 2) for _ in range(agents)]
    return steps("VMAS flocking", None, partial(env.step, actions), count=2, agents=agents, flocks=flocks)


def _mpe2() -> Candidate:
    from mpe2 import simple_tag_v3

    env = simple_tag_v3.parallel_env(num_good=99, num_adversaries=1, max_cycles=10**9)
    env.reset(seed=0)
    actions = {agent: i % 5 for i, agent in enumerate(env.agents)}  # all five moves
    return steps("mpe2 simple_tag", None, partial(env.step, actions), count=5, agents=100)


def steps(
    name: str, reset: Call | None, step: Call, *, count: int = STEPS, agents: int = AGENTS, flocks: int = 1
) -> Candidate:
    """Return a candidate that resets and makes ``count`` steps per call."""

    def run() -> None:
        if reset:
            reset()
        for _ in range(count):
            step()

    return Candidate(name, run, count, case={"agents": agents, "flocks": flocks})
