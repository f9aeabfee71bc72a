"""Every environment, small, behind two calls: ``MAKERS[name]()`` and ``play(env, num_steps)``."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import gymnasium
import numpy as np
from option_table import small_flock
from stable_baselines3.common.vec_env import VecEnv

from flockesc_env import (
    FlockEscapeEnv,
    FlockPursuitEnv,
    FlockVectorEnv,
    LineEscapeEnv,
    LineScenario,
    env,
    parallel_env,
)
from flockesc_env.sb3 import AgentVecEnv, FlockVecEnv

LINE = LineScenario(num_agents=30, escape_force="linear_as_printed", max_steps=10)

MAKERS: dict[str, Callable[[], Any]] = {
    "gymnasium": lambda: FlockEscapeEnv(small_flock()),
    "gymnasium.make": lambda: gymnasium.make("flockesc/FlockEscape-v0", scenario=small_flock()),
    "pictures": lambda: FlockEscapeEnv(small_flock(), render_mode="rgb_array"),
    "pursuit": lambda: FlockPursuitEnv(small_flock()),
    "line": lambda: LineEscapeEnv(LINE),
    "vector": lambda: FlockVectorEnv(4, small_flock(), num_threads=2),
    "vector without copies": lambda: FlockVectorEnv(4, small_flock(), copy=False, num_threads=2),
    "parallel": lambda: parallel_env(small_flock()),
    "agent by agent": lambda: env(small_flock()),
    "stable-baselines3": lambda: FlockVecEnv(4, small_flock(), num_threads=2),
    "stable-baselines3, a slot per agent": lambda: AgentVecEnv(2, small_flock(), num_threads=2),
}


def play(env: Any, num_steps: int, seed: int = 0) -> list[Any]:
    """Start with a seed, take random actions of another, and return all that the environment returned."""
    if isinstance(env, VecEnv):
        env.seed(seed)
        seen = [env.reset()]
        actions = np.random.default_rng(seed).uniform(-1, 1, (num_steps, env.num_envs, 1)).astype(np.float32)
        return seen + [env.step(action) for action in actions]
    if hasattr(env, "agent_iter"):
        env.reset(seed=seed)
        seen = []
        for _, agent in zip(range(num_steps * env.num_agents), env.agent_iter(), strict=False):
            seen.append(env.last())
            is_over = seen[-1][2] or seen[-1][3]
            env.step(None if is_over else np.array([(len(agent) % 3) - 1], np.float32))
        return seen
    seen = [env.reset(seed=seed)]
    if hasattr(env, "possible_agents"):
        action = np.array([0.3], np.float32)
        return seen + [env.step(dict.fromkeys(env.agents, action)) for _ in range(num_steps)]
    env.action_space.seed(seed)
    for _ in range(num_steps):
        seen.append(env.step(env.action_space.sample()))
        is_over = np.all(np.logical_or(seen[-1][2], seen[-1][3]))
        if env.render_mode == "rgb_array":
            seen.append(env.render())
        if is_over:
            break
    return seen
