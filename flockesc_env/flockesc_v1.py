"""The flock as a module of PettingZoo: ``flockesc_v1.parallel_env``, ``env`` and ``raw_env``."""

from flockesc_env.envs.pettingzoo import FlockParallelEnv, env, parallel_env, raw_env

__all__ = ["FlockParallelEnv", "env", "parallel_env", "raw_env"]
