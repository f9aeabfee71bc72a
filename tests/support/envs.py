"""Registries of the interfaces of flocks and of environment adapters, and functions that drive all of them.

The tests of lifecycles, threads, snapshots, copies and aliasing run over ``ADAPTERS``; those of seeds,
rewards, actions and options over ``FLOCKS``.
"""

from collections.abc import Callable
from functools import partial
from typing import Any, NamedTuple

import gymnasium
import numpy as np
from gymnasium.spaces import Box, MultiDiscrete
from gymnasium.vector import AutoresetMode
from option_table import RANDOM, UNLIKE, small_flock
from pettingzoo import AECEnv, ParallelEnv
from same import plain
from stable_baselines3.common.vec_env import VecEnv

import flockesc_env as fe
import flockesc_env.policies
from flockesc_env import flockesc_v1
from flockesc_env.envs.vector import BatchVectorEnv
from flockesc_env.episodes.spaces import PolicySpec
from flockesc_env.policies import Pursue, RowMemory
from flockesc_env.sb3 import vec_env

FLOCKS: dict[str, Callable[..., Any]] = {
    "gymnasium": fe.FlockEscapeEnv,
    "predator": fe.PredatorEnv,
    "parallel": fe.parallel_env,
    "aec": flockesc_v1.env,
    "vector": lambda scenario=None, num_flocks=1, **given: BatchVectorEnv(num_flocks, scenario, **given),
    "agent vector": lambda scenario=None, **given: BatchVectorEnv(None, scenario, per_agent=True, **given),
    "flock slots": vec_env,
    "agent slots": partial(vec_env, per_agent=True),
}
"""The environments of flocks by scenario and options."""
FLOCK = small_flock(num_steps=40)
"""Episodes of 10 actions."""
CAPTURE, HUNTED = FLOCK.replace(capture_radius=6.0), FLOCK.with_learned_predators()
LINE = fe.LineScenario(num_agents=30, escape_force="linear_as_printed", max_steps=10)
PICTURES = {"render_mode": "rgb_array", "render_size": 160}
REMEMBERING: dict[str, Callable[..., Any]] = {
    "gymnasium": partial(fe.FlockEscapeEnv, HUNTED),
    "predator": lambda predator_policy: fe.PredatorEnv(HUNTED, flock_policy=predator_policy, per_agent=True),
    **{mode.value: partial(BatchVectorEnv, 3, HUNTED, autoreset_mode=mode) for mode in AutoresetMode},
    "a slot per agent": partial(BatchVectorEnv, 10, HUNTED, per_agent=True),
    "parallel": partial(fe.parallel_env, HUNTED),
    "stable-baselines3": partial(vec_env, HUNTED, 3),
    "stable-baselines3, a slot per agent": partial(vec_env, HUNTED, 2, per_agent=True),
    "a slot per predator": lambda predator_policy: BatchVectorEnv(
        3, HUNTED, side="predator", flock_policy=predator_policy
    ),
}
"""Environments whose predator or flock follows the argument ``predator_policy``."""


class Adapter(NamedTuple):
    """How to create a small environment, and its capabilities."""

    make: Callable[[], Any]
    has_states: bool
    """Whether it has ``get_state`` and ``set_state``."""
    has_pictures: bool
    """Whether it renders, which SDL does only in one thread."""
    reuses_buffers: bool
    """Whether the next step overwrites the arrays that it returned."""


def adapter(make: Callable[..., Any], *arguments: Any, has_states: bool = True, **options: Any) -> Adapter:
    """Return an adapter with arguments of an environment."""
    called = partial(make, *arguments, **options)
    return Adapter(called, has_states, "render_mode" in options, options.get("copy") is False)


vector = partial(adapter, BatchVectorEnv, num_threads=2)
unlike = small_flock(3, num_steps=40, predators=RANDOM, capture_radius=2.0, **UNLIKE)
ADAPTERS = {
    "gymnasium": adapter(fe.FlockEscapeEnv, FLOCK),
    "gymnasium.make": adapter(gymnasium.make, "flockesc/FlockEscape-v1", scenario=FLOCK, has_states=False),
    "different agents with noise and delay": adapter(fe.FlockEscapeEnv, unlike),
    "chased": adapter(fe.FlockEscapeEnv, HUNTED, predator_policy=Pursue()),
    "discrete": adapter(fe.FlockEscapeEnv, FLOCK, action_mode="discrete", range_grid=[1.0, 5.0, 9.0]),
    "pictures": adapter(fe.FlockEscapeEnv, FLOCK, **PICTURES),
    "predator": adapter(fe.PredatorEnv, FLOCK),
    "line": adapter(fe.LineEscapeEnv, LINE),
    "line in pictures": adapter(fe.LineEscapeEnv, LINE, **PICTURES),
    "vector": vector(3, FLOCK),
    "vector in the same step": vector(3, FLOCK, autoreset_mode="SameStep", action_mode="discrete"),
    "vector without autoreset": vector(3, FLOCK, autoreset_mode="Disabled"),
    "vector in pictures": vector(3, FLOCK, autoreset_mode="SameStep", **PICTURES),
    "vector without copies": vector(3, FLOCK, copy=False),
    "vector of several scenarios": vector(3, [FLOCK, CAPTURE, small_flock(num_steps=25)]),
    "a slot per agent": vector(10, CAPTURE, per_agent=True),
    "parallel": adapter(fe.parallel_env, small_flock(3, num_steps=40), reward="individual"),
    "parallel with capture": adapter(fe.parallel_env, CAPTURE, reward="difference"),
    "parallel with predators": adapter(fe.parallel_env, HUNTED),
    "game of two": adapter(fe.parallel_env, HUNTED.replace(capture_radius=6.0), per_agent=False),
    "agent by agent": adapter(flockesc_v1.env, FLOCK, has_states=False),
    "stable-baselines3": adapter(vec_env, FLOCK, 3, num_threads=2),
    "stable-baselines3, a slot per agent": adapter(vec_env, CAPTURE, 2, per_agent=True, num_threads=2),
    "stable-baselines3, a slot per predator": adapter(vec_env, CAPTURE, 2, side="predator"),
}


