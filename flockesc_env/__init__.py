"""Reinforcement-learning environments of a flock under attack, whose action is the interaction range.

- Models: ``simulate``, ``simulate_line``, ``sweep``, ``scan``; neighbor graphs by ``component_labels``,
  ``neighbor_pairs``, ``laplacian`` and ``perron_matrix``; measures of order by ``rotation``, ``density``,
  ``nearest_neighbor_distances``, ``correlation_length`` and ``binder_cumulant``.
- Environments: ``flockesc/FlockEscape-v1``, ``flockesc/FlockAgents-v1``, ``flockesc/Predator-v1``,
  ``flockesc/LineEscape-v1`` and one id per task, such as ``flockesc/one-range-v1`` (Gymnasium);
  ``parallel_env`` and ``flockesc_env.flockesc_v1`` (PettingZoo); ``flockesc_env.sb3.vec_env``
  (stable-baselines3).
- Scenarios: ``FlockScenario``, ``LineScenario`` and the named ones in ``PRESETS``.
- Policies: ``FixedRange``, ``StubbornLeaders`` and others (``flockesc_env.policies``); ``rollout`` and
  ``record`` run a policy for whole episodes, ``bind`` turns it into a function from observation to action.
- Files: ``save_run`` and ``load_run`` for runs, ``save_policy`` and ``load_policy`` for policies.
"""

from typing import TYPE_CHECKING as _TYPE_CHECKING

import flockesc_env.notebook as _notebook  # noqa: F401, results show themselves in notebooks
from flockesc_env._core import __version__
from flockesc_env.common.errors import (
    FlockescError,
    InputError,
    ResetNeededError,
)
from flockesc_env.envs.gymnasium import FlockEscapeEnv
from flockesc_env.envs.line import LineEscapeEnv
from flockesc_env.envs.predator import PredatorEnv
from flockesc_env.episodes.options import EnvOptions, LineOptions
from flockesc_env.episodes.seeds import episode_seed
from flockesc_env.episodes.spaces import PolicySpec
from flockesc_env.models.graph import component_labels, laplacian, neighbor_pairs, perron_matrix
from flockesc_env.models.order import (
    binder_cumulant,
    correlation_length,
    density,
    nearest_neighbor_distances,
    rotation,
)
from flockesc_env.models.records import RecordedRun, load_run, replay_run, run_differences, save_run
from flockesc_env.models.scan import ScanResult, scan
from flockesc_env.models.simulate import LineTrajectory, Trajectory, simulate, simulate_line
from flockesc_env.models.sweep import FlockSweepResult, LineSweepResult, SweepResult, sweep
from flockesc_env.policies.base import Policy, bind
from flockesc_env.policies.files import load_policy, save_policy
from flockesc_env.policies.memory_rules import StubbornWitnesses
from flockesc_env.policies.network import Architecture, NetworkPolicy
from flockesc_env.policies.playing import Episodes, LineEpisodes
from flockesc_env.policies.predators import FlyStraight, Pursue
from flockesc_env.policies.ranges import FixedRange, RandomRange, ScheduledRange
from flockesc_env.policies.registry import NamedPolicy, built_in
from flockesc_env.policies.rollout import record, rollout
from flockesc_env.policies.rules import StubbornLeaders
from flockesc_env.policies.sb3 import SB3Policy
from flockesc_env.registration import register as _register
from flockesc_env.render import RenderOptions
from flockesc_env.scenario.approach import approach
from flockesc_env.scenario.flock import FlockScenario
from flockesc_env.scenario.initial import (
    AlignedHeadings,
    Clusters,
    Disc,
    Gaussian,
    GivenHeadings,
    GivenPositions,
    RandomHeadings,
    Ring,
    Segment,
    Square,
)
from flockesc_env.scenario.initial_files import read_initial_state
from flockesc_env.scenario.line import LineScenario
from flockesc_env.scenario.motion import FirstOrder, Inertial, PreferredDistance, Reynolds, Vicsek, Zones
from flockesc_env.scenario.neighbors import Metric, NeighborRule, Topological, Voronoi
from flockesc_env.scenario.predators import (
    Attracted,
    ConstantVelocity,
    Encircle,
    Herd,
    Intercept,
    Learned,
    PrescribedPath,
    PurePursuit,
    Wandering,
)
from flockesc_env.scenario.presets import PRESETS, preset
from flockesc_env.scenario.randomization import Choice, LogUniform, Uniform

if _TYPE_CHECKING:
    from flockesc_env.envs.pettingzoo import parallel_env

__all__ = [
    "PRESETS",
    "AlignedHeadings",
    "Architecture",
    "Attracted",
    "Choice",
    "Clusters",
    "ConstantVelocity",
    "Disc",
    "Encircle",
    "EnvOptions",
    "Episodes",
    "FirstOrder",
    "FixedRange",
    "FlockEscapeEnv",
    "FlockScenario",
    "FlockSweepResult",
    "FlockescError",
    "FlyStraight",
    "Gaussian",
    "GivenHeadings",
    "GivenPositions",
    "Herd",
    "Inertial",
    "InputError",
    "Intercept",
    "Learned",
    "LineEpisodes",
    "LineEscapeEnv",
    "LineOptions",
    "LineScenario",
    "LineSweepResult",
    "LineTrajectory",
    "LogUniform",
    "Metric",
    "NamedPolicy",
    "NeighborRule",
    "NetworkPolicy",
    "Policy",
    "PolicySpec",
    "PredatorEnv",
    "PreferredDistance",
    "PrescribedPath",
    "PurePursuit",
    "Pursue",
    "RandomHeadings",
    "RandomRange",
    "RecordedRun",
    "RenderOptions",
    "ResetNeededError",
    "Reynolds",
    "Ring",
    "SB3Policy",
    "ScanResult",
    "ScheduledRange",
    "Segment",
    "Square",
    "StubbornLeaders",
    "StubbornWitnesses",
    "SweepResult",
    "Topological",
    "Trajectory",
    "Uniform",
    "Vicsek",
    "Voronoi",
    "Wandering",
    "Zones",
    "__version__",
    "approach",
    "bind",
    "binder_cumulant",
    "built_in",
    "component_labels",
    "correlation_length",
    "density",
    "episode_seed",
    "laplacian",
    "load_policy",
    "load_run",
    "nearest_neighbor_distances",
    "neighbor_pairs",
    "parallel_env",
    "perron_matrix",
    "preset",
    "read_initial_state",
    "record",
    "replay_run",
    "rollout",
    "rotation",
    "run_differences",
    "save_policy",
    "save_run",
    "scan",
    "simulate",
    "simulate_line",
    "sweep",
]

_register()


def __getattr__(name: str) -> object:
    """Import ``parallel_env`` at its first use: PettingZoo fails in a deleted working folder."""
    if name == "parallel_env":
        from flockesc_env.envs.pettingzoo import parallel_env

        return parallel_env
    raise AttributeError(f"module {__name__!r} has no attribute {name!r}")
