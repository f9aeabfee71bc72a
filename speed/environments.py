"""Benchmark of environment steps: interfaces of this project, VMAS and MPE2.

``own_parts`` measures the examples of docs/your-own-parts.md beside a flock or environment without them.
One call is an episode of 240 steps with its reset, at a range of 10 m. For slow peers it is a few steps.
"""

import re
from collections.abc import Iterator
from functools import partial
from pathlib import Path
from typing import Any

import gymnasium
import numpy as np

from flockesc_env import FlockEscapeEnv, FlockScenario, NetworkPolicy, parallel_env, rollout
from flockesc_env.envs.vector import BatchVectorEnv
from flockesc_env.models import Flock
from flockesc_env.policies import Architecture
from flockesc_env.sb3 import vec_env
from speed.measure import EVERY_STEP, PROJECT, Call, Candidate, Comparison
from speed.peers import Peer

AGENTS, FLOCKS = 300, 64
RANGE = 10.0
STEPS = 240

ID = "flockesc_env:flockesc/FlockEscape-v1"
_INPUTS = (
    "last_range", "neighbor_count", "heard_velocity_ahead", "heard_velocity_left", "predator_distance",
    "predator_direction_ahead", "predator_direction_left",
    "predator_velocity_ahead", "predator_velocity_left",
)  # fmt: skip


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
    """Yield every interface of this project, with one range per flock or agent."""
    options: dict[str, Any] = {**EVERY_STEP, "action_mode": "range"}
    threads: dict[str, Any] = {"num_threads": 1, **options}
    one, per_flock, agents, per_agent = (
        np.full(shape, RANGE, np.float32) for shape in (1, (FLOCKS, 1), (AGENTS, 1), (FLOCKS * AGENTS, 1))
    )
    env = gymnasium.make(ID, **options)
    yield steps(f"{PROJECT}, Gymnasium", partial(env.reset, seed=0), lambda: env.step(one))
    vector = gymnasium.make_vec(ID, FLOCKS, "vector_entry_point", copy=False, **threads)
    reset: Call = partial(vector.reset, seed=0)
    yield steps(f"{PROJECT}, Gymnasium vector", reset, lambda: vector.step(per_flock), flocks=FLOCKS)
    vec = vec_env(num_flocks=FLOCKS, **threads)

    def reset_vec() -> None:
        vec.seed(0)
        vec.reset()

    yield steps(f"{PROJECT}, stable-baselines3", reset_vec, lambda: vec.step(per_flock), flocks=FLOCKS)
    slots = BatchVectorEnv(FLOCKS * AGENTS, per_agent=True, copy=False, **threads)
    reset = partial(slots.reset, seed=0)
    yield steps(f"{PROJECT}, a slot per agent", reset, lambda: slots.step(per_agent), flocks=FLOCKS)
    parallel = parallel_env(**options)
    dicts = dict.fromkeys(parallel.possible_agents, one)
    reset_array = partial(parallel.reset_array, seed=0)
    yield steps(f"{PROJECT}, PettingZoo", partial(parallel.reset, seed=0), lambda: parallel.step(dicts))
    yield steps(f"{PROJECT}, PettingZoo, arrays", reset_array, lambda: parallel.step_array(agents))
    few = parallel_env(infos="end", **options)
    reset = partial(few.reset, seed=0)
    yield steps(f"{PROJECT}, PettingZoo, infos at the end", reset, lambda: few.step(dicts))
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
    near = {"min_dist_between_entities": 0.05}  # with the default, placing 100 agents takes a minute
    env = make_env("flocking", num_envs=flocks, device="cpu", seed=0, n_agents=agents, **near)
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


def _flock(name: str, flock: Flock, agents: int) -> Candidate:
    return steps(name, partial(flock.set_state, flock.get_state()), partial(flock.step, RANGE), agents=agents)


def own_parts(_: list[Peer], *, quick: bool) -> Iterator[Comparison]:  # noqa: ARG001
    """Compare a model step with and without each example."""
    page, own = Path("docs/your-own-parts.md").read_text("utf-8"), dict[str, Any]()
    for block in re.findall(r"^```python\n(.*?)^```", page, re.DOTALL | re.MULTILINE):
        exec(block, own)  # noqa: S102, our own text
    for size, names in ((AGENTS, ("wall", "keep_distance")), (10_000, ("wall",))):
        scenario = FlockScenario(num_agents=size, initial_side=100 * (size / AGENTS) ** 0.5)
        forces = {"no force": None, **{name: own[name] for name in names}}
        flocks = {name: Flock(scenario, seed=0, num_threads=1, extra_force=f) for name, f in forces.items()}
        yield Comparison([_flock(name, each, size) for name, each in flocks.items()], "model step")
    options: dict[str, Any] = {**EVERY_STEP, "action_mode": "range"}
    flock, chased = gymnasium.make(ID, **options), FlockScenario().with_learned_predators()
    for envs in (
        {"flock": flock, "KeepTogether": own["KeepTogether"](flock), "WithShape": own["WithShape"](flock)},
        {"learned predator": FlockEscapeEnv(chased, **options)}
        | {"Circle": FlockEscapeEnv(chased, predator_policy=own["Circle"](), **options)},
    ):
        action = np.full(1, RANGE, np.float32)
        entries = [steps(name, env.reset, partial(env.step, action)) for name, env in envs.items()]
        yield Comparison(entries, "model step")
    agents, policy = parallel_env(**{**options, "predator_sensing_range": 30.0}), own["ListenUntilSeen"]()
    rows, ranges = [agents.reset_array(seed=0)[0]], np.full((AGENTS, 1), RANGE, np.float32)

    def act() -> None:
        rows[0] = agents.step_array(policy.act(rows[0], agents.policy_spec))[0]

    def reset() -> None:
        rows[0] = agents.reset_array(seed=0)[0]
        policy.reset(np.ones(AGENTS, bool))

    alone = steps("agents", partial(agents.reset_array, seed=0), lambda: agents.step_array(ranges))
    yield Comparison([alone, steps("ListenUntilSeen", reset, act)], "model step")