class Weave(RowMemory):
    """A policy of a predator or a flock whose action depends on the number of actions since the start."""

    per_agent = True

    def __init__(self) -> None:
        self.calls = 0

    def act(self, observations: Any, spec: Any) -> Any:
        self.calls += 1
        begins = self._begin(len(observations))
        (count,) = self._recall(begins, 0)
        self._remember(len(begins), count + 1)
        share = count % 5 / 5
        if isinstance(spec, PolicySpec):
            return spec.actions.from_ranges(20.0 * share)
        return np.repeat(share[:, np.newaxis], spec.dimension, axis=1)


def start(env: Any, seed: int | None = None, options: Any = None) -> Any:
    """Reset with a seed, or without one."""
    if isinstance(env, VecEnv):
        if seed is not None:
            env.seed(seed)
        env.set_options(options)
        return env.reset()
    return env.reset(seed=seed, options=options)


def state(flock: Any) -> dict[str, Any]:
    """Return every property of a view of a flock by name; arrays are read-only and do not change."""
    names = [name for name, part in vars(type(flock)).items() if isinstance(part, property)]
    now = {name: getattr(flock, name) for name in names}
    assert not any(value.flags.writeable for value in now.values() if isinstance(value, np.ndarray))
    return now


def _drawn(space: Any, rng: np.random.Generator) -> Any:
    if isinstance(space, Box):
        return rng.uniform(space.low, space.high).astype(space.dtype)
    return rng.integers(space.nvec if isinstance(space, MultiDiscrete) else space.n)


def draw(env: Any, rng: np.random.Generator) -> Any:
    """Return a random action of every agent, or of every slot."""
    if isinstance(env, ParallelEnv | AECEnv):
        return {agent: _drawn(env.action_space(agent), rng) for agent in env.agents}
    if isinstance(env, VecEnv):
        return np.stack([_drawn(env.action_space, rng) for _ in range(env.num_envs)])
    return _drawn(env.action_space, rng)


def same_action(env: Any, action: Any) -> Any:
    """Return one action for every agent, or for every slot."""
    if isinstance(env, ParallelEnv | AECEnv):
        return dict.fromkeys(env.agents, action)
    if hasattr(env, "num_envs"):
        return np.tile(action, (env.num_envs, 1))
    return np.resize(action, env.action_space.shape)


def step(env: Any, actions: Any) -> Any:
    """Take a step; for AEC environments, one action of every agent."""
    if not isinstance(env, AECEnv):
        return env.step(actions)
    seen = []
    for _ in range(len(env.agents)):
        seen.append(env.last())
        env.step(None if any(seen[-1][2:4]) else actions[env.agent_selection])
    return seen


def info_of(environment: Any, returned: Any) -> dict[str, Any]:
    """Return the info of the flock, or of its first agent, from what a reset or a step returned."""
    if isinstance(environment, AECEnv):
        return dict(environment.infos["agent_0"])
    if isinstance(environment, VecEnv):
        return dict((returned[-1] if isinstance(returned, tuple) else environment.reset_infos)[0])
    return dict(returned[-1].get("agent_0", returned[-1]))


def has_ended(env: Any, returned: Any) -> bool:
    """Return whether an environment needs a reset after a step."""
    if isinstance(env, ParallelEnv | AECEnv):
        return not env.agents
    if getattr(env, "autoreset_mode", None) is AutoresetMode.DISABLED:
        return bool(np.any(returned[2] | returned[3]))
    return isinstance(env, gymnasium.Env) and bool(returned[2] or returned[3])


def play(env: Any, rng: np.random.Generator, num_steps: int) -> list[Any]:
    """Take random actions, reset after each episode, and return all results, comparable by ==."""
    seen: list[Any] = []
    for _ in range(num_steps):
        returned = step(env, draw(env, rng))
        seen.append(plain(returned))
        if getattr(env, "render_mode", None) == "rgb_array":
            seen.append(plain(env.render()))
        if has_ended(env, returned):
            seen.append(plain(env.reset()))
    return seen
