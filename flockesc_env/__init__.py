"""Reinforcement-learning environments of a flock under attack, whose action is the interaction range.

- Tasks: ``tasks["one-range"]`` and others; each is a registered id, such as ``flockesc/one-range-v1``.
- Environments: ``gymnasium.make`` and ``make_vec``, ``parallel_env`` and ``flockesc_v1`` (PettingZoo),
  ``sb3.vec_env`` (stable-baselines3).
- Policies: ``load_policy`` returns a rule, a trained policy or a file; ``rollout`` plays one on many flocks;
  ``compare`` plays several and the best fixed range.
- Models: ``simulate``, ``sweep`` and ``scan`` of a ``FlockScenario``, a ``LineScenario`` or a preset.
- Modules: ``scenario`` (initial states, predators, neighbor rules, laws of motion, distributions), ``models``
  (graphs, order), ``policies``, ``sb3``, ``torchrl``, ``benchmarl``, ``jax``, ``jobs`` and ``render``.
"""

from importlib import import_module as _import_module
from typing import TYPE_CHECKING as _TYPE_CHECKING

from flockesc_env._core import __version__
from flockesc_env.common.errors import FlockescError, InputError, ResetNeededError
from flockesc_env.envs.gymnasium import FlockEscapeEnv, PredatorEnv
from flockesc_env.envs.line import LineEscapeEnv
from flockesc_env.episodes.starts import episode_seed
from flockesc_env.models.records import load_run, replay_run, save_run
from flockesc_env.models.scan import scan
from flockesc_env.models.simulate import simulate_line
from flockesc_env.models.sweep import sweep
from flockesc_env.policies.base import Policy
from flockesc_env.policies.compare import compare
from flockesc_env.policies.network import NetworkPolicy
from flockesc_env.policies.registry import load_policy, save_policy
from flockesc_env.policies.rollout import rollout
from flockesc_env.policies.rules import FixedRange, ScheduledRange, StubbornLeaders
from flockesc_env.policies.sb3 import SB3Policy
from flockesc_env.policies.simulate import simulate
from flockesc_env.scenario.flock import FlockScenario
from flockesc_env.scenario.line import LineScenario
from flockesc_env.scenario.options import EnvOptions, LineOptions
from flockesc_env.scenario.presets import PRESETS
from flockesc_env.taskset.registration import register as _register
from flockesc_env.taskset.task import tasks

if _TYPE_CHECKING:
    from flockesc_env.envs.pettingzoo import parallel_env

__all__ = [
    "PRESETS",
    "EnvOptions",
    "FixedRange",
    "FlockEscapeEnv",
    "FlockScenario",
    "FlockescError",
    "InputError",
    "LineEscapeEnv",
    "LineOptions",
    "LineScenario",
    "NetworkPolicy",
    "Policy",
    "PredatorEnv",
    "ResetNeededError",
    "SB3Policy",
    "ScheduledRange",
    "StubbornLeaders",
    "__version__",
    "compare",
    "episode_seed",
    "load_policy",
    "load_run",
    "parallel_env",
    "replay_run",
    "rollout",
    "save_policy",
    "save_run",
    "scan",
    "simulate",
    "simulate_line",
    "sweep",
    "tasks",
]

_MODULES = {"benchmarl", "flockesc_v1", "jax", "jobs", "sb3", "torchrl"}
"""Modules that are imported at their first use: they are slow to import or need an extra."""

_register()


if not _TYPE_CHECKING:

    def __getattr__(name: str) -> object:
        """Import PettingZoo, which fails in a deleted working folder, or a module at its first use."""
        if name == "parallel_env":
            return _import_module(f"{__name__}.envs.pettingzoo").parallel_env
        if name in _MODULES:
            return _import_module(f"{__name__}.{name}")
        raise AttributeError(f"module {__name__!r} has no attribute {name!r}")

    def __dir__() -> list[str]:
        """Return the names of the package, with those that ``__getattr__`` imports."""
        return sorted({*globals(), *__all__, *_MODULES})
